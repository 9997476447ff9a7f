"""The closed-form inverse where it has no answer, more than one, or no right to be asked."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.cell import Robot, load_robot
from nlpweld.errors import KinematicsError
from nlpweld.kinematics.chain import Frame
from nlpweld.kinematics.ik import BRANCHES, signs, spherical_arm

from .helpers import (
    NAMES,
    ROBOTS,
    between_limits,
    error_of,
    flange,
    inverse,
    link_frames,
    shoulder_for_radius,
    stretched,
    with_joint,
)

BY_ROBOT = pytest.mark.parametrize("robot", ROBOTS, ids=NAMES)


def solution(robot: Robot, T: np.ndarray, branch: tuple[str, str, str]) -> np.ndarray:
    """Return cosines and sines of the DH angles and reach of one pose T (4, 4), shape (13,)."""
    found = spherical_arm(robot).solve(Frame(ca.SX(T[:3, :3]), ca.SX(T[:3, 3])), ca.SX(ca.DM(signs(branch))))
    return np.array(ca.DM(ca.vertcat(found.cos, found.sin, found.reach))).ravel()


def beyond(robot: Robot) -> np.ndarray:
    """Return poses out of reach of a robot's front shoulder, too far off and too near, shape (20, 4, 4)."""
    T = link_frames(robot, between_limits(robot, 20, seed=20))[-1]
    dh = robot.dh
    upper, fore = dh[1, 0], np.hypot(dh[2, 0], dh[3, 1])
    distance = np.where(np.arange(20) < 10, upper + fore + 0.5, abs(upper - fore) / 2)
    away = np.random.default_rng(21).uniform(0.1, 1.4, 20)  # elevation as seen from the shoulder
    wrist = np.stack([dh[0, 0] + distance * np.cos(away), 0 * away, dh[0, 1] + distance * np.sin(away)], axis=-1)
    T[:, :3, 3] = wrist + dh[5, 1] * T[:, :3, 2]
    return T


@BY_ROBOT
def test_pose_out_of_reach_has_negative_reach(robot: Robot) -> None:
    for branch in BRANCHES[:4]:
        assert inverse(robot, beyond(robot), branch)[1].max() < -1e-6


@BY_ROBOT
def test_pose_out_of_reach_still_has_true_cosines_and_sines(robot: Robot) -> None:
    for T in beyond(robot):
        cos, sin = solution(robot, T, BRANCHES[0])[:12].reshape(2, 6)
        assert cos**2 + sin**2 == pytest.approx(np.ones(6), abs=1e-9)


@BY_ROBOT
def test_arm_points_stretched_at_what_is_too_far_off(robot: Robot) -> None:
    T = beyond(robot)[:10]
    frames = link_frames(robot, inverse(robot, T, BRANCHES[0])[0])
    shoulder = frames[1, :, :3, 3]
    wanted = T[:, :3, 3] - robot.dh[5, 1] * T[:, :3, 2] - shoulder
    got = frames[4, :, :3, 3] - shoulder
    length = robot.dh[1, 0] + np.hypot(robot.dh[2, 0], robot.dh[3, 1])
    unit = wanted / np.linalg.norm(wanted, axis=1, keepdims=True)
    assert np.abs(got - length * unit).max() < 1e-9


@BY_ROBOT
@pytest.mark.parametrize("where", ["wrist_straight", "wrist_folded", "stretched", "on_axis_1", "all_at_once"])
def test_exactly_singular_pose_comes_back_on_every_branch_of_its_arm(robot: Robot, where: str) -> None:
    q = between_limits(robot, 50, seed=22)
    q[:, 2] = stretched(robot) + np.random.default_rng(23).uniform(-1, 1, 50)
    if where in ("wrist_straight", "all_at_once"):
        q[:, 4] = -robot.dh[4, 3]
    if where == "wrist_folded":
        q[:, 4] = np.pi - robot.dh[4, 3]
    if where in ("stretched", "all_at_once"):
        q[:, 2] = stretched(robot)
    if where in ("on_axis_1", "all_at_once"):
        q[:, 1] = shoulder_for_radius(robot, q[:, 2], np.zeros(50))
    T = link_frames(robot, q)[-1]
    tried = [inverse(robot, T, branch) for branch in BRANCHES]
    errors = np.array([error_of(flange(robot, back), T) for back, _ in tried])
    assert np.isfinite([back for back, _ in tried]).all()
    reached = np.array([reach for _, reach in tried]) > -1e-12
    assert (reached.sum(axis=0) >= 4).all()  # both elbows and both wrists of one shoulder at least
    assert errors[reached].max() < 1e-9


@pytest.mark.parametrize("branch", BRANCHES, ids="-".join)
def test_wrist_centre_on_axis_1_to_the_last_bit_comes_back_with_joint_1_at_zero(branch: tuple[str, str, str]) -> None:
    robot, T = load_robot("er16_1600"), np.eye(4)
    T[2, 3] = 1.2
    q, reach = inverse(robot, T[None], branch)
    assert reach[0] > 0.0
    assert q[0, 0] == 0.0
    assert error_of(flange(robot, q), T[None])[0] < 1e-9


@pytest.mark.parametrize("height", [1.2, 5.0], ids=["within_reach", "beyond"])
def test_solution_has_finite_derivatives_with_the_wrist_centre_on_axis_1(height: float) -> None:
    T, arm = ca.SX.sym("T", 4, 4), spherical_arm(load_robot("er16_1600"))
    found = arm.solve(Frame(T[:3, :3], T[:3, 3]), ca.SX([1, 1, 1]))
    rates = ca.Function("rates", [T], [ca.jacobian(ca.vertcat(found.cos, found.sin), ca.vec(T))])
    pose = np.eye(4)
    pose[2, 3] = height
    assert np.isfinite(np.array(rates(pose))).all()


def test_wrist_centre_on_the_front_shoulder_is_out_of_reach_of_unequal_links_and_finite() -> None:
    robot = load_robot("er16_1600")
    T = np.eye(4)
    T[:3, 3] = [0.160, 0.0, 0.412 + 0.095]
    for branch in BRANCHES[:4]:
        found = solution(robot, T, branch)
        assert np.isfinite(found).all()
        assert found[12] < 0.0


WRONG_WRISTS = [(4, "a_m"), (5, "a_m"), (6, "a_m"), (5, "d_m")]


@pytest.mark.parametrize(("number", "field"), WRONG_WRISTS)
def test_wrist_with_an_offset_is_refused_as_not_spherical(number: int, field: str) -> None:
    robot = with_joint(load_robot("er16_1600"), number, **{field: 0.08})
    with pytest.raises(KinematicsError, match=rf"'er16_1600': joints\.{number}\.{field} is 0.08, .* not spherical"):
        spherical_arm(robot)


def test_arm_of_five_joints_is_refused() -> None:
    robot = load_robot("er16_1600")
    five = robot.model_copy(update={"joints": robot.joints[:5]})
    with pytest.raises(KinematicsError, match="'er16_1600': has 5 joints"):
        spherical_arm(five)


@pytest.mark.parametrize(("number", "fields"), [(2, {"alpha_deg": 5.0}), (2, {"d_m": 0.1}), (3, {"d_m": 0.1})])
def test_arm_whose_elbow_axes_are_not_parallel_or_not_in_line_is_refused(number: int, fields: dict) -> None:
    with pytest.raises(KinematicsError, match="needs alpha_deg"):
        spherical_arm(with_joint(load_robot("er16_1600"), number, **fields))


@pytest.mark.parametrize(("number", "fields"), [(2, {"a_m": 0.0}), (2, {"a_m": -0.68})])
def test_arm_without_an_upper_arm_is_refused(number: int, fields: dict) -> None:
    with pytest.raises(KinematicsError, match="upper arm"):
        spherical_arm(with_joint(load_robot("er16_1600"), number, **fields))


def test_arm_without_a_forearm_is_refused() -> None:
    robot = with_joint(with_joint(load_robot("er16_1600"), 3, a_m=0.0), 4, d_m=0.0)
    with pytest.raises(KinematicsError, match="forearm"):
        spherical_arm(robot)
