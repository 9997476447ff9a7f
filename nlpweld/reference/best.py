"""The best verified answer of a cell: many candidates, the best few polished, margins taken back as far as holds."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nlpweld.bench.answer import Answer, solve
from nlpweld.cell.cell import Cell
from nlpweld.errors import OptionError
from nlpweld.formulation.margins import with_margins
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import reduced
from nlpweld.plan import Plan
from nlpweld.verify import Report

CHUNK = 4096  # candidates judged in one call
APART = 0.05  # of the box's diagonal, between starts
HALVINGS = 6  # of the solvers' margins
Told = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Found:
    """A verified answer.

    Attributes:
        plan: its joint paths.
        report: the verifier's.
    """

    plan: Plan
    report: Report

    @property
    def objective(self) -> float:
        """Mean MMR as the verifier found it."""
        return self.report.mmr_mean

    @property
    def x(self) -> np.ndarray:
        """Free coordinates, shape (d,) [m; rad]."""
        return self.plan.cell.coordinates(self.plan.placement)


def best_verified(
    cell: Cell, seed: int, candidates: int, polished: int, told: Told, engine: str = "auto"
) -> tuple[Found, Found]:
    """Return the best verified answer that keeps the solvers' margins, and the best without.

    Args:
        cell: the cell.
        seed: of the candidates.
        candidates: how many placements are judged.
        polished: from how many of the best ones, well apart, Ipopt descends.
        told: called with what is going on, how much is done, and of how much.
        engine: of the exact model; see :func:`~nlpweld.formulation.reduced.reduced`.

    Raises:
        OptionError: no candidate leads to a verified answer.
    """
    nlp = reduced(cell, engine)
    best: Found | None = None
    starts = best_candidates(nlp, seed, candidates, polished, told)
    for k, start in enumerate(starts):
        told("polishing", k, len(starts))
        best = better(best, descended(nlp, start, seed))
    if best is None:
        raise OptionError(f"{cell.name}: none of {candidates} candidates leads to a verified answer; take more")
    return best, _margins_taken_back(cell, best, seed, told, engine)


def best_candidates(nlp: Nlp, seed: int, candidates: int, count: int, told: Told) -> list[np.ndarray]:
    """Return the best candidates that lie apart, feasible ones first, each (d,)."""
    X = nlp.starts(seed, candidates)
    total, objective = np.empty(candidates), np.empty(candidates)
    for start in range(0, candidates, CHUNK):
        told("candidates", start, candidates)
        part = slice(start, start + CHUNK)
        found = nlp.evaluate(X[part])
        total[part], objective[part] = found.total, found.objective
    apart, chosen = APART * float(np.linalg.norm(nlp.upper - nlp.lower)), list[np.ndarray]()
    for i in np.lexsort((-objective, total)):
        if all(np.linalg.norm(X[i] - other) > apart for other in chosen):
            chosen.append(X[i])
        if len(chosen) == count:
            break
    return chosen


def descended(nlp: Nlp, start: np.ndarray, seed: int) -> Answer:
    """Return Ipopt's answer from one start, on the branches that are best there."""
    return solve(
        replace(nlp, sample=lambda _, count: np.repeat(start[None], count, axis=0)), "ipopt", seed=seed, scouts=1
    )


def better(best: Found | None, answer: Answer) -> Found | None:
    """Return the better of a verified answer and one that may not be."""
    if not answer.verified:
        return best
    assert answer.plan is not None
    assert answer.report is not None
    return Found(answer.plan, answer.report) if best is None or answer.report.mmr_mean > best.objective else best


def _margins_taken_back(cell: Cell, best: Found, seed: int, told: Told, engine: str) -> Found:
    """Return the best answer with smaller margins that the verifier still accepts, their share found by halving."""
    level, kept, refused = cell.constraints, 1.0, 0.0
    stated = {
        "singularity": level.singularity_margin_m3,
        "clearance": level.clearance_margin_m,
        "joint_limit": float(np.radians(level.joint_margin_deg)),
    }
    for k in range(HALVINGS + 1):
        told("margins", k, HALVINGS + 1)
        share = 0.0 if k == 0 else (kept + refused) / 2
        less = with_margins(cell, {name: (share - 1) * amount for name, amount in stated.items()})
        nlp = reduced(less, engine)
        answer = descended(replace(nlp, widened=None), best.x, seed)
        best = better(best, answer) or best
        if answer.verified:
            kept = share
        else:
            refused = share
        if kept == 0.0:
            break
    return replace(best, plan=replace(best.plan, cell=cell))
