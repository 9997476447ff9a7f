"""Joint paths: continuous along the seam, on either wrist, and inside their limits where whole turns can bring them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.cell import Cell, Robot, load_robot
from nlpweld.formulation.paths import Limits, best_wrist, flip, joint_paths, limit_margins, on_wrist, settle

from .helpers import tcp_in_base

ER16, GP25 = load_robot("er16_1600"), load_robot("gp25")
seeds = st.integers(0, 10_000)
robots = st.sampled_from([ER16, GP25])


def smooth_paths(seed: int, m: int = 4, points: int = 40) -> np.ndarray:
    """Return closed joint paths without jumps that start in (-pi, pi], some winding, shape (m, 6, points + 1)."""
    rng = np.random.default_rng(seed)
    s = np.arange(points + 1) / points
    waves = sum(rng.normal(0, 0.4, (m, 6, 1)) * np.sin(2 * np.pi * (k * s + rng.random((m, 6, 1)))) for k in (1, 2))
    q = waves + 2 * np.pi * rng.integers(-1, 2, (m, 6, 1)) * s
    return q - q[..., :1] + rng.uniform(-np.pi, np.pi, (m, 6, 1))


def cosines_and_sines(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """Return twelve arrays (m, N) of joint paths (m, 6, N + 1), without the repeated end."""
    theta = q[..., :-1] + robot.dh[:, 3][:, None]
    return [*np.cos(theta).transpose(1, 0, 2), *np.sin(theta).transpose(1, 0, 2)]


@given(robots, seeds)
def test_paths_without_jumps_come_back_from_cosines_and_sines_up_to_whole_turns(robot: Robot, seed: int) -> None:
    q = smooth_paths(seed)
    turns = (joint_paths(robot, cosines_and_sines(robot, q), closed=True) - q) / (2 * np.pi)
    assert turns == pytest.approx(np.round(turns[..., :1]) + 0 * turns, abs=1e-12)


@given(robots, seeds)
def test_joint_paths_take_no_step_longer_than_half_a_turn(robot: Robot, seed: int) -> None:
    jumps = np.random.default_rng(seed).uniform(-np.pi, np.pi, (3, 6, 21))
    assert np.abs(np.diff(joint_paths(robot, cosines_and_sines(robot, jumps), closed=True))).max() <= np.pi + 1e-12


@given(robots, seeds)
def test_joint_paths_end_whole_turns_from_where_they_start(robot: Robot, seed: int) -> None:
    q = joint_paths(robot, cosines_and_sines(robot, smooth_paths(seed)), closed=True)
    turns = (q[..., -1] - q[..., 0]) / (2 * np.pi)
    assert q.shape == (4, 6, 41)
    assert turns == pytest.approx(np.round(turns), abs=1e-12)


@given(robots, seeds)
def test_open_path_is_the_closed_one_without_its_way_back(robot: Robot, seed: int) -> None:
    lanes = cosines_and_sines(robot, smooth_paths(seed))
    whole, without = (joint_paths(robot, lanes, closed) for closed in (True, False))
    assert without.shape == (4, 6, 40)
    assert (without == whole[..., :-1]).all()


@given(robots, seeds)
def test_flip_twice_is_the_identity_up_to_a_turn_of_joints_4_and_6(robot: Robot, seed: int) -> None:
    q = smooth_paths(seed)
    turns = (flip(robot, flip(robot, q)) - q) / (2 * np.pi)
    assert turns == pytest.approx(np.broadcast_to(np.array([0, 0, 0, 1, 0, 1])[:, None], q.shape), abs=1e-12)


@given(seeds)
def test_flip_keeps_the_pose(cell: Cell, seed: int) -> None:
    q = smooth_paths(seed, m=1)
    here, there = (tcp_in_base(cell, 2, path[0].T) for path in (q, flip(ER16, q)))
    assert here == pytest.approx(there, abs=1e-12)


def test_flip_changes_the_side_to_which_the_hand_bends() -> None:
    q = smooth_paths(1)
    assert np.sin(flip(ER16, q)[:, 4]) == pytest.approx(-np.sin(q[:, 4]), abs=1e-12)


def test_flip_leaves_its_argument_as_it_was() -> None:
    q = smooth_paths(1)
    before = q.copy()
    flip(ER16, q)
    assert (q == before).all()


@given(robots, seeds)
def test_limit_margin_is_the_least_distance_of_any_point_to_either_limit(robot: Robot, seed: int) -> None:
    q = smooth_paths(seed, m=1)
    lower, upper = robot.limits_rad.T
    expected = np.minimum(q[0].T - lower, upper - q[0].T).min(axis=0)
    assert limit_margins(robot, q)[0] == pytest.approx(expected, abs=1e-12)


@given(robots, seeds, st.floats(0.0, 0.3))
def test_settled_path_keeps_the_margin_that_some_whole_turns_could_give_it(
    robot: Robot, seed: int, need: float
) -> None:
    q = smooth_paths(seed)
    best = np.max([limit_margins(robot, q + 2 * np.pi * turns) for turns in range(-3, 4)], axis=0)
    settled = limit_margins(robot, settle(robot, q, need))
    assert (settled >= np.minimum(best, need) - 1e-9).all()


@given(robots, seeds)
def test_settled_path_is_the_path_up_to_whole_turns(robot: Robot, seed: int) -> None:
    q = smooth_paths(seed)
    turns = (settle(robot, q) - q) / (2 * np.pi)
    assert turns == pytest.approx(np.round(turns[..., :1]) + 0 * turns, abs=1e-12)


@given(robots, seeds)
def test_path_that_keeps_its_margin_is_left_where_it_is(robot: Robot, seed: int) -> None:
    q = smooth_paths(seed)
    keeps = limit_margins(robot, q) >= 0.05
    assert (settle(robot, q, 0.05)[keeps] == q[keeps]).all()


def test_on_wrist_leaves_noflip_paths_and_flips_the_others() -> None:
    q = smooth_paths(2)
    assert (on_wrist(ER16, q, "noflip") == q).all()
    assert (on_wrist(ER16, q, "flip") == flip(ER16, q)).all()


@given(robots, seeds, st.sampled_from([("noflip", "flip"), ("flip", "noflip"), ("flip",)]), st.booleans())
def test_first_wrist_that_keeps_the_margin_is_chosen_or_else_the_one_that_keeps_most(
    robot: Robot, seed: int, wrists: tuple[str, ...], closed: bool
) -> None:
    q, need = smooth_paths(seed, m=8) * np.array([0.6, 0.6, 0.6, 1.0, 0.6, 1.0])[:, None], 0.1
    lanes = cosines_and_sines(robot, q)
    margins, best = best_wrist(Limits.of(robot, closed), lanes, wrists, need)
    paths = joint_paths(robot, lanes, closed)
    each = [limit_margins(robot, settle(robot, on_wrist(robot, paths, wrist), need)).min(axis=-1) for wrist in wrists]
    for i in range(8):
        enough = [k for k in range(len(wrists)) if each[k][i] >= need]
        assert best[i] == enough[0] if enough else each[best[i]][i] >= max(margin[i] for margin in each) - 1e-12
        assert margins[i] == pytest.approx(each[best[i]][i], abs=1e-12)
