"""Where a positioner puts the work, what a held torch asks, and joints that hold a weld upright."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nlpweld.cell import TorchAngles
from nlpweld.geometry.seam import weld_frames
from nlpweld.plan import Plan
from nlpweld.verify import reference as ref
from nlpweld.verify import upright

from .helpers import cell_with, station_with
from .welders import rot, torch_rotation


def angles(travel: float, work: float, spin: float, stand_off_m: float = 0.0) -> TorchAngles:
    return TorchAngles(travel_deg=travel, work_deg=work, spin_deg=spin, stand_off_m=stand_off_m)


@pytest.mark.parametrize(
    ("travel", "work", "spin"),
    [(90, -90, 0), (85, -90, 180), (80, -90, -90), (70, -45, 30), (110, -135, -200), (60, -30, 10), (90, -20, 5)],
)
def test_held_torch_is_that_of_the_paper(travel, work, spin):
    """Zhang et al., eq. 4: Ry(phi) Rx(eta) Rz(spin), its z axis turned over."""
    T_p_E = ref.torch_pose(angles(travel, work, spin, 0.02))
    R_p_H = torch_rotation(travel, work, spin)
    np.testing.assert_allclose(T_p_E[:3, :3], R_p_H @ np.diag([1, -1, -1]), atol=1e-7)
    np.testing.assert_allclose(T_p_E[:3, 3], 0.02 * R_p_H[:, 2], atol=1e-9)
    np.testing.assert_allclose(-T_p_E[:2, 2], np.cos(np.radians([travel, work])), atol=1e-12)


def test_torch_along_y_has_a_pose_too():
    T_p_E = ref.torch_pose(angles(90, 0, 0))
    np.testing.assert_allclose(T_p_E[:3, :3], rot("X", -np.pi / 2) @ np.diag([1, -1, -1]), atol=1e-7)


def test_table_turns_as_the_paper_counts(single, rng):
    """Zhang et al., eq. 6: Ry(theta1) Rx(pi) Rz(theta2), d2 along the table axis."""
    q, at = rng.uniform(-3, 3, size=(10, 2)), np.array([0.3, -0.2, 0.7, 0.9])
    T_W_T = ref.positioner_links(single, at, q)[:, -1]
    R = rot("Z", 0.9) @ rot("YXZ", q[:, 0], np.pi, q[:, 1])
    np.testing.assert_allclose(T_W_T[:, :3, :3], R, atol=1e-12)
    np.testing.assert_allclose(T_W_T[:, :3, 3], at[:3] + 0.25 * R[..., 2], atol=1e-12)


def test_base_stands_in_the_placement_frame(single):
    moved = cell_with(single, positioner={"base_position_m": (0.1, 0.2, 0.3), "base_rpy_deg": (0.0, 0.0, 90.0)})
    T_W_B = ref.positioner_links(moved, np.array([1.0, 2.0, 3.0, np.pi / 2]), np.zeros((1, 2)))[0, 0]
    np.testing.assert_allclose(T_W_B[:3, 3], [0.8, 2.1, 3.3], atol=1e-12)
    np.testing.assert_allclose(T_W_B[:3, :3], np.diag([-1, -1, 1]), atol=1e-12)


def test_golden_poses_of_the_dual_cell(dual, dual_plan: Plan):
    s, at, table = dual_plan.s[:1], dual_plan.placement, dual_plan.paths["positioner"][:1]
    T_W_C = ref.workpiece_pose(dual, at, s, table)[0]
    np.testing.assert_allclose(T_W_C[:3, 3], [0.3, -1.45, 0.5], atol=1e-9)
    np.testing.assert_allclose(T_W_C[:3, :3], [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-9)
    golden = (((0.797887, -1.150261, 0.652113), 1), ((-0.197887, -1.150261, 0.652113), -1))
    for station, (tcp, side) in zip(dual.stations, golden, strict=True):
        T_W_E = ref.required_pose(dual, station, at, s, table)[0]
        np.testing.assert_allclose(T_W_E[:3, 3], tcp, atol=1e-6)
        np.testing.assert_allclose(T_W_E[:3, 2], [side * 0.704416, 0.087156, -0.704416], atol=1e-6)
        np.testing.assert_allclose(T_W_E[:3, 0], [-side * 0.061628, 0.996195, 0.061628], atol=1e-6)


def test_golden_pose_of_the_single_cell(single, single_plan: Plan):
    s, at, table = single_plan.s[:1], single_plan.placement, single_plan.paths["positioner"][:1]
    T_W_E = ref.required_pose(single, single.stations[0], at, s, table)[0]
    np.testing.assert_allclose(T_W_E[:3, 3], [0.240416, -1.000521, 0.686802], atol=1e-6)
    np.testing.assert_allclose(T_W_E[:3, 2], [0, 0.173648, -0.984808], atol=1e-6)
    np.testing.assert_allclose(T_W_E[:3, 0], [-1, 0, 0], atol=1e-6)


def test_torch_with_a_heading_welds_its_own_seam(dual, dual_plan: Plan):
    cell = station_with(dual, 0, angles=None, heading_deg=90.0, seam="second")
    s, at, table = dual_plan.s, dual_plan.placement, dual_plan.paths["positioner"]
    T_W_E = ref.required_pose(cell, cell.stations[0], at, s, table)
    T_W_C, p_C = ref.workpiece_pose(cell, at, s, table), weld_frames(cell, s, "second").p_C
    p_W = np.einsum("mij,mj->mi", T_W_C[:, :3, :3], p_C) + T_W_C[:, :3, 3]
    np.testing.assert_allclose(T_W_E[:, :3, 3], p_W, atol=1e-12)
    np.testing.assert_allclose(T_W_E[:, :3, :3], np.tile([[0, 1, 0], [1, 0, 0], [0, 0, -1]], (72, 1, 1)), atol=1e-12)


def test_yaw_turns_the_flat_workpiece_and_no_heading(cell):
    s, at = np.linspace(0, 1, 5), np.array([0.1, -0.2, 0.5])
    plain, turned = (ref.workpiece_pose(cell, np.append(at, yaw), s) for yaw in (0.0, 0.7))
    np.testing.assert_array_equal(plain, ref.workpiece_pose(cell, at, s))
    np.testing.assert_allclose(turned[:, :3, :3], rot("Z", 0.7) @ plain[:, :3, :3], atol=1e-12)
    np.testing.assert_array_equal(turned[:, :3, 3], plain[:, :3, 3])
    torches = [ref.required_pose(cell, cell.stations[2], np.append(at, yaw), s) for yaw in (0.0, 0.7)]
    np.testing.assert_array_equal(torches[0][:, :3, :3], torches[1][:, :3, :3])
    assert np.abs(torches[0][:, :2, 3] - torches[1][:, :2, 3]).max() > 0.02


@pytest.mark.parametrize("fixture", ["dual", "single"])
@pytest.mark.parametrize("yaw", [0.0, 1.2])
def test_joints_near_others_hold_the_weld_upright(request, rng, fixture, yaw):
    good, cell = request.getfixturevalue(f"{fixture}_plan"), request.getfixturevalue(fixture)
    path, at = good.paths["positioner"], np.array([0.1, 0.2, 0.5, yaw])
    q, off = upright.turn_upright(cell, at, good.s, path + rng.uniform(-0.3, 0.3, size=path.shape))
    np.testing.assert_allclose(q, path, atol=1e-9)
    assert off.max() < 1e-9


def test_table_stays_where_the_weld_is_along_its_axis(single):
    """At lean 180 the normal is -z_C, whatever the table does."""
    cell = cell_with(single, seam={"lean_deg": 90.0})
    start = np.array([[-3.0, 0.3], [-3.1, 2.0]])
    q, off = upright.turn_upright(cell, np.zeros(3), np.array([0.1, 0.6]), start)
    np.testing.assert_allclose(q, [[-np.pi, 0.3], [-np.pi, 2.0]], atol=1e-6)
    assert off.max() < 1e-9


def test_distance_from_upright_is_an_angle(single, single_plan: Plan, rng):
    T_W_C = ref.workpiece_pose(single, single_plan.placement, single_plan.s, single_plan.paths["positioner"])
    for angle in (1e-9, 0.3, np.pi / 2, 3.0):
        T = T_W_C.copy()
        T[:, :3, :3] = Rotation.from_rotvec([angle * 0.6, angle * 0.8, 0]).as_matrix() @ T_W_C[:, :3, :3]
        np.testing.assert_allclose(upright.off_upright(single, T, single_plan.s), angle, atol=1e-12)


def test_main_seam_turned_about_its_tangent_is_what_is_upright(dual, dual_plan: Plan):
    T_W_C = ref.workpiece_pose(dual, dual_plan.placement, dual_plan.s, dual_plan.paths["positioner"])
    for turn, off in ((-45.0, 0.0), (0.0, 45.0), (45.0, 90.0)):
        cell = cell_with(dual, posture={"turn_deg": turn})
        np.testing.assert_allclose(upright.off_upright(cell, T_W_C, dual_plan.s), np.radians(off), atol=1e-9)
