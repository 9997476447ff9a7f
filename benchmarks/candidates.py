"""The three sets of placements everything is timed on."""

import numpy as np

from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch

SETS = {
    "random": "uniform in the search box; most fail early, at reach, joint limits or the singularity floor",
    "near": "Gaussian, 3 mm, around (0, -0.166, 0.40) m; most need the full work",
    "full": "feasible ones only: nothing can be left out",
}
OPTIMUM_M = (0.0, -0.166, 0.40)
FEASIBLE_PART_M = (0.0, -0.21, 0.40)
JITTER_M = 1e-6  # makes copies of a candidate differ without changing what they cost


def candidates(cell: Cell, name: str, count: int, seed: int = 0) -> np.ndarray:
    """Return placements of one set, shape (count, 3) [m].

    Args:
        cell: the cell.
        name: a key of ``SETS``.
        count: how many.
        seed: of every draw.
    """
    rng = np.random.default_rng(seed)
    if name == "random":
        return rng.uniform(cell.box[0], cell.box[1], (count, 3))
    if name == "near":
        return OPTIMUM_M + 0.003 * rng.normal(size=(count, 3))
    X = FEASIBLE_PART_M + 0.03 * rng.normal(size=(20 * count + 100, 3))
    return X[Batch(cell, engine="numpy").evaluate(X).feasible][:count]


def copies(X: np.ndarray, times: int, seed: int = 0) -> np.ndarray:
    """Return each candidate ``times`` times, shuffled and jittered: the same mix, so costs compare fairly."""
    rng = np.random.default_rng(seed)
    many = np.tile(X, (times, 1))
    return rng.permutation(many + JITTER_M * rng.uniform(-1, 1, many.shape))
