"""Tight and loose coordination in the base frames (Pan et al., eq. 1-8)."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.formulation.coupling import base_pose, flange_pose, point_data, torch_rotation
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.kinematics.chain import Frame, rpy_pose

from .helpers import PAPER, base, workpiece_poses

HANDLERS = pytest.mark.parametrize(("k", "s"), [(0, 1), (1, -1)], ids=["handler_1", "handler_2"])


def tcp_poses(cell: Cell, k: int, x: np.ndarray) -> np.ndarray:
    """Return T_B_E of station k at the seam points, from the flange pose the coupling asks for, shape (N, 4, 4)."""
    station, p_C = cell.stations[k], weld_frames(cell, seam_parameters(cell)).p_C
    poses = []
    for T_W_C, p in zip(workpiece_poses(cell, x), p_C, strict=True):
        flange = flange_pose(station, Frame(ca.SX(T_W_C[:3, :3]), ca.SX(T_W_C[:3, 3])), Frame(ca.SX(3, 3), ca.SX(p)))
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = np.array(ca.DM(flange.R)), np.array(ca.DM(flange.p)).ravel()
        poses.append(T @ rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
    return np.array(poses)


def workpiece_in_base(cell: Cell, k: int, x: np.ndarray) -> np.ndarray:
    """Return T_B_C = (T_W_B)^-1 T_W_C at the seam points (eq. 7), shape (N, 4, 4)."""
    return np.linalg.inv(base(cell, k)) @ workpiece_poses(cell, x)


def test_torch_tip_in_its_base_frame_is_the_weld_point_there(cell: Cell) -> None:
    p_C = weld_frames(cell, seam_parameters(cell)).p_C
    T_B_C = workpiece_in_base(cell, 2, PAPER)
    expected = np.einsum("nij,nj->ni", T_B_C[:, :3, :3], p_C) + T_B_C[:, :3, 3]  # eq. 8
    assert tcp_poses(cell, 2, PAPER)[:, :3, 3] == pytest.approx(expected, abs=1e-14)


@HANDLERS
def test_handler_is_rigid_to_the_workpiece(cell: Cell, k: int, s: int) -> None:
    T_C_E = np.linalg.inv(workpiece_in_base(cell, k, PAPER)) @ tcp_poses(cell, k, PAPER)
    assert pytest.approx(np.tile(T_C_E[0], (72, 1, 1)), abs=1e-13) == T_C_E


@HANDLERS
def test_handler_grasps_the_end_of_the_main_pipe_as_the_model_says(cell: Cell, k: int, s: int) -> None:
    a, e = np.radians(-30.0), np.radians(-60.0)
    g = np.array([-s * np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    x = np.array([0.0, 0.0, 1.0]) - g * g[2]
    T_C_E = (np.linalg.inv(workpiece_in_base(cell, k, PAPER)) @ tcp_poses(cell, k, PAPER))[0]
    assert T_C_E[:3, 3] == pytest.approx([s * 0.25, 0.0, 0.0], abs=1e-13)
    assert T_C_E[:3, 2] == pytest.approx(g, abs=1e-13)
    assert T_C_E[:3, 0] == pytest.approx(x / np.linalg.norm(x), abs=1e-13)
    assert np.linalg.det(T_C_E) == pytest.approx(1.0, abs=1e-13)


def test_torch_points_straight_down_with_its_x_axis_along_plus_y(cell: Cell) -> None:
    R_W_E = base(cell, 2)[:3, :3] @ tcp_poses(cell, 2, PAPER)[:, :3, :3]
    expected = np.column_stack([(0, 1, 0), (1, 0, 0), (0, 0, -1)])
    assert pytest.approx(np.tile(expected, (72, 1, 1)), abs=1e-14) == R_W_E


@pytest.mark.parametrize("heading", [0.0, 30.0, -120.0])
def test_torch_heading_turns_its_x_axis_about_the_vertical(heading: float) -> None:
    R = np.array(ca.DM(torch_rotation(heading)))
    assert R[:, 0] == pytest.approx([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0.0], abs=1e-15)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_base_pose_of_a_station_turned_and_shifted_is_its_rpy_pose(cell: Cell) -> None:
    station = cell.stations[0].model_copy(update={"base_rpy_deg": (10.0, 20.0, 30.0)})
    T = rpy_pose(station.base_position_m, (10.0, 20.0, 30.0))
    assert np.array(ca.DM(base_pose(station).R)) == pytest.approx(T[:3, :3], abs=1e-15)
    assert np.array(ca.DM(base_pose(station).p)).ravel() == pytest.approx(T[:3, 3], abs=1e-15)


def test_workpiece_does_not_move_when_a_base_does(cell: Cell) -> None:
    turned = cell.stations[0].model_copy(update={"base_rpy_deg": (0.0, 0.0, 90.0), "base_position_m": (0.9, -0.9, 0.0)})
    other = cell.model_copy(update={"stations": (turned, *cell.stations[1:])})
    here, there = (base(c, 0) @ tcp_poses(c, 0, PAPER) for c in (cell, other))
    assert here == pytest.approx(there, abs=1e-13)


def test_point_data_is_the_rotation_column_by_column_and_the_weld_point(cell: Cell) -> None:
    s = seam_parameters(cell)
    data = point_data(cell, s)
    assert pytest.approx(workpiece_poses(cell, PAPER)[:, :3, :3].transpose(0, 2, 1).reshape(72, 9)) == data[:9].T
    assert pytest.approx(weld_frames(cell, s).p_C) == data[9:].T
