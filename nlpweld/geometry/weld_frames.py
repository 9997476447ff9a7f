"""Weld points with their directions, what every seam gives (NumPy only)."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class WeldFrames:
    """Weld points with their directions in C.

    Attributes:
        p_C: weld points, shape (M, 3) [m].
        tangent_C: unit tangents along the direction of welding, shape (M, 3).
        normal_C: unit weld normals from root to cap, shape (M, 3); orthogonal to the tangents.
    """

    p_C: np.ndarray
    tangent_C: np.ndarray
    normal_C: np.ndarray
