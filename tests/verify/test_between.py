"""The motion between the points."""

import numpy as np
import pytest

from nlpweld.verify import between
from nlpweld.verify import reference as ref
from nlpweld.verify.check import verify

from .helpers import cell_with, changed

UP = np.array([0.0, 0.0, 3.0])


@pytest.fixture(scope="module")
def motion(plan):
    return between.whole_motion(plan.cell, plan.placement_m, plan.s, plan.paths)


def test_nothing_moves_far_between_samples(plan, motion):
    assert len(motion.s) > 2 * len(plan.s)
    for station in plan.cell.stations:
        q = motion.q[station.name]
        assert np.abs(np.diff(q, axis=0)).max() <= between.JOINT_STEP_RAD
        T_W_L = ref.link_poses(station, q)
        ends = ref.body_ends(station, T_W_L, ref.tcp_pose(station, T_W_L))
        assert np.linalg.norm(np.diff(ends, axis=0), axis=-1).max() <= plan.cell.constraints.verify_step_m
    work = ref.workpiece_ends(plan.cell, ref.workpiece_pose(plan.cell, plan.placement_m, motion.s))
    assert np.linalg.norm(np.diff(work, axis=0), axis=-1).max() <= plan.cell.constraints.verify_step_m


def test_every_sample_reaches_the_weld(plan, motion):
    assert not motion.jumps
    assert not motion.unclosed
    for station in plan.cell.stations:
        T_W_E = ref.tcp_pose(station, ref.link_poses(station, motion.q[station.name]))
        wanted = ref.required_pose(plan.cell, station, plan.placement_m, motion.s)
        np.testing.assert_allclose(T_W_E, wanted, atol=1e-7)


def test_points_of_the_plan_are_among_the_samples(plan, motion):
    np.testing.assert_array_equal(motion.s[motion.at], plan.s)
    for name, path in plan.paths.items():
        np.testing.assert_array_equal(motion.q[name][motion.at], path)
    np.testing.assert_array_equal(motion.point[motion.at], np.arange(len(plan.s)))
    assert motion.point[motion.at[5] - 1] == 4


def test_seam_is_closed_whole_turns_on(plan, motion):
    assert motion.s[-1] == motion.s[0] + 1
    for name, q in motion.q.items():
        turns = (q[-1] - plan.paths[name][0]) / (2 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    assert motion.q["handler_1"][-1, 3] - motion.q["handler_1"][0, 3] == pytest.approx(-2 * np.pi)


def test_newton_finds_the_configuration_it_started_beside(plan, rng):
    station = plan.cell.stations[1]
    q = plan.paths[station.name]
    T_W_E = ref.required_pose(plan.cell, station, plan.placement_m, plan.s)
    found, error = between.close_chain(station, T_W_E, q + rng.uniform(-0.05, 0.05, size=q.shape))
    np.testing.assert_allclose(found, q, atol=1e-8)
    assert np.abs(error).max() < 1e-8


def test_newton_owns_up_to_a_pose_out_of_reach(plan):
    station = plan.cell.stations[1]
    far = ref.required_pose(plan.cell, station, plan.placement_m + UP, plan.s[:2])
    _, error = between.close_chain(station, far, plan.paths[station.name][:2])
    assert (np.linalg.norm(error[:, :3], axis=1) > 1).all()


def test_middle_out_of_reach_is_told(plan):
    far = plan.placement_m + UP
    motion = between.whole_motion(plan.cell, far, plan.s, plan.paths)
    assert {u.robot for u in motion.unclosed} == set(plan.paths)
    assert {j.robot for j in motion.jumps} >= {"handler_1", "handler_2"}
    assert all(u.position_m > 1 for u in motion.unclosed)


def test_jump_ends_the_halving(plan):
    path = plan.paths["welder"].copy()
    path[36:, 5] += 1.0
    motion = between.whole_motion(plan.cell, plan.placement_m, plan.s, {**plan.paths, "welder": path})
    assert {(j.robot, j.joint) for j in motion.jumps} == {("welder", 5)}
    assert len(motion.s) < 2000


def test_finer_steps_move_no_margin(plan, report):
    """The cell's own claim about verify_step_m: halving it moves no margin by more than 1e-4 of its level."""
    fine = verify(changed(plan, cell=cell_with(plan.cell, constraints={"verify_step_m": 0.0025})))
    assert fine.samples > 1.5 * report.samples
    assert abs(fine.clearance_along_m - report.clearance_along_m) < 1e-4 * plan.cell.constraints.clearance_m
    for name, w in report.singularity_min.items():
        assert abs(fine.singularity_min[name] - w) < 1e-4 * plan.cell.constraints.singularity_floor_m3
