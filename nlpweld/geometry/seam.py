"""A cell's seams in the workpiece frame C, whatever their curve: points, tangents and weld normals (NumPy only)."""

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.task import Saddle, Tee
from nlpweld.geometry.composite import composite_frames, equal_steps, seam_breaks
from nlpweld.geometry.saddle import saddle
from nlpweld.geometry.weld_frames import WeldFrames


def seam_parameters(cell: Cell) -> np.ndarray:
    """Return the seam parameter of the cell's points, shape (N,): in [0, 1), or in [0, 1] for an open seam."""
    if isinstance(cell.seam, Saddle):
        return np.arange(cell.seam.points) / cell.seam.points
    return equal_steps(cell.seam)


def breaks(cell: Cell) -> np.ndarray:
    """Return the seam parameters where pieces of the main seam join and its curvature jumps, ascending."""
    return np.empty(0) if isinstance(cell.seam, Saddle) else seam_breaks(cell.seam)


def weld_frames(cell: Cell, s: np.ndarray, seam: str = "main") -> WeldFrames:
    """Return the weld frames of one of the cell's seams.

    Args:
        cell: the cell; its workpiece and seams are used.
        s: seam parameter, shape (M,): the fraction of the turn about the branch for a saddle, else of the arc length;
            one turn per unit where the seam is closed.
        seam: name of the seam.

    Raises:
        CellError: a parameter of an open seam is outside [0, 1].
    """
    curve = cell.seams[seam]
    if isinstance(curve, Saddle):
        assert isinstance(cell.workpiece, Tee)  # the cell sees to that
        return saddle(cell.workpiece, 2 * np.pi * np.asarray(s, dtype=float))
    return composite_frames(curve, s)
