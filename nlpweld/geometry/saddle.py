"""The saddle where two pipes meet (NumPy only)."""

import numpy as np

from nlpweld.cell.task import Tee
from nlpweld.geometry.weld_frames import WeldFrames


def saddle(tee: Tee, theta: np.ndarray) -> WeldFrames:
    """Return the frames of the saddle where two pipes meet (Pan et al., eq. 17).

    The weld normal bisects the two pipes' outward normals.

    Args:
        tee: the pipes, main along x and branch along z.
        theta: angle about the branch, shape (M,) [rad].
    """
    ra, rb = tee.main_radius_m, tee.branch_radius_m
    c, s = np.cos(theta), np.sin(theta)
    z = np.sqrt(ra**2 - (rb * s) ** 2)
    n_main = np.stack([np.zeros_like(z), rb * s, z], axis=-1) / ra
    n_branch = np.stack([c, s, np.zeros_like(z)], axis=-1)
    tangent = np.stack([-rb * s, rb * c, -(rb**2) * s * c / z], axis=-1)
    p = np.stack([rb * c, rb * s, z], axis=-1)
    return WeldFrames(p, _unit(tangent), _unit(n_main + n_branch))


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
