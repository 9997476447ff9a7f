"""Clearances over arrays: bodies far apart are told by their boxes and middles, and only the rest is measured."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nlpweld.engine.lanes import Lanes
from nlpweld.formulation.stage import Owners, Shape

LANES = 8192  # measured at once, so that what comes in between fits the cache


def boxes(ends: Lanes, shapes: Sequence[Shape]) -> np.ndarray:
    """Return the least and greatest coordinates of bodies over the seam, shape (2, b, 3, m) [m].

    Args:
        ends: start and end of one body beside the other, 6 b lanes (m, N) [m].
        shapes: the bodies.
    """
    found = np.empty((2, len(shapes), 3, len(ends[0])))
    for i, shape in enumerate(shapes):
        for c in range(3):
            start, end = ends[6 * i + c], ends[6 * i + 3 + c]
            found[0, i, c] = np.minimum(start, end).min(axis=1) - shape.radius_m
            found[1, i, c] = np.maximum(start, end).max(axis=1) + shape.radius_m
    return found


@dataclass(frozen=True, eq=False)
class Meeting:
    """The pairs of two owners' bodies, ready to be looked at.

    Attributes:
        gap: the stage's gap graph, lowered to NumPy.
        pairs: bodies by index, shape (P, 2).
        numbers: for each pair squared lengths [m^2] and sum of radii [m], shape (P, 3).
    """

    gap: Callable[..., tuple[list[np.ndarray], ...]]
    pairs: np.ndarray
    numbers: np.ndarray

    @staticmethod
    def of(gap: Callable, pairs: tuple[Owners, ...], a: Sequence[Shape], b: Sequence[Shape]) -> "Meeting":
        """Return the meeting of two owners of some shapes."""
        rows = [(a[i].sq_length, b[j].sq_length, a[i].radius_m + b[j].radius_m) for i, j in pairs]
        return Meeting(gap, np.array(pairs, dtype=int).reshape(-1, 2), np.array(rows).reshape(-1, 3))

    def lowest(self, a: Lanes, boxes_a: np.ndarray, b: Lanes, boxes_b: np.ndarray, level: float) -> np.ndarray:
        """Return the least clearance of each candidate, or the level where none is below it, (m,) [m].

        Args:
            a: ends of the first owner's bodies, lanes (m, N) [m].
            boxes_a: their boxes.
            b: ends of the second owner's bodies.
            boxes_b: their boxes.
            level: clearances above it do not matter [m].
        """
        low = np.full(len(a[0]), level)
        found = [self._near(p, a, b, level) for p in self._boxes_touch(boxes_a, boxes_b, level)]
        if not found:
            return low
        lane, ends = (np.concatenate(same, axis=-1) for same in zip(*found, strict=True))
        for begin in range(0, len(lane), LANES):
            part = slice(begin, begin + LANES)
            ((gaps,),) = self.gap(*ends[:12, part].reshape(2, 6, -1), ends[12:, part])
            np.minimum.at(low, lane[part] // a[0].shape[1], gaps)
        return low

    def _boxes_touch(self, boxes_a: np.ndarray, boxes_b: np.ndarray, level: float) -> list[int]:
        """Return the pairs whose boxes come nearer than a level for any candidate."""
        (low_a, high_a), (low_b, high_b) = boxes_a[:, self.pairs[:, 0]], boxes_b[:, self.pairs[:, 1]]
        touch = (low_a < high_b + level) & (low_b < high_a + level)
        return [int(p) for p in np.flatnonzero(touch.all(axis=1).any(axis=1))]

    def _near(self, p: int, a: Lanes, b: Lanes, level: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the lanes, numbered row by row, where a pair's gap may be below a level, and what the gap graph takes.

        First by the distance of the axes' middles less half their lengths, then by the same less what each axis
        extends towards the other's middle.
        """
        (i, j), (sq_a, sq_b, radii) = self.pairs[p], self.numbers[p]
        mine, theirs = a[6 * i : 6 * i + 6], b[6 * j : 6 * j + 6]
        x, y, z = (mine[c] + mine[3 + c] - theirs[c] - theirs[3 + c] for c in range(3))
        bound = np.sqrt(sq_a) + np.sqrt(sq_b) + 2 * (radii + level)  # of twice the distance
        lane = np.flatnonzero(x * x + y * y + z * z < bound * bound)
        ends = np.array([own.take(lane) for own in (*mine, *theirs)])
        near = _axes_near(ends, radii + level)
        numbers = np.broadcast_to(self.numbers[p][:, None], (3, len(near)))
        return lane[near], np.vstack([ends, numbers])[:, near]


def _axes_near(ends: np.ndarray, bound: float) -> np.ndarray:
    """Return where two axes, ends (12, L), may come nearer than a bound: segments by their shadows on one line."""
    p, q = ends[3:6] - ends[:3], ends[9:] - ends[6:9]
    d = ends[:3] - ends[6:9] + 0.5 * (p - q)
    square = (d * d).sum(axis=0)
    least_sq = square - 0.5 * (np.abs((p * d).sum(axis=0)) + np.abs((q * d).sum(axis=0)))
    return (least_sq < 0.0) | (least_sq * least_sq < bound * bound * square)
