"""Seam curves in the workpiece frame C: points, tangents and weld normals (NumPy only)."""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.task import Tee


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


def seam_parameters(cell: Cell) -> np.ndarray:
    """Return the seam parameter of the cell's points, shape (N,), each in [0, 1)."""
    return np.arange(cell.seam.points) / cell.seam.points


def weld_frames(cell: Cell, s: np.ndarray) -> WeldFrames:
    """Return the weld frames of the cell's seam.

    Args:
        cell: the cell; its workpiece and seam are used.
        s: seam parameter, shape (M,), one turn per unit.
    """
    return saddle(cell.workpiece, 2 * np.pi * np.asarray(s, dtype=float))


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
