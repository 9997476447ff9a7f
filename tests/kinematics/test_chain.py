"""Forward kinematics and Jacobian against chains multiplied out elsewhere and finite differences."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.cell import Robot, load_robot
from nlpweld.kinematics.chain import Chain, Frame, constant, rpy_pose

from .helpers import NAMES, ROBOTS, between_limits, error_of, flange, link_frames, shift, turn

MODIFIED_DH_OF_ER16 = [  # alpha before [deg], a before [mm], d [mm], offset [deg]: seed-facts.md, catalogue entry
    (0, 0, 412, 0), (-90, 160, 0, -90), (0, 680, 0, 0), (-90, 130, 750, 0), (90, 0, 0, 0), (-90, 0, 95, 0),
]  # fmt: skip
TCP = np.array([0.03, -0.2, 0.45])
STEP = 1e-6
lengths = st.floats(-2, 2)
degrees = st.floats(-360, 360)


@pytest.mark.parametrize("robot", ROBOTS, ids=NAMES)
def test_flange_pose_is_the_product_of_the_rows_elementary_moves(robot: Robot) -> None:
    q = between_limits(robot, 500, seed=1)
    assert error_of(flange(robot, q), link_frames(robot, q)[-1]).max() < 1e-13


def test_er16_flange_pose_is_its_modified_dh_chain() -> None:
    q = between_limits(load_robot("er16_1600"), 500, seed=2)
    T = np.tile(np.eye(4), (500, 1, 1))
    for angle, (alpha, a, d, offset) in zip(q.T, MODIFIED_DH_OF_ER16, strict=True):
        before = turn("x", np.full(500, np.radians(alpha))) @ shift("x", a / 1000, 500)
        T = T @ before @ turn("z", angle + np.radians(offset)) @ shift("z", d / 1000, 500)
    assert error_of(flange(load_robot("er16_1600"), q), T).max() < 1e-13


def differences(robot: Robot, q: np.ndarray, joint: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the TCP's velocity and the angular velocity per unit joint speed, each (m, 3), by central differences."""
    ahead, behind = q.copy(), q.copy()
    ahead[:, joint] += STEP
    behind[:, joint] -= STEP
    T, T_ahead, T_behind = (link_frames(robot, x)[-1] for x in (q, ahead, behind))
    rate = (T_ahead - T_behind) / (2 * STEP)
    spin = rate[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1)
    return rate[:, :3, :3] @ TCP + rate[:, :3, 3], np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)


def jacobians(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return ``Chain.jacobian`` at the TCP, shape (m, 6, n)."""
    J = np.array(Chain(robot).jacobian.map(len(q))(q.T, np.tile(TCP[:, None], len(q))))
    return J.reshape(6, len(q), -1).transpose(1, 0, 2)


@pytest.mark.parametrize("robot", ROBOTS, ids=NAMES)
def test_upper_half_of_the_jacobian_is_the_derivative_of_the_tcps_position(robot: Robot) -> None:
    q = between_limits(robot, 50, seed=3)
    expected = np.stack([differences(robot, q, k)[0] for k in range(6)], axis=-1)
    assert np.abs(jacobians(robot, q)[:, :3] - expected).max() < 1e-8


@pytest.mark.parametrize("robot", ROBOTS, ids=NAMES)
def test_lower_half_of_the_jacobian_is_the_angular_velocity(robot: Robot) -> None:
    q = between_limits(robot, 50, seed=4)
    expected = np.stack([differences(robot, q, k)[1] for k in range(6)], axis=-1)
    assert np.abs(jacobians(robot, q)[:, 3:] - expected).max() < 1e-8


def numbers(frame: Frame) -> np.ndarray:
    """Return a numeric frame as a pose (4, 4)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.array(ca.DM(frame.R)), np.array(ca.DM(frame.p)).ravel()
    return T


@given(st.tuples(lengths, lengths, lengths), st.tuples(degrees, degrees, degrees))
def test_rpy_pose_turns_about_x_then_y_then_z_and_shifts_last(
    translation: tuple[float, float, float], rpy: tuple[float, float, float]
) -> None:
    roll, pitch, yaw = (np.radians([angle]) for angle in rpy)
    T = (turn("z", yaw) @ turn("y", pitch) @ turn("x", roll))[0]
    T[:3, 3] = translation
    assert rpy_pose(translation, rpy) == pytest.approx(T, abs=1e-14)


@given(st.tuples(lengths, lengths, lengths), st.tuples(degrees, degrees, degrees))
def test_frame_after_its_inverse_is_identity(
    translation: tuple[float, float, float], rpy: tuple[float, float, float]
) -> None:
    frame = constant(rpy_pose(translation, rpy))
    assert numbers(frame.inverse() @ frame) == pytest.approx(np.eye(4), abs=1e-13)


@given(st.tuples(lengths, lengths, lengths), st.tuples(degrees, degrees, degrees), st.tuples(lengths, lengths, lengths))
def test_frame_maps_a_point_as_its_matrix_does(
    translation: tuple[float, float, float], rpy: tuple[float, float, float], p: tuple[float, float, float]
) -> None:
    T = rpy_pose(translation, rpy)
    assert np.array(ca.DM(constant(T).point(p))).ravel() == pytest.approx((T @ [*p, 1])[:3], abs=1e-13)


def test_base_pose_moves_every_link_frame() -> None:
    robot, T_W_B = ROBOTS[0], rpy_pose((1.0, -1.0, 0.05), (10.0, 20.0, 30.0))
    q = between_limits(robot, 1, seed=5)
    links = Chain(robot).links(*Chain(robot).cos_sin(ca.DM(q[0])), constant(T_W_B))
    expected = T_W_B @ link_frames(robot, q)[:, 0]
    assert np.array([numbers(link) for link in links]) == pytest.approx(expected, abs=1e-14)


def test_constant_frame_of_a_right_angle_keeps_only_the_entries_that_are_not_zero() -> None:
    frame = constant(rpy_pose((0.0, 0.0, 0.1), (0.0, 90.0, 0.0)))
    assert frame.R.nnz() == 3
