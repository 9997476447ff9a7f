"""Fronts of points with two values each, both to be maximised: who is not dominated, and what a front is worth."""

import numpy as np
from pymoo.indicators.hv import HV
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

BEYOND = 0.1  # how far the hypervolume's reference point lies beyond the worst values, as a share of their ranges


def non_dominated(values: np.ndarray) -> np.ndarray:
    """Return the indices of points (m, 2) that no other dominates, by falling first value."""
    if not len(values):
        return np.empty(0, dtype=int)
    front = NonDominatedSorting().do(-values, only_non_dominated_front=True)
    return front[np.argsort(-values[front, 0], kind="stable")]


def dominated(values: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Tell which points (m, 2) are dominated by one of others (k, 2): no worse in both values, better in one."""
    no_worse = np.all(by[None] >= values[:, None], axis=2)
    better = np.any(by[None] > values[:, None], axis=2)
    return np.asarray(np.any(no_worse & better, axis=1))


def hypervolumes(fronts: list[np.ndarray]) -> list[float]:
    """Return the hypervolume of fronts (m, 2) in one common frame (Zitzler and Thiele 1999).

    Values go from 0, the worst of all fronts' points, to 1, the best; the reference point lies a tenth beyond the
    worst, so a front of one ideal point has 1.21. An empty front has 0.
    """
    together = np.vstack(fronts)
    if not len(together):
        return [0.0] * len(fronts)
    best, worst = together.max(axis=0), together.min(axis=0)
    span = np.where(best > worst, best - worst, 1.0)
    volume = HV(ref_point=np.full(2, 1.0 + BEYOND))
    return [float(volume((best - front) / span)) if len(front) else 0.0 for front in fronts]
