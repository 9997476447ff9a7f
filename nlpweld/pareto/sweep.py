"""The epsilon-constraint method (Haimes et al. 1971): best objectives at rising levels of the second value."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from nlpweld.bench.answer import Answer
from nlpweld.bench.answer import solve as solve_verified
from nlpweld.formulation.nlp import Evaluation, Nlp
from nlpweld.pareto.limited import Second
from nlpweld.solvers import Budget, make_solver

Solve = Callable[[Nlp], "Found | None"]


@dataclass(frozen=True, eq=False)
class Found:
    """What a problem's solver found feasible.

    Attributes:
        x: variables, shape (n,).
        mode: discrete choice.
        objective: the verifier's, or the exact model's where there is none.
        answer: with plan and report, where the problem has plans.
    """

    x: np.ndarray
    mode: int
    objective: float
    answer: Answer | None = None


def verified(nlp: Nlp, solver: str = "ipopt", seed: int = 0) -> Found | None:
    """Return a solver's answer if exact model and verifier accept it, else None.

    The verifier looks along the whole seam, but knows no level that the cell has none of.
    """
    answer = solve_verified(nlp, solver, seed=seed)
    solved = answer.outcome.status == "SOLVED" and answer.verified
    if not solved or answer.outcome.x is None or answer.report is None:
        return None
    return Found(answer.outcome.x, answer.outcome.mode, answer.report.objective, answer)


def unverified(nlp: Nlp, solver: str = "ipopt", seed: int = 0) -> Found | None:
    """Return a solver's answer if the exact model accepts it, for problems without plans, else None."""
    found = make_solver(solver).solve(nlp, seed=seed, budget=Budget())
    if found.status != "SOLVED" or found.x is None:
        return None
    return Found(found.x, found.mode, found.objective)


def sweep(
    problem: Callable[[float], Nlp],
    levels: Iterable[float],
    solve: Solve = verified,
    told: Callable[[], object] | None = None,
) -> list[Found | None]:
    """Return the best answer at every level, None where there is none.

    A level is solved from the problem's own starts and once more from its neighbour's answer; the better one counts.

    Args:
        problem: from a level to the problem that keeps it.
        levels: rising, the lowest first.
        solve: how a problem is solved.
        told: called after every level.
    """
    found: list[Found | None] = []
    for level in levels:
        nlp, before = problem(level), next((one for one in reversed(found) if one), None)
        tries = [solve(nlp), solve(nlp.started(before.x)) if before else None]
        found.append(max((one for one in tries if one), key=lambda one: one.objective, default=None))
        if told:
            told()
    return found


def farthest(nlp: Nlp, second: Second, seed: int = 0, population: int = 24, generations: int = 40) -> np.ndarray | None:
    """Return the candidate with the greatest second value, by differential evolution of the exact model, or None.

    That is the front's other end, where a sweep's levels end, too: beyond it nothing is feasible.

    Args:
        nlp: the problem.
        second: the value, asked of feasible candidates alone.
        seed: of every random draw.
        population: individuals.
        generations: generations.
    """
    other = replace(nlp, evaluate=partial(_by_second, nlp, second), relax=None, rebuild=None)
    solver = make_solver("de", "tuned", population=population, generations=generations)
    found = solver.solve(other, seed=seed, budget=Budget())
    return found.x if found.status == "SOLVED" else None


def _by_second(nlp: Nlp, second: Second, X: np.ndarray) -> Evaluation:
    found = nlp.evaluate(X)
    value, good = np.full(len(X), -np.inf), found.feasible
    if good.any():
        value[good] = second(X[good], found.mode[good])
    return replace(found, objective=value)
