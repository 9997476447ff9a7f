"""How each chain hangs on the workpiece frame: tight and loose coordination, master and slaves.

Pan et al., eq. 1 to 8; Zhang et al., eq. 5 to 15.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.station import Station
from nlpweld.cell.task import Grasp, Torch, TorchAngles
from nlpweld.formulation.holder import held
from nlpweld.geometry.seam import weld_frames
from nlpweld.geometry.torch_angles import torch_pose
from nlpweld.geometry.weld_angles import weld_rotations
from nlpweld.kinematics.chain import Frame, constant, rpy_pose

FACING = np.diag([1.0, -1.0, -1.0, 1.0])  # T_H_E: the torch's TCP looks at the weld, {H} away from it


@dataclass(frozen=True)
class WeldPoint:
    """Symbols of one seam point.

    Attributes:
        T_P_C: workpiece in the placement frame {P} while the point is welded.
        targets: for each station where its TCP is to be in C; the origin alone counts for a torch with a heading,
            and nothing for a handler.
        ends_P: ends of the positioner's moving bodies in {P}, side by side, shape (3, 2b) [m].
        vector: all of them, shape (k, 1).
    """

    T_P_C: Frame
    targets: tuple[Frame | None, ...]
    ends_P: ca.SX
    vector: ca.SX


def weld_point(cell: Cell) -> WeldPoint:
    """Return fresh symbols for a seam point, in the order of :func:`point_data`."""
    blocks = [ca.SX.sym("R_P_C", 3, 3)]
    if cell.positioner:
        blocks.append(ca.SX.sym("p_P_C", 3))
    T_P_C = Frame(blocks[0], blocks[1] if cell.positioner else ca.SX(3, 1))
    targets: list[Frame | None] = []
    for station in cell.stations:
        target, symbols = _target(station)
        targets.append(target)
        blocks += symbols
    ends_P = ca.SX.sym("ends_P", 3, 2 * len(moving_bodies(cell)))
    return WeldPoint(T_P_C, tuple(targets), ends_P, ca.vertcat(*[ca.vec(block) for block in [*blocks, ends_P]]))


def _target(station: Station) -> tuple[Frame | None, list[ca.SX]]:
    if isinstance(station.coupling, Grasp):
        return None, []
    p = ca.SX.sym(f"p_C_{station.name}", 3)
    if station.coupling.angles is None:
        return Frame(ca.SX(3, 3), p), [p]
    R = ca.SX.sym(f"R_C_E_{station.name}", 3, 3)
    return Frame(R, p), [R, p]


def point_data(cell: Cell, s: np.ndarray) -> np.ndarray:
    """Return the numbers behind :class:`WeldPoint` at seam parameters s (N,), shape (k, N)."""
    work = held(cell, s)
    rows = [_columns(work.T_P_C[:, :3, :3])]
    if cell.positioner:
        rows.append(work.T_P_C[:, :3, 3])
    for station in cell.stations:
        if isinstance(station.coupling, Torch):
            rows += _target_data(cell, station.coupling, s)
    rows.append(work.ends_P[:, moving_bodies(cell)].reshape(len(s), -1))
    return np.concatenate(rows, axis=1).T


def _target_data(cell: Cell, torch: Torch, s: np.ndarray) -> list[np.ndarray]:
    if torch.angles is None:
        return [weld_frames(cell, s, torch.seam).p_C]
    T_C_E = torch_target(cell, torch.seam, torch.angles, s)
    return [_columns(T_C_E[:, :3, :3]), T_C_E[:, :3, 3]]


def torch_target(cell: Cell, seam: str, angles: TorchAngles, s: np.ndarray) -> np.ndarray:
    """Return T_C_E, where a torch held against a seam's weld frames has its TCP, shape (N, 4, 4)."""
    frames = weld_frames(cell, s, seam)
    T_C_p = np.tile(np.eye(4), (len(s), 1, 1))
    T_C_p[:, :3, :3], T_C_p[:, :3, 3] = weld_rotations(frames), frames.p_C
    travel, work, spin = np.radians([angles.travel_deg, angles.work_deg, angles.spin_deg])
    return T_C_p @ torch_pose(travel, work, spin, angles.stand_off_m) @ FACING


def _columns(R: np.ndarray) -> np.ndarray:
    """Return rotations (N, 3, 3) as CasADi orders them, column by column, shape (N, 9)."""
    return R.transpose(0, 2, 1).reshape(len(R), 9)


def moving_bodies(cell: Cell) -> list[int]:
    """Return which of the positioner's bodies move with its joints."""
    bodies = cell.positioner.robot.bodies if cell.positioner else ()
    return [i for i, body in enumerate(bodies) if {body.start.frame, body.end.frame} != {"link0"}]


def placement_frame(cell: Cell, x: ca.SX) -> Frame:
    """Return T_W_P of free coordinates x (d, 1); those that are held are numbers."""
    whole = ca.SX(ca.DM(cell.search.bounds[0]))
    free = [i for i, name in enumerate(("x_m", "y_m", "z_m", "yaw_rad")) if name in cell.variables]
    whole[free] = x
    if 3 not in free and cell.search.bounds[0, 3] == 0.0:
        return Frame(constant(np.eye(4)).R, whole[:3])
    c, s = ca.cos(whole[3]), ca.sin(whole[3])
    rows = [ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1)]
    return Frame(ca.sparsify(ca.vertcat(*rows)), whole[:3])


def tcp_pose(coupling: Grasp | Torch, T_W_C: Frame, target: Frame | None) -> Frame:
    """Return T_W_E, where a coupling wants the tool while the workpiece is at T_W_C and the target in C is welded."""
    if isinstance(coupling, Grasp):
        return T_W_C @ constant(coupling.T_C_E)
    assert target is not None
    if coupling.heading_deg is not None:
        return Frame(torch_rotation(coupling.heading_deg), T_W_C.point(target.p))
    return T_W_C @ target


def torch_rotation(heading_deg: float) -> ca.SX:
    """Return R_W_E of a torch that points straight down, its x axis along a heading from +x_W."""
    heading = np.radians(heading_deg)
    x = np.array([np.cos(heading), np.sin(heading), 0.0])
    z = np.array([0.0, 0.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return constant(pose).R


def flange_pose(station: Station, T_W_C: Frame, target: Frame | None) -> Frame:
    """Return T_B_F, the flange pose in the station's base frame that its coupling asks for.

    The loop is closed here (Pan et al., eq. 7, 8; Zhang et al., eq. 15).
    """
    T_W_E = tcp_pose(station.coupling, T_W_C, target)
    T_F_E = constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
    return base_pose(station).inverse() @ T_W_E @ T_F_E.inverse()


def base_pose(station: Station) -> Frame:
    """Return T_W_B of a station."""
    return constant(rpy_pose(station.base_position_m, station.base_rpy_deg))
