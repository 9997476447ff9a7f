"""What a weld leaves free at every seam point: which angles, within which bands."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.levels import Freedom
from nlpweld.cell.task import Torch
from nlpweld.errors import OptionError
from nlpweld.formulation.tilting import may_tilt
from nlpweld.kinematics.chain import Frame

LEVELS = {  # of freedom, each with the one before
    "spin": "torch spin",
    "spin_yaw": "torch spin and workpiece yaw",
    "spin_yaw_tilt": "torch spin, workpiece yaw, and tilt within the tolerances of the weld position",
}
TILTS = ("slope", "rotation")


@dataclass(frozen=True)
class FreeAngle:
    """One angle that is free at every seam point.

    Attributes:
        name: ``yaw``, ``slope``, ``rotation``, or ``spin``, ``travel``, ``work`` with a dot and the robot's name.
        lower: bound of its offset from the nominal [rad].
        upper: likewise.
    """

    name: str
    lower: float
    upper: float


def free_angles(cell: Cell, level: str) -> tuple[FreeAngle, ...]:
    """Return the angles a level of freedom leaves free in a cell.

    Robots that carry the workpiece may yaw and tilt it. A positioner decides the yaw, so that there the level
    ``spin_yaw`` is the level ``spin``. It tilts the work where it has two axes and the weld keeps away from its table
    axis; slope and rotation are left out where it cannot (:func:`~.tilting.may_tilt`). Torches held by angles tilt
    besides.

    Raises:
        OptionError: no such level, or the cell states no freedom.
    """
    if level not in LEVELS:
        raise OptionError(f"freedom '{level}' is unknown. There are: {', '.join(LEVELS)}")
    if cell.freedom is None:
        raise OptionError(f"{cell.name}: has no [freedom] table, which redundant formulations need; add one")
    names = ["spin"] + (["yaw"] if level != "spin" else []) + ([*TILTS, "travel", "work"] if "tilt" in level else [])
    return tuple(angle for name in names for angle in _angles(cell, cell.freedom, name))


def _angles(cell: Cell, freedom: Freedom, name: str) -> list[FreeAngle]:
    lower, upper = np.radians(getattr(freedom, f"{name}_deg"))
    torches = [(s.name, s.coupling) for s in cell.stations if isinstance(s.coupling, Torch)]
    if name == "spin":
        return [FreeAngle(f"spin.{robot}", lower, upper) for robot, _ in torches]
    if name in ("travel", "work"):
        return [FreeAngle(f"{name}.{robot}", lower, upper) for robot, torch in torches if torch.angles is not None]
    carried = cell.positioner is None or (name in TILTS and may_tilt(cell, freedom))
    return [FreeAngle(name, lower, upper)] if carried else []


def turned_work(T_P_C: Frame, R_P_p: ca.SX | None, angles: dict[str, ca.SX]) -> Frame:
    """Return a workpiece pose in {P} with its yaw and tilt.

    The weld frame {p} that lies in position becomes ``Rz(yaw) R_P_p Ry(-slope) Rx(rotation)``, so that the two are
    just the slope and the rotation of Zhang et al., counted from the position.

    Args:
        T_P_C: nominal pose, its origin the placement's where robots carry the work.
        R_P_p: nominal weld frame that lies in position; not needed without tilt.
        angles: free angles by name [rad].
    """
    R = T_P_C.R
    if R_P_p is not None:
        tilt = turn("y", -angles["slope"]) @ turn("x", angles["rotation"])
        R = R_P_p @ tilt @ R_P_p.T @ R
    if "yaw" in angles:
        R = turn("z", angles["yaw"]) @ R
    return Frame(R, T_P_C.p)


def turn(axis: str, angle: ca.SX) -> ca.SX:
    """Return the right-hand rotation about x, y or z by an angle [rad], shape (3, 3)."""
    c, s = ca.cos(angle), ca.sin(angle)
    rows: dict[str, Sequence[Sequence[ca.SX]]] = {
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }
    return ca.sparsify(ca.vertcat(*[ca.horzcat(*row) for row in rows[axis]]))
