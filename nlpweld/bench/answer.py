"""One question, one answer: build the problem, solve it, and let the verifier have the last word."""

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.errors import OptionError
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import OutOfReach, reduced
from nlpweld.plan import Plan
from nlpweld.solvers import Budget, Outcome, make_solver
from nlpweld.verify import Report, verify
from nlpweld.verify.report import unreachable

FORMULATIONS = {"reduced": reduced}


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


def formulate(cell: Cell, formulation: str = "reduced", engine: str = "auto") -> Nlp:
    """Return a cell's problem in one of the formulations.

    Args:
        cell: the cell.
        formulation: name of the formulation.
        engine: ``numpy``, ``numba``, ``c``, or ``auto`` for the fastest that is installed; answers agree.

    Raises:
        OptionError: no such formulation or engine; lists those there are.
    """
    if formulation not in FORMULATIONS:
        raise OptionError(f"formulation '{formulation}' is unknown. There are: {', '.join(FORMULATIONS)}")
    return FORMULATIONS[formulation](cell, engine)


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
    """Return plan and report of a point of a problem; without a mode, of the best mode there."""
    assert nlp.unpack is not None
    plan = nlp.unpack(x, int(nlp.evaluate(x[None]).mode[0]) if mode is None else mode)
    if isinstance(plan, OutOfReach):
        return None, unreachable(plan.cell, plan.cell.placement(x), plan.station, plan.point, plan.cell.seam.points)
    return plan, verify(plan)


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
    chosen = make_solver(solver, preset, **options)
    reason = chosen.unsuitable(nlp)
    if reason:
        return Answer(Outcome("SKIPPED", None, 0, float("nan"), 0, 0.0, 0.0, message=reason), None, None)
    began = time.perf_counter()
    if nlp.prepare:
        nlp.prepare()
    prepared_s = time.perf_counter() - began
    outcome = chosen.solve(nlp, seed=seed, budget=budget or Budget())
    outcome = replace(outcome, build_s=prepared_s + outcome.build_s)
    if outcome.x is None:
        return Answer(outcome, None, None)
    return Answer(outcome, *evaluate_plan(nlp, outcome.x, outcome.mode))
