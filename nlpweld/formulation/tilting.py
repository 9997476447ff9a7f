"""A positioner whose weld may be tilted off its position: slope and rotation at a seam point to joints (in CasADi).

The weld frame {p} that lies in position, tilted, is ``Rz(deviation) Ry(-slope) Rx(rotation)`` in a level frame, so that
``(sin slope, cos slope sin rotation, cos slope cos rotation)`` is the direction of {p} that is upright. It takes the
place of z in the inverse of Zhang et al., eq. (8), on the branch of the untilted path; the deviation follows.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.levels import Freedom
from nlpweld.cell.robot import Robot
from nlpweld.cell.task import Positioner
from nlpweld.formulation.holder import held, posture_frames
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.chain import Chain, Frame, constant, rpy_pose
from nlpweld.kinematics.positioner import two_axes, up_in_base

ROOM_DEG = 1.0  # between a tilted weld and where both branches meet, beside which the table turns ever faster
RIGHT = (
    np.pi / 2
)  # how far a joint is let off the untilted path; with axis 1 level and square to axis 2 none goes there


@dataclass(frozen=True)
class TiltedTable:
    """Expressions of one seam point.

    Attributes:
        symbols: what it takes from the point's data, in the order of :func:`table_data`.
        cos: cosines of the positioner's DH angles, shape (2, 1).
        sin: sines, shape (2, 1).
        kept: sines that are at least 0 where the joints keep their limits, upper ones first, shape (4, 1).
        links: the positioner's links in {P}, the base first.
        T_P_C: the workpiece in {P}.
    """

    symbols: list[ca.SX]
    cos: ca.SX
    sin: ca.SX
    kept: ca.SX
    links: list[Frame]
    T_P_C: Frame


def may_tilt(cell: Cell, freedom: Freedom) -> bool:
    """Tell whether a cell's positioner can tilt the weld anywhere within the bands of slope and rotation.

    One axis cannot: it reaches but one rotation for every slope. Two axes can where the weld stays away from the table
    axis, which turns it nowhere, and from what is out of reach of a base whose first axis is not level; at either the
    two branches meet.
    """
    if cell.positioner is None or len(cell.positioner.robot.joints) != 2:
        return False
    R_T_p = _posture_in_table(cell, cell.positioner, seam_parameters(cell))
    room = two_axes(cell.positioner.robot).room(R_T_p[:, :, 2], _up(cell.positioner))
    farthest = np.minimum(np.abs(np.radians([freedom.slope_deg, freedom.rotation_deg])).max(axis=1), RIGHT)
    return bool(room.min() >= np.arccos(np.cos(farthest).prod()) + np.radians(ROOM_DEG))


def upright(slope: ca.SX, rotation: ca.SX) -> ca.SX:
    """Return the direction of {p} that is upright while it is tilted off its position, shape (3, 1)."""
    return ca.vertcat(ca.sin(slope), ca.cos(slope) * ca.sin(rotation), ca.cos(slope) * ca.cos(rotation))


def tilted_table(positioner: Positioner, slope: ca.SX, rotation: ca.SX) -> TiltedTable:
    """Return fresh symbols for a seam point, and the positioner there as slope and rotation [rad] ask."""
    R_T_p, branch, highest, lowest = (ca.SX.sym(name, *shape) for name, *shape in _SYMBOLS)
    axes, up_B = two_axes(positioner.robot), ca.SX(ca.DM(_up(positioner)))
    cos, sin, _ = axes.solve(R_T_p @ upright(slope, rotation), up_B, branch)
    kept = ca.vertcat(
        ca.sin(highest) * cos - ca.cos(highest) * sin,
        ca.cos(lowest) * sin - ca.sin(lowest) * cos,
    )
    base = constant(rpy_pose(positioner.base_position_m, positioner.base_rpy_deg))
    links = Chain(positioner.robot).links(cos, sin, base)
    T_P_C = links[-1] @ constant(rpy_pose(positioner.mount_position_m, positioner.mount_rpy_deg))
    return TiltedTable([R_T_p, branch, highest, lowest], cos, sin, kept, links, T_P_C)


_SYMBOLS = (("R_T_p", 3, 3), ("branch", 1, 1), ("highest", 2, 1), ("lowest", 2, 1))


def table_data(cell: Cell, positioner: Positioner, s: np.ndarray) -> list[np.ndarray]:
    """Return the numbers behind :attr:`TiltedTable.symbols` at seam parameters (N,), each of shape (N, k).

    The highest and lowest DH angles are those of :func:`table_limits`.
    """
    work = held(cell, s)
    assert work.q is not None
    assert work.branch is not None
    lowest, highest = table_limits(cell, positioner, work.q) + positioner.robot.dh[:, 3]
    columns = _posture_in_table(cell, positioner, s).transpose(0, 2, 1).reshape(-1, 9)
    return [columns, 1.0 - 2.0 * work.branch[:, None], highest, lowest]


def table_limits(cell: Cell, positioner: Positioner, q: np.ndarray) -> np.ndarray:
    """Return lowest and highest joints at every seam point of an untilted path q (N, n), shape (2, N, n) [rad].

    These are the limits less the solvers' margin, but no farther than a right angle from the untilted path: sines tell
    the side of what is that near, however often a joint may turn.
    """
    need = np.radians(cell.constraints.joint_margin_deg)
    lower, upper = (np.broadcast_to(limit, q.shape) for limit in positioner.robot.limits_rad.T)
    again = np.zeros_like(q)
    if cell.seam.closed:
        again[0] = way_back(q) - q[0]  # the first point is passed twice, whole turns apart
    highest = np.minimum(upper - np.maximum(again, 0.0) - need, q + RIGHT)
    lowest = np.maximum(lower - np.minimum(again, 0.0) + need, q - RIGHT)
    return np.stack([lowest, highest])


def way_back(q: np.ndarray) -> np.ndarray:
    """Return the first row of a path (N, n) moved by the whole turns that bring it nearest the last, (n,) [rad]."""
    return q[0] + 2 * np.pi * np.round((q[-1] - q[0]) / (2 * np.pi))


def tilted_path(robot: Robot, cos_sin: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return joints (N, 2) [rad] at tilted seam points, next to those of the untilted path.

    Args:
        robot: the positioner.
        cos_sin: cosine beside sine of its DH angles, point by point, shape (2, 2 N).
        q: the untilted path, shape (N, 2) [rad].
    """
    off = np.arctan2(cos_sin[:, 1::2], cos_sin[:, ::2]).T - robot.dh[:, 3] - q
    return q + off - 2 * np.pi * np.round(off / (2 * np.pi))


def _posture_in_table(cell: Cell, positioner: Positioner, s: np.ndarray) -> np.ndarray:
    """Return the frames that lie in position, in the table's frame, R_T_p of shape (N, 3, 3)."""
    T_T_C = rpy_pose(positioner.mount_position_m, positioner.mount_rpy_deg)
    return T_T_C[:3, :3] @ posture_frames(cell, s)


def _up(positioner: Positioner) -> np.ndarray:
    """Return the upright direction in the positioner's base frame, shape (3,)."""
    return up_in_base(rpy_pose(positioner.base_position_m, positioner.base_rpy_deg)[:3, :3])
