"""How each chain hangs on the workpiece frame: tight and loose coordination (Pan et al., eq. 1-8)."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell, Station
from nlpweld.cell.task import Grasp, Torch
from nlpweld.geometry.posture import flat
from nlpweld.geometry.seam import weld_frames
from nlpweld.kinematics.chain import Frame, constant, rpy_pose


@dataclass(frozen=True)
class WeldPoint:
    """Symbols of one seam point: orientation of the workpiece while it is welded, and the point in C."""

    R_W_C: ca.SX
    p_C: ca.SX

    @property
    def vector(self) -> ca.SX:
        """All twelve symbols, shape (12, 1), the rotation column by column."""
        return ca.vertcat(ca.vec(self.R_W_C), self.p_C)


def weld_point() -> WeldPoint:
    """Return fresh symbols for a seam point."""
    return WeldPoint(ca.SX.sym("R_W_C", 3, 3), ca.SX.sym("p_C", 3))


def point_data(cell: Cell, s: np.ndarray) -> np.ndarray:
    """Return the numbers behind :class:`WeldPoint` at seam parameters s (N,), shape (12, N)."""
    frames = weld_frames(cell, s)
    R_W_C = flat(frames.normal_C)
    return np.concatenate([R_W_C.transpose(2, 1, 0).reshape(9, -1), frames.p_C.T])


def tcp_pose(coupling: Grasp | Torch, T_W_C: Frame, p_C: ca.SX) -> Frame:
    """Return T_W_E, where the coupling wants the tool while the workpiece is at T_W_C and p_C is welded."""
    if isinstance(coupling, Grasp):
        return T_W_C @ constant(coupling.T_C_E)
    return Frame(torch_rotation(coupling), T_W_C.point(p_C))


def torch_rotation(torch: Torch) -> ca.SX:
    """Return R_W_E of a torch that points straight down, its x axis along the heading."""
    heading = np.radians(torch.heading_deg)
    x = np.array([np.cos(heading), np.sin(heading), 0.0])
    z = np.array([0.0, 0.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return constant(pose).R


def flange_pose(station: Station, T_W_C: Frame, p_C: ca.SX) -> Frame:
    """Return T_B_F, the flange pose in the station's base frame that its coupling asks for (Pan et al., eq. 7, 8)."""
    T_W_E = tcp_pose(station.coupling, T_W_C, p_C)
    T_F_E = constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
    return base_pose(station).inverse() @ T_W_E @ T_F_E.inverse()


def base_pose(station: Station) -> Frame:
    """Return T_W_B of a station."""
    return constant(rpy_pose(station.base_position_m, station.base_rpy_deg))
