"""How the workpiece is held and turned at each seam point, before anything is placed (the master chain).

Where robots carry it, it turns flat about its own origin. Where a positioner holds it, the positioner's joints follow
from the main seam alone (Zhang et al., eq. 6 to 8 and 11): the master is solved first, the robots close their loops on
it afterwards. Either way the pose in the placement frame {P} does not depend on the placement.
"""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.task import Positioner
from nlpweld.geometry.posture import flat
from nlpweld.geometry.seam import weld_frames
from nlpweld.geometry.weld_angles import turn, weld_rotations
from nlpweld.kinematics.chain import rpy_pose
from nlpweld.kinematics.positioner import link_poses, up_in_base
from nlpweld.kinematics.turning import follow


@dataclass(frozen=True, eq=False)
class Held:
    """The workpiece along the seam, at M points.

    Attributes:
        T_P_C: workpiece poses in the placement frame, shape (M, 4, 4).
        q: joints of the positioner, shape (M, n) [rad], or None where there is none.
        branch: k of the positioner's inverse at each point, shape (M,), or None where there is none.
        ends_P: ends of the positioner's bodies in the placement frame, shape (M, b, 2, 3) [m].
    """

    T_P_C: np.ndarray
    q: np.ndarray | None
    branch: np.ndarray | None
    ends_P: np.ndarray


def held(cell: Cell, s: np.ndarray) -> Held:
    """Return how the workpiece is held at seam parameters s, shape (M,), in the order they are welded.

    Raises:
        KinematicsError: no branch of the positioner brings the weld upright inside its limits; names point and angle.
    """
    frames = weld_frames(cell, s)
    if cell.positioner is None:
        T_P_C = np.tile(np.eye(4), (len(s), 1, 1))
        T_P_C[:, :3, :3] = flat(frames.normal_C)
        return Held(T_P_C, None, None, np.empty((len(s), 0, 2, 3)))
    positioner = cell.positioner
    T_P_B = rpy_pose(positioner.base_position_m, positioner.base_rpy_deg)
    T_T_C = rpy_pose(positioner.mount_position_m, positioner.mount_rpy_deg)
    upright_C = posture_frames(cell, s)[:, :, 2]
    up_B, closed = up_in_base(T_P_B[:3, :3]), cell.seam.closed
    path = follow(positioner.robot, upright_C @ T_T_C[:3, :3].T, up_B, closed=closed)
    T_P_L = T_P_B @ link_poses(positioner.robot, path.q)
    return Held(T_P_L[:, -1] @ T_T_C, path.q, path.branch, _ends(positioner, T_P_L))


def posture_frames(cell: Cell, s: np.ndarray) -> np.ndarray:
    """Return the frames of the main seam whose z axis is brought upright, R_C_p' of Zhang et al., shape (M, 3, 3)."""
    return weld_rotations(weld_frames(cell, s)) @ turn("x", np.radians(cell.posture.turn_deg))


def _ends(positioner: Positioner, T_P_L: np.ndarray) -> np.ndarray:
    """Return the ends of a positioner's bodies, shape (M, b, 2, 3) [m], from its links' poses (M, n + 1, 4, 4)."""
    ends = np.empty((len(T_P_L), len(positioner.robot.bodies), 2, 3))
    for b, body in enumerate(positioner.robot.bodies):
        for e, end in enumerate((body.start, body.end)):
            T = T_P_L[:, int(end.frame[4:])]
            ends[:, b, e] = T[:, :3, :3] @ np.array(end.at_m) + T[:, :3, 3]
    return ends
