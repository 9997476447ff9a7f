"""Smooth paths along a seam from a few control points: cubic B-splines, periodic along a closed seam."""

import numpy as np


def basis(s: np.ndarray, count: int, closed: bool) -> np.ndarray:
    """Return the values of cubic B-splines at seam parameters; they are at least 0 and sum to 1.

    Args:
        s: seam parameters, shape (N,), in [0, 1], below 1 on a closed seam.
        count: control points, at least 4; evenly spread.
        closed: whether the path closes smoothly; an open one starts and ends at its end control points.

    Returns:
        B, shape (N, count): a path is ``B @ control``.
    """
    from scipy.interpolate import BSpline  # slow to import, and only redundant formulations need it

    if closed:
        knots = np.arange(-3, count + 4) / count
        full = BSpline.design_matrix(s, knots, 3).toarray()
        full[:, :3] += full[:, count:]
        return full[:, :count]
    knots = np.concatenate([np.zeros(3), np.linspace(0, 1, count - 2), np.ones(3)])
    return BSpline.design_matrix(s, knots, 3).toarray()
