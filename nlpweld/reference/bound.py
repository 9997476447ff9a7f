"""Upper bounds on the objective over boxes of placements, proven by enclosures of the cell's graphs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.engine.affine import EPS, AffineForms, Forms, chunks
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.coupling import point_data
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import signs
from nlpweld.reference.graphs import BoundGraphs

BOXES = 64  # taken at once
FIELDS = ("middle", "slopes", "error")
CRITICAL = 40  # levels looked at together, those a box may miss by most
WORTH = 0.02  # error of the objective, as a share of the bound wanted, above which multipliers gain too little
PENALTY = 100.0  # of missing a level, in units of the objective: bounds what the multipliers add up to


class CellBound:
    """Bounds the objective of every feasible placement in boxes of a cell's search box.

    A box is excluded where some level is certainly missed at some point. Elsewhere the mean over the seam of the
    objective's enclosures is a bound, made sharper by multiples of the levels (:func:`lagrange_bound`).
    """

    def __init__(self, cell: Cell, engine: str = "numpy", between: int = 1) -> None:
        """Build the graphs and their enclosures.

        Args:
            cell: the cell.
            engine: ``numba`` or ``numpy``.
            between: parts every step between seam points is cut into for the levels, which hold along the whole
                seam; the objective is the mean over the seam's own points whatever this is.
        """
        self.cell, self.between = cell, between
        graphs, s = BoundGraphs(cell), seam_parameters(cell)
        self._objective = AffineForms(graphs.objective, point_data(cell, s), engine)
        self._levels = [AffineForms(graphs.levels, point_data(cell, s), engine)]
        # looked at where the objective's enclosure is close already, as what follows
        self._levels.append(AffineForms(graphs.heights, point_data(cell, s), engine))
        if between > 1:
            dense, own = dense_parameters(s, cell.seam.closed, between)
            self._levels.append(AffineForms(graphs.levels, point_data(cell, dense)[:, ~own], engine))

    @cached_property
    def modes(self) -> np.ndarray:
        """Signs of every station's shoulder, elbow and wrist, for each mode, shape (M, 3 S)."""
        found = [[sign for branch in mode for sign in signs((*branch, "noflip"))] for mode in Batch(self.cell).modes]
        return np.array(found, dtype=float)

    def __call__(self, lower: np.ndarray, upper: np.ndarray, mode: np.ndarray, enough: float) -> np.ndarray:
        """Return bounds (m,), minus infinity where nothing is feasible and infinity where nothing is known.

        Args:
            lower: lower corners, shape (m, d) [m; rad].
            upper: upper corners, shape (m, d).
            mode: index of the mode of each box, shape (m,).
            enough: a bound this low need not be made any sharper.
        """
        found = np.full(len(lower), -np.inf)
        for part in chunks(len(lower), BOXES):
            found[part] = self._bounds(lower[part], upper[part], self.modes[mode[part]], enough)
        return found

    def _bounds(self, lower: np.ndarray, upper: np.ndarray, given: np.ndarray, enough: float) -> np.ndarray:
        bound = np.full(len(lower), -np.inf)
        levels = self._levels[0](lower, upper, given)
        possible = _possible(levels)
        objective = self._objective(lower[possible], upper[possible], given[possible]).mean()
        objective = Forms(*(getattr(objective, name)[..., 0, :] for name in FIELDS))
        bound[possible] = objective.upper
        worth = (objective.upper > enough) & (objective.error < WORTH * abs(enough))
        left = _Left(np.flatnonzero(possible), objective, [_boxes(levels, possible)]).only(worth)
        for further in self._levels[1:]:
            levels = further(lower[left.boxes], upper[left.boxes], given[left.boxes])
            possible = _possible(levels)
            bound[left.boxes[~possible]] = -np.inf
            left = replace(left, levels=[*left.levels, levels]).only(possible)
        for i, box in enumerate(left.boxes):
            bound[box] = left.sharp(i)
        return bound


@dataclass(frozen=True, eq=False)
class _Left:
    """Boxes whose bound can be made sharper.

    Attributes:
        boxes: their indices, shape (m,).
        objective: forms (m,).
        levels: several forms (outputs, m, points).
    """

    boxes: np.ndarray
    objective: Forms
    levels: list[Forms]

    def only(self, which: np.ndarray) -> "_Left":
        """Return some of them, by mask."""
        objective = Forms(*(getattr(self.objective, name)[..., which] for name in FIELDS))
        return _Left(self.boxes[which], objective, [_boxes(each, which) for each in self.levels])

    def sharp(self, i: int) -> float:
        """Return the sharper bound of one box."""
        objective = Forms(*(getattr(self.objective, name)[..., i] for name in FIELDS))
        mine = [(each.middle[:, i], each.slopes[:, :, i], each.error[:, i]) for each in self.levels]
        d = len(objective.slopes)
        return lagrange_bound(objective, [Forms(g.ravel(), b.reshape(d, -1), e.ravel()) for g, b, e in mine])


def _boxes(forms: Forms, which: np.ndarray) -> Forms:
    """Return forms (outputs, m, points) of some boxes, by mask."""
    return Forms(*(getattr(forms, name)[..., which, :] for name in FIELDS))


def _possible(levels: Forms) -> np.ndarray:
    """Return for forms (outputs, m, points) in which boxes no level is certainly missed, shape (m,)."""
    return np.all(levels.upper >= 0.0, axis=(0, 2))


def lagrange_bound(objective: Forms, levels: Sequence[Forms]) -> float:
    """Return a bound on an objective over a box where levels are not below zero; infinity where nothing is known.

    For multipliers m >= 0 and every t that keeps the levels, f(t) <= f(t) + sum_k m_k g_k(t), and the right-hand side
    is linear in t but for the errors of its forms. Any multipliers give a bound, so they need not be exact: they are
    those of the linear program that maximises f over the box under the levels, one penalised slack for all of them.

    Args:
        objective: form of f, scalar.
        levels: forms of g, each of shape (K,).
    """
    if not np.isfinite(objective.radius):
        return np.inf
    whole = Forms(*(np.concatenate([getattr(each, name) for each in levels], axis=-1) for name in FIELDS))
    lowest = np.where(np.isfinite(whole.lower), whole.lower, np.inf)  # what nothing is known of gives no slope
    critical = np.argsort(lowest, kind="stable")[:CRITICAL]
    critical = critical[lowest[critical] < 0.0]
    g, b, e = whole.middle[critical], whole.slopes[:, critical], whole.error[critical]
    # where the objective's own line is highest: if that keeps the levels, no multiplier lowers it
    if (g + e + np.sign(objective.slopes) @ b >= 0.0).all():
        return float(objective.upper)
    m = _multipliers(objective.slopes, g + e, b)
    value = objective.middle + objective.error + m @ (g + e) + np.abs(objective.slopes + b @ m).sum()
    # some 300 operations on numbers whose sizes add up to this
    size = abs(objective.middle) + objective.radius + m @ (np.abs(g) + e + np.abs(b).sum(axis=0))
    return float(min(value + 8 * EPS * size, objective.upper))


def _multipliers(a: np.ndarray, above: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Return multipliers (K,) of max a . t - PENALTY v over t in [-1, 1]^d, v >= 0, above + slopes . t + v >= 0."""
    from scipy.optimize import linprog  # half a second to import, and not everybody needs it

    rows = -np.column_stack([slopes.T, np.ones(len(above))])
    ends = [(-1.0, 1.0)] * len(a) + [(0.0, None)]
    solved = linprog(np.append(-a, PENALTY), A_ub=rows, b_ub=above, bounds=ends, method="highs")
    return np.zeros(len(above)) if solved.status != 0 else np.maximum(-solved.ineqlin.marginals, 0.0)


def dense_parameters(s: np.ndarray, closed: bool, between: int) -> tuple[np.ndarray, np.ndarray]:
    """Return seam parameters with every step cut into equal parts, ascending, and which of them are the seam's own.

    Args:
        s: the seam's own, shape (N,).
        closed: whether a step leads from the last to the first.
        between: parts of every step.
    """
    ends = np.append(s[1:], s[0] + 1.0) if closed else s[1:]
    share = np.arange(between) / between
    dense = (s[: len(ends), None] + share * (ends - s[: len(ends)])[:, None]).ravel()
    own = np.tile(share == 0.0, len(ends))
    return (dense, own) if closed else (np.append(dense, s[-1]), np.append(own, True))
