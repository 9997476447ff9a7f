"""A positioner's path along a seam: continuous, inside the limits, branch by rule."""

import numpy as np
import pytest

from nlpweld.cell import Joint, Robot, load_positioner
from nlpweld.errors import KinematicsError
from nlpweld.kinematics.chain import rpy_pose
from nlpweld.kinematics.positioner import BASE_RPY_DEG, off_upright, up_in_base
from nlpweld.kinematics.turning import follow

UP = up_in_base(rpy_pose((0.0, 0.0, 0.0), BASE_RPY_DEG)[:3, :3])
DKP, ZHANG = load_positioner("dkp_400"), load_positioner("zhang_rt")


def limited(robot: Robot, *spans: tuple[float, float]) -> Robot:
    """Return the robot with other joint limits [deg]."""
    joints = [
        Joint(**{**joint.model_dump(), "lower_deg": low, "upper_deg": high})
        for joint, (low, high) in zip(robot.joints, spans, strict=True)
    ]
    return Robot(**{**dict(robot), "joints": tuple(joints)})


def cone(azimuth_deg: np.ndarray, tilt_deg: float) -> np.ndarray:
    """Return directions at a tilt from the table axis, shape (M, 3)."""
    a, t = np.radians(azimuth_deg), np.radians(tilt_deg)
    return np.stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.full_like(a, np.cos(t))], axis=-1)


@pytest.mark.parametrize("robot", [DKP, ZHANG], ids=["dkp_400", "zhang_rt"])
def test_half_turn_about_the_table_axis_is_followed_by_the_table_alone(robot: Robot) -> None:
    tilt = 40.0 if robot is DKP else 140.0
    e = cone(np.linspace(0, 180, 91), tilt)
    path = follow(robot, e, UP)
    assert np.ptp(path.q[:, 0]) < 1e-12
    assert np.diff(path.q[:, 1]) == pytest.approx(np.full(90, -np.radians(2)), abs=1e-12)
    assert off_upright(robot, path.q, e, UP).max() < 1e-12
    assert path.off_upright.max() < 1e-12
    assert path.branch.tolist() == [0] * 91


def test_path_is_unwrapped_past_half_a_turn_and_shifted_into_the_limits() -> None:
    e = cone(np.linspace(175, 535, 181), 30.0)
    path = follow(DKP, e, UP)
    low, high = DKP.limits_rad.T
    assert (path.q >= low).all()
    assert (path.q <= high).all()
    assert np.ptp(path.q[:, 1]) == pytest.approx(2 * np.pi, abs=1e-12)


def test_first_branch_is_kept_unless_only_the_second_is_inside_the_limits() -> None:
    e = cone(np.linspace(0, 90, 46), 40.0)
    both, one_side = follow(DKP, e, UP), follow(limited(DKP, (-90.0, 10.0), (-400.0, 400.0)), e, UP)
    other_side = follow(limited(DKP, (-10.0, 90.0), (-400.0, 400.0)), e, UP)
    assert both.branch[0] == 0
    assert sorted([one_side.branch[0], other_side.branch[0]]) == [0, 1]
    assert one_side.q[:, 0] == pytest.approx(np.full(46, -np.radians(40)), abs=1e-12)
    assert other_side.q[:, 0] == pytest.approx(np.full(46, np.radians(40)), abs=1e-12)


@pytest.mark.parametrize("points", [21, 20])  # with and without a point on the axis itself
@pytest.mark.parametrize("aside", [0.0, 1e-6])
def test_path_through_the_table_axis_tilts_through_and_changes_branch(points: int, aside: float) -> None:
    angle = np.radians(np.linspace(-20, 20, points))
    e = np.stack([np.sin(angle), np.full(points, aside * (points == 20)), np.cos(angle)], axis=-1)
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    path = follow(limited(DKP, (-90.0, 90.0), (-100.0, 100.0)), e, UP)
    assert np.abs(np.diff(path.q[:, 0])).max() < np.radians(2.2)
    assert path.off_upright.max() < 1e-12
    assert set(path.branch.tolist()) == {0, 1}
    assert np.ptp(path.q[:, 1]) < 200 * aside + 1e-12


@pytest.mark.parametrize("held", [slice(0, 3), slice(5, 8), slice(18, 21)])
def test_table_stays_where_the_direction_is_along_its_axis(held: slice) -> None:
    e = cone(np.linspace(0, 40, 21), 15.0)
    e[held] = (0.0, 0.0, 1.0)
    q = follow(DKP, e, UP).q[:, 1]
    source = max(held.start - 1, 0) if held.start else held.stop
    assert np.ptp(q[held]) == 0.0
    assert q[held.start] == q[source]


def test_table_stands_where_told_when_it_is_free_all_along() -> None:
    e = np.tile([0.0, 0.0, 1.0], (4, 1))
    assert follow(DKP, e, UP, start_theta=0.5).q == pytest.approx(np.tile([0.0, 0.5], (4, 1)), abs=1e-15)


def test_rotator_stands_where_told_when_every_direction_is_along_its_axis() -> None:
    joint = load_positioner("rotator").joints[0].model_copy(update={"offset_deg": 50.0})
    robot = load_positioner("rotator").model_copy(update={"joints": (joint,)})
    path = follow(robot, np.tile([0.0, 0.0, 1.0], (3, 1)), UP, start_theta=0.5, tolerance_deg=90.1)
    assert path.q == pytest.approx(np.full((3, 1), 0.5 - np.radians(50)), abs=1e-15)


def test_way_back_of_a_closed_seam_counts_against_the_limits() -> None:
    e = cone(185.0 + 10.0 * np.arange(36), 30.0)
    robot = limited(DKP, (-90.0, 90.0), (-178.0, 178.0))
    assert follow(robot, e, UP).q.shape == (36, 2)
    with pytest.raises(KinematicsError, match=r"^positioner 'dkp_400': point \d+: joint 2 would stand at "):
        follow(robot, e, UP, closed=True)
    assert follow(DKP, e, UP, closed=True).q.shape == (36, 2)


def test_point_and_angle_out_of_the_limits_are_named_for_both_branches() -> None:
    e = np.concatenate([cone(np.zeros(3), 40.0), cone(np.zeros(1), 75.0)])
    with pytest.raises(KinematicsError) as caught:
        follow(limited(DKP, (-60.0, 60.0), (-400.0, 400.0)), e, UP)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith("positioner 'dkp_400': point 3: joint 1 would stand at ")
    assert "75 deg, outside -60 to 60 deg; " in text
    assert "-75 deg, outside -60 to 60 deg; " in text


def test_jump_of_a_joint_is_named_with_its_point() -> None:
    e = cone(np.array([0.0, 10.0, 130.0, 140.0]), 60.0)
    with pytest.raises(KinematicsError, match=r"point 2: joint \d would turn by 120 deg from point 1 to the next"):
        follow(DKP, e, UP)


def test_direction_that_two_axes_cannot_bring_upright_is_named() -> None:
    up = up_in_base(rpy_pose((0.0, 0.0, 0.0), (-60.0, 0.0, 0.0))[:3, :3])
    e = cone(np.array([0.0, 0.0]), 45.0)
    e[1] = cone(np.zeros(1), 20.0)[0]
    assert follow(ZHANG, -e, up, tolerance_deg=10.001).off_upright == pytest.approx([0, np.radians(10)], abs=1e-12)
    with pytest.raises(
        KinematicsError, match=r"^positioner 'zhang_rt': point 1: weld stays 10 deg from upright, above 5"
    ):
        follow(ZHANG, -e, up)


def test_upright_first_axis_is_refused() -> None:
    with pytest.raises(KinematicsError, match=r"^positioner 'dkp_400': upright is along axis 1"):
        follow(DKP, cone(np.zeros(2), 30.0), np.array([0.0, 0.0, 1.0]))


def around_the_rotator(lean_deg: float) -> np.ndarray:
    """Return directions once around the rotator's axis, leaning along it, shape (40, 3)."""
    return cone(np.linspace(0, 360, 40), 90.0 - lean_deg)


def test_rotator_turns_once_for_a_weld_around_its_axis() -> None:
    path = follow(load_positioner("rotator"), around_the_rotator(3.0), UP)
    assert np.ptp(path.q) == pytest.approx(2 * np.pi, abs=1e-12)
    assert path.off_upright == pytest.approx(np.full(40, np.radians(3)), abs=1e-12)


def test_rotator_names_the_point_it_leaves_too_far_from_upright() -> None:
    e = around_the_rotator(3.0)
    e[7] = cone(np.array([60.0]), 78.0)[0]
    with pytest.raises(
        KinematicsError, match=r"^positioner 'rotator': point 7: weld stays 12 deg from upright, above 5"
    ):
        follow(load_positioner("rotator"), e, UP)
    assert follow(load_positioner("rotator"), e, UP, tolerance_deg=12.1).off_upright[7] == pytest.approx(np.radians(12))


@pytest.mark.parametrize("factor", [np.nan, 0.0, 1.01])
def test_direction_of_another_length_is_refused(factor: float) -> None:
    e = cone(np.linspace(0, 90, 4), 40.0)
    e[2] *= factor
    with pytest.raises(KinematicsError, match=r"^positioner 'dkp_400': point 2: direction .* is not of unit length; "):
        follow(DKP, e, UP)
