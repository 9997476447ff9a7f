"""Reference kinematics against chains built another way."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nlpweld.cell import Cell, Robot, load_robot
from nlpweld.geometry.seam import weld_frames
from nlpweld.verify import reference as ref


def turn(axis: str, angle: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return T


def shift(x: float, y: float, z: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("er16_1600")


def random_q(rng: np.random.Generator, robot: Robot, m: int) -> np.ndarray:
    q = rng.uniform(*robot.limits_rad.T, size=(m, len(robot.joints)))
    assert np.ptp(q, axis=0).min() > 0.5
    return q


def test_links_are_products_of_elementary_motions(cell: Cell, rng):
    moved = {"base_rpy_deg": (10.0, -20.0, 130.0), "base_position_m": (0.3, -0.2, 0.7)}
    station = cell.stations[0].model_copy(update=moved)
    q = random_q(rng, station.robot, 5)
    got = ref.link_poses(station, q)
    for m in range(len(q)):
        T = shift(0.3, -0.2, 0.7) @ turn("z", np.radians(130)) @ turn("y", np.radians(-20)) @ turn("x", np.radians(10))
        np.testing.assert_allclose(got[m, 0], T, atol=1e-14)
        for i, (a, d, alpha, offset) in enumerate(station.robot.dh):
            T = T @ turn("z", q[m, i] + offset) @ shift(0, 0, d) @ shift(a, 0, 0) @ turn("x", alpha)
            np.testing.assert_allclose(got[m, i + 1], T, atol=1e-13)


def test_flange_agrees_with_the_modified_dh_of_the_catalogue(robot: Robot, cell: Cell, rng):
    """Craig's form Rx(alpha) Tx(a) Rz(offset + q) Tz(d), as the catalogue prints it."""
    rows = [
        (0, 0, 0.412, 0),
        (-90, 0.160, 0, -90),
        (0, 0.680, 0, 0),
        (-90, 0.130, 0.750, 0),
        (90, 0, 0, 0),
        (-90, 0, 0.095, 0),
    ]
    station = cell.stations[2].model_copy(update={"base_position_m": (0.0, 0.0, 0.0)})
    q = random_q(rng, robot, 20)
    for m in range(len(q)):
        T = np.eye(4)
        for i, (alpha, a, d, offset) in enumerate(rows):
            T = (
                T
                @ turn("x", np.radians(alpha))
                @ shift(a, 0, 0)
                @ turn("z", np.radians(offset) + q[m, i])
                @ shift(0, 0, d)
            )
        np.testing.assert_allclose(ref.link_poses(station, q[m : m + 1])[0, -1], T, atol=1e-13)


def test_zero_flange_is_where_the_robot_file_says(robot: Robot, cell: Cell):
    station = cell.stations[2].model_copy(update={"base_position_m": (0.0, 0.0, 0.0)})
    np.testing.assert_allclose(ref.link_poses(station, np.zeros((1, 6)))[0, -1, :3, 3], robot.zero_flange_m, atol=1e-12)


def test_tcp_is_where_the_tool_puts_it(cell: Cell, rng):
    for station in cell.stations:
        T_W_L = ref.link_poses(station, random_q(rng, station.robot, 20))
        T_W_E = ref.tcp_pose(station, T_W_L)
        along = np.einsum("mi,mi->m", T_W_E[:, :3, 3] - T_W_L[:, -1, :3, 3], T_W_L[:, -1, :3, 2])
        np.testing.assert_allclose(along, station.tool.translation_m[2])
        angle = Rotation.from_matrix(T_W_L[:, -1, :3, :3].swapaxes(1, 2) @ T_W_E[:, :3, :3]).magnitude()
        np.testing.assert_allclose(np.degrees(angle), abs(station.tool.rpy_deg[1]), atol=1e-6)


def test_torch_neck_bends_after_the_translation(cell: Cell):
    np.testing.assert_allclose(
        ref.tool_pose(cell.stations[2]), shift(0, 0, 0.4) @ turn("y", np.radians(22)), atol=1e-15
    )


@pytest.mark.parametrize("index", [0, 2])
def test_jacobian_is_the_derivative_of_the_tcp(cell: Cell, rng, index):
    station = cell.stations[index]
    q, h = random_q(rng, station.robot, 8), 1e-6
    T_W_L = ref.link_poses(station, q)
    J = ref.jacobian(T_W_L, ref.tcp_pose(station, T_W_L))
    for i in range(6):
        plus, minus = (ref.tcp_pose(station, ref.link_poses(station, q + sign * h * np.eye(6)[i])) for sign in (1, -1))
        v = (plus[:, :3, 3] - minus[:, :3, 3]) / (2 * h)
        omega = (Rotation.from_matrix(plus[:, :3, :3]) * Rotation.from_matrix(minus[:, :3, :3]).inv()).as_rotvec() / (
            2 * h
        )
        np.testing.assert_allclose(J[:, :, i], np.hstack([v, omega]), atol=1e-8)


def test_manipulability_agrees_with_the_closed_form_of_this_arm(cell: Cell, rng):
    station = cell.stations[0]
    q = random_q(rng, station.robot, 50)
    T_W_L = ref.link_poses(station, q)
    _, q2, q3, _, q5, _ = q.T
    reach = 0.160 + 0.680 * np.sin(q2) + 0.130 * np.sin(q2 + q3) + 0.750 * np.cos(q2 + q3)
    expected = 0.680 * np.abs((0.750 * np.cos(q3) + 0.130 * np.sin(q3)) * reach * np.sin(q5))
    np.testing.assert_allclose(
        ref.manipulability(ref.jacobian(T_W_L, ref.tcp_pose(station, T_W_L))), expected, atol=1e-12
    )


def test_flat_rotation_is_the_smallest_that_lifts_the_normal(rng):
    n = rng.normal(size=(200, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    R = Rotation.from_matrix(ref.flat_rotation(n))
    np.testing.assert_allclose(R.apply(n), np.tile([0, 0, 1], (200, 1)), atol=1e-12)
    np.testing.assert_allclose(R.magnitude(), np.arccos(n[:, 2]), atol=1e-7)


@pytest.mark.parametrize("z", [1.0, -1.0])
def test_flat_rotation_stands_normals_along_the_vertical(z):
    R = ref.flat_rotation(np.array([[0.0, 0.0, z]]))[0]
    np.testing.assert_allclose(R @ [0, 0, z], [0, 0, 1], atol=1e-15)
    assert np.linalg.det(R) == pytest.approx(1)


def test_welds_are_flat_and_the_torch_points_down_at_them(cell: Cell):
    c, s = np.array([0.1, -0.2, 0.5]), np.linspace(0, 1, 13)
    T_W_C = ref.workpiece_pose(cell, c, s)
    weld = weld_frames(cell, s)
    normal_W = np.einsum("mij,mj->mi", T_W_C[:, :3, :3], weld.normal_C)
    np.testing.assert_allclose(normal_W, np.tile([0, 0, 1], (13, 1)), atol=1e-12)
    torch = ref.required_pose(cell, cell.stations[2], c, s)
    np.testing.assert_allclose(torch[:, :3, 3], np.einsum("mij,mj->mi", T_W_C[:, :3, :3], weld.p_C) + c, atol=1e-15)
    np.testing.assert_allclose(torch[:, :3, 2], np.tile([0, 0, -1], (13, 1)), atol=1e-15)
    np.testing.assert_allclose(torch[:, :3, 0], np.tile([0, 1, 0], (13, 1)), atol=1e-15)


@pytest.mark.parametrize(("index", "side"), [(0, 1.0), (1, -1.0)])
def test_handlers_hold_the_ends_of_the_main_pipe(cell: Cell, index, side):
    c, s = np.array([0.1, -0.2, 0.5]), np.linspace(0, 1, 7)
    T_W_C = ref.workpiece_pose(cell, c, s)
    T_C_E = np.linalg.inv(T_W_C) @ ref.required_pose(cell, cell.stations[index], c, s)
    a, e = np.radians(-30), np.radians(-60)
    np.testing.assert_allclose(T_C_E[:, :3, 3], np.tile([side * 0.25, 0, 0], (7, 1)), atol=1e-14)
    approach = [-side * np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)]
    np.testing.assert_allclose(T_C_E[:, :3, 2], np.tile(approach, (7, 1)), atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 2.0, np.pi - 1e-9, np.pi])
def test_pose_error_measures_angle_and_distance(rng, angle):
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    T, D = shift(1, 2, 3) @ turn("xyz"[0], 0.7), np.eye(4)
    D[:3, :3] = Rotation.from_rotvec(angle * axis).as_matrix() @ T[:3, :3]
    D[:3, 3] = T[:3, 3] + [3e-3, 0, 4e-3]
    position, rotation = ref.error_size(ref.pose_error(D[None], T[None]))
    assert position[0] == pytest.approx(5e-3)
    assert rotation[0] == pytest.approx(angle, abs=1e-12)
