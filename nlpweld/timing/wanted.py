"""Where the workpiece and every tool are to be along the seam, of a plan whose weld frames are blended (NumPy)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from nlpweld.cell import Cell, Station
from nlpweld.cell.task import Grasp, Positioner, Torch
from nlpweld.formulation.coupling import FACING, torch_rotation
from nlpweld.geometry.posture import flat
from nlpweld.geometry.torch_angles import torch_pose
from nlpweld.geometry.weld_angles import turn
from nlpweld.kinematics.chain import rpy_pose
from nlpweld.kinematics.positioner import link_poses, one_axis, two_axes, up_in_base
from nlpweld.plan import Plan
from nlpweld.timing.frames import SeamFrames, seam_frames

FINE = 2000  # samples of a turn that is continued over whole turns


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a plan asks for anywhere on the seam.

    Free angles go through those of the plan's points on cubic splines, periodic along a closed seam, where the plan
    itself goes linearly from point to point.

    Attributes:
        plan: the plan.
        seams: the frames of every seam, by name.
    """

    plan: Plan
    seams: dict[str, SeamFrames]

    @cached_property
    def T_W_P(self) -> np.ndarray:
        """Pose of the placement frame, shape (4, 4)."""
        x, y, z = (float(v) for v in self.plan.placement_m)
        return rpy_pose((x, y, z), (0.0, 0.0, float(np.degrees(self.plan.yaw_rad))))

    @cached_property
    def _splines(self) -> dict[str, CubicSpline]:
        s, closed = self.plan.s, self.plan.cell.seam.closed
        found = {}
        for name, u in (self.plan.freedom or {}).items():
            if closed:
                spline = CubicSpline(np.append(s, s[0] + 1), np.append(u, u[0]), bc_type="periodic")
            else:
                spline = CubicSpline(s, u)
            found[name] = spline
        return found

    def free(self, name: str, s: np.ndarray) -> np.ndarray:
        """Return the offset of a free angle, shape (M,) [rad]; 0 where the plan leaves it nominal."""
        return self._splines[name](s) if name in self._splines else np.zeros(len(s))

    def work(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return T_W_C, shape (M, 4, 4), and the positioner's joints (M, n) [rad], n = 0 where there is none."""
        cell = self.plan.cell
        R_C_p = self.seams["main"].rotations(s) @ turn("x", np.radians(cell.posture.turn_deg))
        slope, rotation = self.free("slope", s), self.free("rotation", s)
        if cell.positioner is None:
            return self._carried(s, R_C_p, turn("y", -slope) @ turn("x", rotation)), np.empty((len(s), 0))
        upright = [np.sin(slope), np.cos(slope) * np.sin(rotation), np.cos(slope) * np.cos(rotation)]
        direction_C = np.einsum("mij,jm->mi", R_C_p, np.array(upright))
        table = self._table(cell.positioner, s, direction_C)
        return self.turned(table), table

    def turned(self, table: np.ndarray) -> np.ndarray:
        """Return T_W_C for joints of the positioner (M, n) [rad], shape (M, 4, 4)."""
        held = self.plan.cell.positioner
        assert held is not None
        T_P_B = rpy_pose(held.base_position_m, held.base_rpy_deg)
        T_T_C = rpy_pose(held.mount_position_m, held.mount_rpy_deg)
        return self.T_W_P @ T_P_B @ link_poses(held.robot, table)[:, -1] @ T_T_C

    def _carried(self, s: np.ndarray, R_C_p: np.ndarray, tilt: np.ndarray) -> np.ndarray:
        """Return T_W_C of a workpiece that robots hold flat, with its yaw and tilt."""
        T = np.tile(np.eye(4), (len(s), 1, 1))
        R_P_C = flat(self.seams["main"].rotations(s)[:, :, 2])
        R_P_p = R_P_C @ R_C_p
        T[:, :3, :3] = turn("z", self.free("yaw", s)) @ R_P_p @ tilt @ R_P_p.swapaxes(-1, -2) @ R_P_C
        return self.T_W_P @ T

    def _table(self, held: Positioner, s: np.ndarray, direction_C: np.ndarray) -> np.ndarray:
        """Return the positioner's joints that bring directions upright, next to those of the plan."""
        R_T_C = rpy_pose(held.mount_position_m, held.mount_rpy_deg)[:3, :3]
        up_B = up_in_base(rpy_pose(held.base_position_m, held.base_rpy_deg)[:3, :3])
        e_T, near = direction_C @ R_T_C.T, self._between(held.name, s)
        if len(held.robot.joints) == 1:
            q, free = one_axis(held.robot).joints(e_T, up_B)
            return _beside(np.where(free[:, None], near, q), near)
        axes = two_axes(held.robot)
        both = np.stack([_beside(axes.joints(e_T, up_B, k), near) for k in (0, 1)])
        better = np.abs(both - near).max(axis=-1).argmin(axis=0)
        found = both[better, np.arange(len(s))]
        found[:, 1] = np.where(axes.table(e_T, up_B, 0)[1], near[:, 1], found[:, 1])
        return found

    def _between(self, name: str, s: np.ndarray) -> np.ndarray:
        """Return the plan's joints, linear between its points, shape (M, n) [rad]."""
        own, path = self.plan.s, self.plan.paths[name]
        if self.plan.cell.seam.closed:
            back = path[0] + 2 * np.pi * np.round((path[-1] - path[0]) / (2 * np.pi))
            own, path = np.append(own, own[0] + 1), np.vstack([path, back])
        return np.stack([np.interp(s, own, joint) for joint in path.T], axis=-1)

    def tool(self, station: Station, s: np.ndarray, T_W_C: np.ndarray) -> np.ndarray:
        """Return T_W_E of one robot, shape (M, 4, 4), while the workpiece is at T_W_C (M, 4, 4)."""
        coupling = station.coupling
        if isinstance(coupling, Grasp):
            return T_W_C @ coupling.T_C_E
        seam = self.seams[coupling.seam]
        spin = turn("z", self.free(f"spin.{station.name}", s))
        T = np.tile(np.eye(4), (len(s), 1, 1))
        if coupling.angles is None:
            assert coupling.heading_deg is not None
            T[:, :3, 3] = (T_W_C[:, :3, :3] @ seam.points(s)[..., None])[..., 0] + T_W_C[:, :3, 3]
            T[:, :3, :3] = np.array(_numbers(torch_rotation(coupling.heading_deg))) @ spin
            return T
        T[:, :3, :3], T[:, :3, 3] = seam.rotations(s), seam.points(s)
        T = T_W_C @ T @ self._held(station, coupling, s) @ FACING
        T[:, :3, :3] = T[:, :3, :3] @ spin
        return T

    def _held(self, station: Station, torch: Torch, s: np.ndarray) -> np.ndarray:
        """Return T_p_H of a torch that is held against the weld, shape (M, 4, 4)."""
        at = torch.angles
        assert at is not None
        travel = np.radians(at.travel_deg) + self.free(f"travel.{station.name}", s)
        work = np.radians(at.work_deg) + self.free(f"work.{station.name}", s)
        return torch_pose(travel, work, np.radians(at.spin_deg), at.stand_off_m)


def wanted(plan: Plan, blend_m: float) -> Wanted:
    """Return what a plan asks for anywhere on the seam, its kinks spread over ``blend_m`` [m] to either side."""
    return Wanted(plan, {name: seam_frames(plan.cell, name, blend_m) for name in _used(plan.cell)})


def _used(cell: Cell) -> list[str]:
    """Return the names of the seams that something follows; the main one sets the posture."""
    welded = [station.coupling.seam for station in cell.stations if isinstance(station.coupling, Torch)]
    return list(dict.fromkeys(["main", *welded]))


def _beside(q: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return angles moved by the whole turns that bring each nearest another."""
    return q + 2 * np.pi * np.round((near - q) / (2 * np.pi))


def _numbers(matrix: object) -> np.ndarray:
    import casadi as ca

    return np.array(ca.DM(matrix))
