"""Fronts of a cell's reduced form, by either method: every point a plan the verifier accepts."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from nlpweld.bench.answer import evaluate_plan
from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import reduced
from nlpweld.pareto.aims import Aim, Meter, verified_value
from nlpweld.pareto.front import non_dominated
from nlpweld.pareto.limited import Second, at_least, less
from nlpweld.pareto.nsga import nsga
from nlpweld.pareto.sweep import Found, farthest, sweep, verified
from nlpweld.plan import Plan
from nlpweld.verify import Report

ENGINE = "numpy"  # every level makes a cell of its own, which Numba would compile anew
LAST = 0.99  # of the way to the other end: from there on what is feasible is too thin for penalties
STILL = 1e-5  # [m], [m^3], [rad] or [s]; differences of a second value below it are the arithmetic's


@dataclass(frozen=True)
class Point:
    """A verified placement on the way to a front.

    Attributes:
        objective: the verifier's.
        value: of the second aim, the verifier's (:func:`~.aims.verified_value`).
        x: variables of the reduced form.
        level: of the second aim that was asked for, NaN where none was.
        closest_pair: the two bodies that come nearest to each other.
    """

    objective: float
    value: float
    x: tuple[float, ...]
    level: float
    closest_pair: str


@dataclass(frozen=True)
class Front:
    """What a method found for a pair of aims.

    Attributes:
        aim: the second aim.
        points: verified, the best objective first; none dominates another.
        refused: candidates the verifier refused, and levels without an answer.
        behind: verified points that others of the method dominate.
    """

    aim: Aim
    points: tuple[Point, ...]
    refused: int
    behind: int = 0

    @property
    def values(self) -> np.ndarray:
        """Objective and second value, both to be maximised, shape (m, 2)."""
        found = [(point.objective, rounded(self.aim.sense * point.value)) for point in self.points]
        return np.array(found, dtype=float).reshape(-1, 2)


@dataclass(frozen=True)
class Trade:
    """A cell's objective against a second aim.

    Attributes:
        cell: the cell.
        aim: the second aim.
    """

    cell: Cell
    aim: Aim
    batch: Batch = field(init=False)

    def __post_init__(self) -> None:
        """Build the exact model that measures."""
        object.__setattr__(self, "batch", Batch(self.cell, ENGINE))

    @cached_property
    def nlp(self) -> Nlp:
        """The cell's problem at its own levels."""
        return reduced(self.cell, ENGINE)

    @property
    def second(self) -> Second:
        """The second value at the seam's points, to be maximised."""
        meter = Meter(self.batch, self.aim)
        return lambda X, mode: rounded(self.aim.sense * meter(X, mode))

    def at(self, level: float, span: float) -> Nlp:
        """Return the problem at a level that the second value, to be maximised, keeps at the seam's points.

        Args:
            level: the level.
            span: how far levels go. A miss by a quarter of it counts as one: over as much, the objective may lose a
                good part of itself, which penalties must outweigh.
        """
        if self.aim.level is None:
            return at_least(self.nlp, less(self.batch, self.aim), level, span / 4)
        return reduced(self.cell.with_(constraints={self.aim.level: level - self.margin}), ENGINE)

    @property
    def margin(self) -> float:
        """What solvers keep at the seam's points besides a level of the cell."""
        limits = self.cell.constraints
        margins = {"clearance_m": limits.clearance_margin_m, "singularity_floor_m3": limits.singularity_margin_m3}
        return margins.get(self.aim.level or "", 0.0)

    def point(self, plan: Plan, report: Report, x: np.ndarray, level: float = np.nan) -> Point:
        """Return a verified answer as a point."""
        value = verified_value(self.aim, plan, report)
        return Point(report.objective, value, tuple(map(float, x)), level, report.closest_pair or "")

    def front(self, points: Iterable[Point], refused: int) -> Front:
        """Return those points that no other dominates."""
        every = Front(self.aim, tuple(points), refused)
        kept = non_dominated(every.values)
        return Front(self.aim, tuple(every.points[i] for i in kept), refused, len(every.points) - len(kept))


def rounded(value: np.ndarray | float) -> np.ndarray:
    """Return second values less what is smaller than arithmetic can tell."""
    return np.round(np.asarray(value) / STILL) * STILL


def by_nsga(
    trade: Trade, population: int = 40, generations: int = 50, seed: int = 0, told: Callable[[], object] | None = None
) -> Front:
    """Return the front by NSGA-II; see :func:`~.nsga.nsga` for what it takes."""
    points, refused = [], 0
    for x in nsga(trade.nlp, trade.second, population, generations, seed, told):
        plan, report = evaluate_plan(trade.nlp, x)
        if plan is None or not report.feasible:
            refused += 1
        else:
            points.append(trade.point(plan, report, x))
    return trade.front(points, refused)


def by_sweep(trade: Trade, count: int = 9, seed: int = 0, told: Callable[[], object] | None = None) -> Front:
    """Return the front by the epsilon-constraint method with Ipopt.

    It goes from the cell's own optimum to where the second value is greatest (:func:`~.sweep.farthest`), which is a
    point of its own.

    Args:
        trade: cell and second aim.
        count: answers of Ipopt, the first at the cell's own levels.
        seed: of every random draw.
        told: called after every level.
    """
    answers, levels, last = _answers(trade, count, seed, told)
    points = [
        trade.point(one.answer.plan, one.answer.report, one.x, level)
        for one, level in zip(answers, levels, strict=True)
        if one and one.answer and one.answer.plan and one.answer.report
    ]
    if last is not None:
        plan, report = evaluate_plan(trade.nlp, last)
        if plan is not None and report.feasible:
            points.append(trade.point(plan, report, last))
    return trade.front(points, len(answers) + 1 - len(points))


def _answers(
    trade: Trade, count: int, seed: int, told: Callable[[], object] | None
) -> tuple[list[Found | None], list[float], np.ndarray | None]:
    """Return Ipopt's answers, the levels of the second aim they keep, and the candidate at the other end."""
    own = verified(trade.nlp, seed=seed)
    last = farthest(trade.nlp, trade.second, seed)
    if own is None or last is None:
        return [own], [np.nan], last
    X = np.array([own.x, last])
    low, high = trade.second(X, trade.nlp.evaluate(X).mode)
    if not high - low > STILL:
        return [own], [np.nan], last
    shares = [*(k / (count - 1) for k in range(1, count - 1)), LAST]
    levels = [float(low + share * (high - low)) for share in shares]
    found = sweep(partial(trade.at, span=high - low), levels, partial(verified, seed=seed), told)
    return [own, *found], [np.nan, *levels], last
