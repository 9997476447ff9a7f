"""Branch and bound over boxes: where the best may still be, until a bound on it is low enough."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

BATCH = 256  # boxes split in one round
Bound = Callable[[np.ndarray, np.ndarray, np.ndarray, float], np.ndarray]


@dataclass(frozen=True, eq=False)
class Tree:
    """What is not yet settled: boxes that may hold something above the target, on one mode each.

    Attributes:
        lower: lower corners, shape (m, d).
        upper: upper corners, shape (m, d).
        mode: discrete choice of each box, shape (m,).
        bound: what nothing feasible in each box is above, shape (m,).
        settled: what nothing feasible in all other boxes is above.
        boxes: how many boxes were bounded so far.
    """

    lower: np.ndarray
    upper: np.ndarray
    mode: np.ndarray
    bound: np.ndarray
    settled: float = -np.inf
    boxes: int = 0

    @property
    def upper_bound(self) -> float:
        """What nothing feasible is above."""
        return float(max(self.settled, self.bound.max(initial=-np.inf)))


def whole(box: np.ndarray, modes: int = 1) -> Tree:
    """Return the tree that knows nothing yet: the whole box (2, d), once for every mode."""
    lower, upper = (np.repeat(corner[None], modes, axis=0) for corner in box)
    return Tree(lower, upper, np.arange(modes), np.full(modes, np.inf))


def explore(tree: Tree, bound: Bound, target: float, most: int, told: Callable[[Tree], None]) -> Tree:
    """Split boxes, the most promising first, until nothing is above a target or enough boxes were bounded.

    Rounds depend on the tree alone, so that one taken up again ends as it would have without the pause.

    Args:
        tree: where to go on from.
        bound: ``(lower, upper, mode, enough) -> bounds`` (m,); minus infinity excludes a box.
        target: a bound that is low enough.
        most: number of boxes after which no new round begins.
        told: called with the tree after every round.
    """
    while len(tree.bound) and tree.boxes < most:
        tree = split(tree, bound, target)
        told(tree)
    return tree


def split(tree: Tree, bound: Bound, target: float) -> Tree:
    """Return the tree after one round: its most promising boxes halved across their longest side."""
    order = np.argsort(-tree.bound, kind="stable")
    now, later = order[:BATCH], order[BATCH:]
    lower, upper, mode = halves(tree.lower[now], tree.upper[now], tree.mode[now])
    # a part is never worse than the whole
    found = np.minimum(bound(lower, upper, mode, target), np.tile(tree.bound[now], 2))
    kept = found > target
    return Tree(
        np.concatenate([tree.lower[later], lower[kept]]),
        np.concatenate([tree.upper[later], upper[kept]]),
        np.concatenate([tree.mode[later], mode[kept]]),
        np.concatenate([tree.bound[later], found[kept]]),
        max(tree.settled, float(found[~kept].max(initial=-np.inf))),
        tree.boxes + len(found),
    )


def halves(lower: np.ndarray, upper: np.ndarray, mode: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return boxes (m, d) halved across their longest sides, shapes (2 m, d) and (2 m,)."""
    rows, axis = np.arange(len(lower)), (upper - lower).argmax(axis=1)
    middle = 0.5 * (lower[rows, axis] + upper[rows, axis])
    below, above = upper.copy(), lower.copy()
    below[rows, axis], above[rows, axis] = middle, middle
    return np.concatenate([lower, above]), np.concatenate([below, upper]), np.tile(mode, 2)
