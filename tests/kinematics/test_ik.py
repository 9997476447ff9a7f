"""The closed-form inverse of every library robot: poses come back on every branch, and branches bear their names."""

from itertools import product

import numpy as np
import pytest

from nlpweld.cell import Robot
from nlpweld.kinematics.ik import BRANCHES, signs

from .helpers import (
    NAMES,
    ROBOTS,
    between_limits,
    elbow_and_radius,
    error_of,
    flange,
    inverse,
    link_frames,
    shoulder_for_radius,
    stretched,
    wrapped,
)

MANY = 10_000
BY_BRANCH = pytest.mark.parametrize(
    ("robot", "branch"),
    [pytest.param(r, b, id="-".join((r.name, *b))) for r, b in product(ROBOTS, BRANCHES)],
)
BY_ROBOT = pytest.mark.parametrize("robot", ROBOTS, ids=NAMES)


def small(m: int, seed: int) -> np.ndarray:
    """Return m numbers of either sign, from 1e-9 to 0.1 in even shares of each decade."""
    rng = np.random.default_rng(seed)
    return rng.choice([-1.0, 1.0], m) * 10 ** rng.uniform(-9, -1, m)


def random_joints(robot: Robot) -> np.ndarray:
    """Return joints within the limits; nine tenths anywhere, the rest near one or more of the three singularities."""
    q = between_limits(robot, MANY, seed=6)
    near = [slice(0, 500), slice(400, 900), slice(800, 1000)]  # they overlap: two singularities at once
    q[near[0], 4] = small(500, 7) - robot.dh[4, 3]
    q[near[1], 2] = stretched(robot) + small(500, 8)
    q[900:1000, 2] = stretched(robot) + np.random.default_rng(9).uniform(-1, 1, 100)  # where axis 1 is within reach
    q[near[2], 1] = shoulder_for_radius(robot, q[near[2], 2], small(200, 9))
    return q


def own_branch(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return the signs of shoulder, elbow and wrist that joints have, shape (m, 3)."""
    elbow, radius = elbow_and_radius(robot, q)
    return np.sign(np.stack([radius, elbow, np.sin(q[:, 4] + robot.dh[4, 3])], axis=-1)).astype(int)


@BY_BRANCH
def test_pose_within_reach_comes_back_on_every_branch(robot: Robot, branch: tuple[str, str, str]) -> None:
    T = link_frames(robot, random_joints(robot))[-1]
    q, reach = inverse(robot, T, branch)
    within = reach >= 0.0
    assert within.sum() > MANY / 10
    assert error_of(flange(robot, q), T)[within].max() < 1e-9


@BY_ROBOT
def test_every_pose_of_the_arm_is_within_reach_and_comes_back_on_its_own_branch(robot: Robot) -> None:
    q = random_joints(robot)
    T, own = link_frames(robot, q)[-1], own_branch(robot, q)
    for branch in BRANCHES:
        mine = (own == signs(branch)).all(axis=1)
        back, reach = inverse(robot, T[mine], branch)
        assert reach.min() > -1e-12
        assert error_of(flange(robot, back), T[mine]).max() < 1e-9


@BY_ROBOT
def test_joints_away_from_singularities_come_back_on_their_own_branch(robot: Robot) -> None:
    q = between_limits(robot, MANY, seed=10)
    elbow, radius = elbow_and_radius(robot, q)
    q = q[np.min([np.abs(elbow), np.abs(radius), np.abs(np.sin(q[:, 4] + robot.dh[4, 3]))], axis=0) > 0.01]
    T, own = link_frames(robot, q)[-1], own_branch(robot, q)
    found = np.stack([inverse(robot, T, branch)[0] for branch in BRANCHES])
    index = [[signs(branch) for branch in BRANCHES].index(tuple(side)) for side in own]
    assert len(q) > MANY / 2
    assert np.abs(wrapped(found[index, np.arange(len(q))] - q)).max() < 1e-9


@BY_ROBOT
def test_branches_away_from_singularities_are_eight_different_configurations(robot: Robot) -> None:
    q = between_limits(robot, 1000, seed=11)
    T = link_frames(robot, q)[-1]
    found = [inverse(robot, T, branch) for branch in BRANCHES]
    apart = own_distance(robot, q) & np.all([reach > 0.05 for _, reach in found], axis=0)
    assert apart.sum() > 50
    for (q_a, _), (q_b, _) in ((a, b) for i, a in enumerate(found) for b in found[:i]):
        assert np.abs(wrapped(q_a - q_b))[apart].max(axis=1).min() > 0.01


def own_distance(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Tell which joints are well away from every singularity, shape (m,)."""
    elbow, radius = elbow_and_radius(robot, q)
    return np.min([np.abs(elbow), np.abs(radius), np.abs(np.sin(q[:, 4] + robot.dh[4, 3]))], axis=0) > 0.05


def frames_on(robot: Robot, branch: tuple[str, str, str], seed: int) -> np.ndarray:
    """Return link frames (7, m, 4, 4) of reachable poses on one branch."""
    T = link_frames(robot, between_limits(robot, 2000, seed))[-1]
    q, reach = inverse(robot, T, branch)
    frames = link_frames(robot, q[reach > 1e-3])
    assert frames.shape[1] > 100
    return frames


@BY_BRANCH
def test_front_shoulder_faces_the_wrist_centre_and_back_turns_away(robot: Robot, branch: tuple[str, str, str]) -> None:
    frames = frames_on(robot, branch, seed=12)
    facing = np.sum(frames[1, :, :3, 0] * frames[4, :, :3, 3], axis=1)  # x of link 1 points where the shoulder does
    assert (signs(branch)[0] * facing).min() > 0.0


@BY_BRANCH
def test_elbow_up_lies_above_the_line_from_shoulder_to_wrist_as_the_shoulder_faces(
    robot: Robot, branch: tuple[str, str, str]
) -> None:
    frames = frames_on(robot, branch, seed=13)
    shoulder, elbow, wrist = (frames[k, :, :3, 3] for k in (1, 2, 4))
    ahead = frames[1, :, :3, 0]
    to_wrist, to_elbow = wrist - shoulder, elbow - shoulder
    turned = np.sum(to_wrist * ahead, axis=1) * to_elbow[:, 2] - np.sum(to_elbow * ahead, axis=1) * to_wrist[:, 2]
    assert (signs(branch)[1] * turned).min() > 0.0


@BY_BRANCH
def test_wrist_noflip_bends_the_hand_positively_about_axis_5(robot: Robot, branch: tuple[str, str, str]) -> None:
    frames = frames_on(robot, branch, seed=14)
    axis_4, axis_5, axis_6 = (frames[k, :, :3, 2] for k in (3, 4, 6))
    bend = np.sum(np.cross(axis_4, axis_6) * axis_5, axis=1)
    assert (signs(branch)[2] * bend).min() > 0.0
