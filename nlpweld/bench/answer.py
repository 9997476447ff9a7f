"""One question, one answer: build the problem, solve it, and let the verifier have the last word."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from nlpweld.bench.margins import ROUNDS, wider
from nlpweld.cell.cell import Cell
from nlpweld.errors import OptionError
from nlpweld.formulation.full import full
from nlpweld.formulation.full_redundant import FULL_REDUNDANT, full_redundant
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import OutOfReach, reduced
from nlpweld.formulation.redundant import REDUNDANT, redundant
from nlpweld.formulation.robust import ROBUST, robust
from nlpweld.html_table import html_table
from nlpweld.plan import Plan
from nlpweld.solvers import Budget, Outcome, Solver, make_solver
from nlpweld.verify import Report, verify, verify_robust
from nlpweld.verify.report import unreachable

FORMULATIONS: dict[str, Callable[[Cell, str], Nlp]] = {
    "reduced": reduced,
    "full": full,
    ROBUST: robust,
    **{name: partial(redundant, level=level) for level, name in REDUNDANT.items()},
    **{name: partial(full_redundant, level=level) for level, name in FULL_REDUNDANT.items()},
}


@dataclass(frozen=True, eq=False)
class Answer:
    """What came out of one run.

    Attributes:
        outcome: what the solver claims.
        plan: joint paths of its answer, or None when there are none.
        report: what the verifier found, or None when the solver brought no point at all.
    """

    outcome: Outcome
    plan: Plan | None
    report: Report | None

    @property
    def verified(self) -> bool:
        """Whether the verifier found the answer feasible along the whole seam."""
        return self.report is not None and self.report.feasible

    def _repr_html_(self) -> str:
        """Show in a notebook what the solver claims, then what the verifier found."""
        claim = self.outcome
        rows = [("claimed", f"{claim.status} ({claim.message})"), ("evaluations", f"{claim.evaluations:,}")]
        rows.append(("time", f"build {claim.build_s:.2f} s, solve {claim.solve_s:.2f} s"))
        found = "no answer to verify" if self.report is None else "verified" if self.verified else "NOT verified"
        own = html_table(f"answer: {found}", rows)
        return own if self.report is None else own + self.report._repr_html_()


def formulate(cell: Cell, formulation: str = "reduced", engine: str = "auto") -> Nlp:
    """Return a cell's problem in one of the formulations.

    Args:
        cell: the cell.
        formulation: name of the formulation.
        engine: ``numpy``, ``numba``, ``c``, or ``auto`` for the fastest that is installed; answers agree.

    Raises:
        OptionError: no such formulation or engine; lists those there are.
    """
    return FORMULATIONS[known_formulation(formulation)](cell, engine)


def known_formulation(name: str) -> str:
    """Return a formulation's name if there is one of that name.

    Raises:
        OptionError: there is none; lists those there are.
    """
    if name not in FORMULATIONS:
        raise OptionError(f"formulation '{name}' is unknown. There are: {', '.join(FORMULATIONS)}")
    return name


def with_branches(cell: Cell, branches: str | None) -> Cell:
    """Return the cell with its inverse kinematics branches opened (``any``) or held to ``front`` shoulder, elbow up.

    Raises:
        OptionError: neither of the two.
    """
    choices: dict[str, dict[str, object]] = {
        "front": {"shoulder": "front", "elbow": "up", "wrist": "any"},
        "any": {"shoulder": "any", "elbow": "any", "wrist": "any"},
    }
    if branches is None:
        return cell
    if branches not in choices:
        raise OptionError(f"branches '{branches}' is unknown. There are: {', '.join(choices)}")
    return cell.with_(configuration=choices[branches])


def evaluate(cell: Cell, at: tuple[float, ...] | np.ndarray) -> Report:
    """Return the verifier's report of a placement, on the best branches the cell allows.

    Args:
        cell: the cell.
        at: x, y, z of the placement frame in W [m], and its yaw [rad] if it is turned.

    Raises:
        OptionError: a coordinate is not finite, or the cell holds it at another value.
        KinematicsError: a positioner cannot turn the seam upright.
    """
    return evaluate_plan(reduced(cell, engine="numpy"), coordinates(cell, at))[1]


def coordinates(cell: Cell, at: tuple[float, ...] | np.ndarray) -> np.ndarray:
    """Return the free coordinates of a placement x, y, z [m] and perhaps yaw [rad].

    Raises:
        OptionError: a coordinate is not finite, or the cell holds it at another value.
    """
    placement = np.asarray(at, dtype=float)
    if not np.isfinite(placement).all():
        raise OptionError(f"placement {placement.tolist()} holds NaN or infinity; give finite numbers in metres")
    return cell.coordinates(placement)


def evaluate_plan(nlp: Nlp, x: np.ndarray, mode: int | None = None) -> tuple[Plan | None, Report]:
    """Return plan and report of a point of a problem; without a mode, of the best mode there.

    An answer of the robust form is verified in every scenario.
    """
    assert nlp.unpack is not None
    plan = nlp.unpack(x, int(nlp.evaluate(x[None]).mode[0]) if mode is None else mode)
    if isinstance(plan, OutOfReach):
        cell = plan.cell
        at = cell.placement(x[: len(cell.variables)])
        return None, unreachable(cell, at, plan.station, plan.point, cell.seam.points)
    return plan, verify_robust(plan) if nlp.formulation == ROBUST else verify(plan)


def solve(
    nlp: Nlp,
    solver: str = "ipopt",
    *,
    seed: int = 0,
    budget: Budget | None = None,
    preset: str = "default",
    **options: Any,
) -> Answer:
    """Solve a problem and verify the answer.

    Where the answer holds at the seam's points and misses a level between them, the solvers' margins are grown by
    what it misses and the problem is solved again; the message says how often.

    Args:
        nlp: the problem, e.g. ``reduced(cell)``.
        solver: name of a solver.
        seed: seed of every random draw.
        budget: limits; none by default beside the solver's own.
        preset: named options of the solver.
        options: single options of the solver.

    Raises:
        OptionError: no such solver, preset or option.
    """
    chosen, budget = make_solver(solver, preset, **options), budget or Budget()
    reason = chosen.unsuitable(nlp)
    if reason:
        return Answer(Outcome("SKIPPED", None, 0, float("nan"), 0, 0.0, 0.0, message=reason), None, None)
    answer = _once(nlp, chosen, seed, budget)
    for round_ in range(1, ROUNDS + 1):
        again = wider(nlp, answer.report) if answer.report and answer.outcome.status == "SOLVED" else None
        left = _left(budget, answer.outcome)
        if again is None or left is None:
            break
        nlp = again
        answer = _after(answer, _once(nlp, chosen, seed, left), round_)
    return answer


def _once(nlp: Nlp, solver: Solver, seed: int, budget: Budget) -> Answer:
    """Solve a problem once and verify the answer."""
    began = time.perf_counter()
    if nlp.prepare:
        nlp.prepare()
    prepared_s = time.perf_counter() - began
    outcome = solver.solve(nlp, seed=seed, budget=budget)
    outcome = replace(_later(outcome, prepared_s), build_s=prepared_s + outcome.build_s)
    if outcome.x is None:
        return Answer(outcome, None, None)
    return Answer(outcome, *evaluate_plan(nlp, outcome.x, outcome.mode))


def _later(outcome: Outcome, by_s: float) -> Outcome:
    """Return an outcome whose steps and improvements happened later, for what had gone before."""
    trace = tuple(replace(step, time_s=step.time_s + by_s) for step in outcome.trace)
    improvements = tuple(replace(step, time_s=step.time_s + by_s) for step in outcome.improvements)
    return replace(outcome, trace=trace, improvements=improvements)


def _left(budget: Budget, spent: Outcome) -> Budget | None:
    """Return what a run leaves of its budget, or None where that is nothing."""
    time_s = None if budget.time_s is None else budget.time_s - spent.build_s - spent.solve_s
    evaluations = None if budget.evaluations is None else budget.evaluations - spent.evaluations
    if min(limit for limit in (time_s, evaluations, np.inf) if limit is not None) <= 0:
        return None
    return Budget(evaluations, time_s)


def _after(first: Answer, second: Answer, round_: int) -> Answer:
    """Return the second answer with the cost of both, its plan in the cell as it is stated."""
    a = first.outcome
    b = _later(second.outcome, a.build_s + a.solve_s)
    plan = second.plan
    if plan is not None and first.plan is not None:
        stated = first.plan.cell.model_copy(update={"stations": plan.cell.stations})  # each has its own layout
        plan = replace(plan, cell=stated)
    outcome = replace(
        b,
        evaluations=a.evaluations + b.evaluations,
        build_s=a.build_s + b.build_s,
        solve_s=a.solve_s + b.solve_s,
        message=f"{b.message}; margins grown {round_} times",
        trace=a.trace + b.trace,
        improvements=b.improvements,  # of the first round were feasible under margins that did not suffice
    )
    return Answer(outcome, plan, second.report)
