"""How the workpiece is turned while a point is welded (NumPy only)."""

import numpy as np


def flat(normal: np.ndarray) -> np.ndarray:
    """Return the smallest rotations that turn weld normals to +z (position PA; Pan et al., Fig. 7).

    Args:
        normal: unit weld normals in C, shape (M, 3); none may be -z, where the smallest rotation is not unique.

    Returns:
        R_W_C, shape (M, 3, 3), with ``R_W_C @ normal = (0, 0, 1)``.
    """
    nx, ny, nz = normal[:, 0], normal[:, 1], normal[:, 2]
    k = 1.0 / (1.0 + nz)
    rows = [
        [1 - k * nx * nx, -k * nx * ny, -nx],
        [-k * nx * ny, 1 - k * ny * ny, -ny],
        [nx, ny, nz],
    ]
    return np.moveaxis(np.array(rows), -1, 0)
