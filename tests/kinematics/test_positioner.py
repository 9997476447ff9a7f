"""Positioners: forward kinematics of Zhang et al., eq. (6), and the inverse that turns directions upright."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlpweld.cell import Joint, Robot, library_names, load_positioner
from nlpweld.errors import CellError, KinematicsError
from nlpweld.kinematics.chain import rpy_pose
from nlpweld.kinematics.positioner import (
    BASE_RPY_DEG,
    off_upright,
    one_axis,
    table_poses,
    two_axes,
    up_in_base,
)

from .helpers import error_of, flange

RANDOM = 20_000
NAMES = library_names("positioners")
ZHANG, DKP = load_positioner("zhang_rt"), load_positioner("dkp_400")
STANDING = rpy_pose((0.0, 0.0, 0.0), BASE_RPY_DEG)[:3, :3]
UP = up_in_base(STANDING)
K = pytest.mark.parametrize("k", [0, 1])


def directions(seed: int, m: int = RANDOM) -> np.ndarray:
    """Return random unit vectors, shape (m, 3)."""
    v = np.random.default_rng(seed).normal(size=(m, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def oblique(alpha_deg: float = -65.0) -> Robot:
    """Return a positioner whose axes are not at right angles, with offsets and lengths in every row."""
    rows = [(0.1, 0.2, alpha_deg, 25.0), (0.05, 0.3, 40.0, -70.0)]
    joints = tuple(
        Joint(a_m=a, d_m=d, alpha_deg=alpha, offset_deg=o, lower_deg=-360.0, upper_deg=360.0) for a, d, alpha, o in rows
    )
    return Robot(name="oblique", title="", joints=joints, zero_flange_m=(0.0, 0.0, 0.0), reach_m=1.0, source="test")


@pytest.mark.parametrize("name", NAMES)
def test_library_positioner_stands_at_zero_where_its_file_says(name: str) -> None:
    robot = load_positioner(name)
    zero = np.zeros((1, len(robot.joints)))
    assert flange(robot, zero)[0, :3, 3] == pytest.approx(robot.zero_flange_m, abs=1e-15)


def test_table_of_the_dkp_400_faces_up_at_zero() -> None:
    T = flange(DKP, np.zeros((1, 2)))[0]
    assert STANDING @ T[:3, 2] == pytest.approx([0, 0, 1], abs=1e-15)
    assert STANDING @ T[:3, 3] == pytest.approx([0, 0, 0.347], abs=1e-15)


@pytest.mark.parametrize("robot", [*(load_positioner(n) for n in NAMES), oblique()], ids=[*NAMES, "oblique"])
def test_table_pose_is_the_chains(robot: Robot) -> None:
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (500, len(robot.joints)))
    assert error_of(table_poses(robot, q), flange(robot, q)).max() < 1e-14


def test_chain_on_its_side_has_the_printed_entries_of_eq_6() -> None:
    rng = np.random.default_rng(2)
    q, e, p = rng.uniform(-np.pi, np.pi, (500, 2)), rng.normal(size=(500, 3)), rng.normal(size=(500, 3))
    T = flange(ZHANG, q)
    (c1, c2), (s1, s2), d2 = np.cos(q).T, np.sin(q).T, ZHANG.joints[1].d_m
    turned = STANDING @ T[:, :3, :3] @ e[..., None]
    expected = [
        c1 * c2 * e[:, 0] - c1 * s2 * e[:, 1] - s1 * e[:, 2],
        -s2 * e[:, 0] - c2 * e[:, 1],
        -s1 * c2 * e[:, 0] + s1 * s2 * e[:, 1] - c1 * e[:, 2],
    ]
    assert np.abs(turned[..., 0] - np.transpose(expected)).max() < 1e-14
    point = STANDING @ (T[:, :3, :3] @ p[..., None] + T[:, :3, 3:])
    at = [
        c1 * c2 * p[:, 0] - c1 * s2 * p[:, 1] - s1 * p[:, 2] - d2 * s1,
        -s2 * p[:, 0] - c2 * p[:, 1],
        -s1 * c2 * p[:, 0] + s1 * s2 * p[:, 1] - c1 * p[:, 2] - d2 * c1,
    ]
    assert np.abs(point[..., 0] - np.transpose(at)).max() < 1e-14


@K
def test_every_direction_is_turned_upright(k: int) -> None:
    e = directions(seed=3)
    for robot in (ZHANG, DKP):
        q = two_axes(robot).joints(e, UP, k)
        assert off_upright(robot, q, e, UP).max() < 1e-12


@K
def test_inverse_is_that_of_eq_8(k: int) -> None:
    e = directions(seed=4)
    theta2 = np.arctan2(-e[:, 1], e[:, 0]) + k * np.pi
    theta1 = np.arctan2(e[:, 1] * np.sin(theta2) - e[:, 0] * np.cos(theta2), -e[:, 2])
    off = two_axes(ZHANG).joints(e, UP, k) - np.stack([theta1, theta2], axis=-1)
    assert np.abs(np.angle(np.exp(1j * off))).max() < 1e-12
    assert (np.sin(theta1) * (1 - 2 * k)).max() <= 1e-15


@K
def test_direction_along_the_table_axis_leaves_the_table_where_it_is(k: int) -> None:
    e = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1e-13, 0.0, 1.0]])
    q = two_axes(DKP).joints(e, UP, k, free_theta2=0.7)
    assert q[:, 1] == pytest.approx([0.7] * 3, abs=1e-15)
    assert off_upright(DKP, q, e, UP).max() < 1e-12
    assert q[0, 0] == pytest.approx(0.0, abs=1e-15)
    assert abs(q[1, 0]) == pytest.approx(np.pi, abs=1e-15)


@K
@pytest.mark.parametrize("rpy", [(-75.0, 10.0, 30.0), (-130.0, -20.0, 0.0)])
@pytest.mark.parametrize("robot", [ZHANG, oblique()], ids=["zhang", "oblique"])
def test_tilted_base_turns_every_direction_in_reach_upright(k: int, rpy: tuple[float, ...], robot: Robot) -> None:
    up = up_in_base(rpy_pose((0.0, 0.0, 0.0), rpy)[:3, :3])  # type: ignore[arg-type]
    q = np.random.default_rng(5).uniform(-np.pi, np.pi, (RANDOM, 2))
    e = np.einsum("mji,j->mi", table_poses(robot, q)[:, :3, :3], up)  # all of them in reach
    found = two_axes(robot).joints(e, up, k)
    assert off_upright(robot, found, e, up).max() < 1e-12


def test_both_branches_of_a_tilted_base_give_back_the_joints_a_direction_came_from() -> None:
    up = up_in_base(rpy_pose((0.0, 0.0, 0.0), (-75.0, 10.0, 30.0))[:3, :3])
    robot = oblique()
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (1000, 2))
    e = np.einsum("mji,j->mi", table_poses(robot, q)[:, :3, :3], up)
    off = [np.abs(np.angle(np.exp(1j * (two_axes(robot).joints(e, up, k) - q)))).max(axis=1) for k in (0, 1)]
    assert np.minimum(*off).max() < 1e-6  # where both branches meet, the square root leaves half the digits
    assert np.median(np.minimum(*off)) < 1e-14


@K
def test_direction_out_of_reach_of_a_tilted_base_comes_as_near_as_it_goes(k: int) -> None:
    up = up_in_base(rpy_pose((0.0, 0.0, 0.0), (-60.0, 0.0, 0.0))[:3, :3])  # axis 1 stands 30 degrees off level
    e = np.array([[np.sin(0.1), 0.0, np.cos(0.1)]])  # 0.1 rad off the table axis
    q = two_axes(ZHANG).joints(e, up, k)
    assert off_upright(ZHANG, q, e, up) == pytest.approx([np.radians(30) - 0.1], abs=1e-12)


@K
def test_graph_gives_the_joints_of_the_arrays(k: int) -> None:
    robot, up = oblique(), directions(seed=7, m=1)[0]
    q = np.random.default_rng(8).uniform(-np.pi, np.pi, (500, 2))
    e = np.einsum("mji,j->mi", table_poses(robot, q)[:, :3, :3], up)
    direction = ca.SX.sym("e", 3)
    solved = ca.Function("solve", [direction], list(two_axes(robot).solve(direction, ca.DM(up), ca.DM(1 - 2 * k))))
    cos, sin, reach = (np.array(out) for out in solved.map(len(e))(e.T))
    theta = (two_axes(robot).joints(e, up, k) + robot.dh[:, 3]).T
    assert np.abs(cos - np.cos(theta)).max() < 1e-7
    assert np.median(np.abs(sin - np.sin(theta))) < 1e-14
    assert reach.min() > -1e-14


def test_graph_comes_as_near_as_the_arrays_where_upright_is_out_of_reach_and_says_so() -> None:
    up = up_in_base(rpy_pose((0.0, 0.0, 0.0), (-60.0, 0.0, 0.0))[:3, :3])
    e = np.array([np.sin(0.1), 0.0, np.cos(0.1)])
    solved = two_axes(ZHANG).solve(ca.SX(ca.DM(e)), ca.SX(ca.DM(up)), ca.SX(1))
    cos, sin, reach = (np.array(ca.DM(out)).ravel() for out in solved)
    assert reach[0] < 0
    expected = two_axes(ZHANG).joints(e[None], up, 0)[0]
    assert cos == pytest.approx(np.cos(expected), abs=1e-10)  # the graph keeps a root of 1e-24 from zero
    assert sin == pytest.approx(np.sin(expected), abs=1e-10)
    assert np.hypot(cos, sin) == pytest.approx([1, 1], abs=1e-14)


@K
@pytest.mark.parametrize("rpy", [(-90.0, 0.0, 0.0), (-60.0, 0.0, 0.0), (-130.0, -20.0, 0.0)])
@pytest.mark.parametrize("robot", [ZHANG, oblique(), oblique(130.0)], ids=["zhang", "oblique", "obtuse"])
def test_room_is_what_is_left_before_upright_is_out_of_reach(k: int, rpy: tuple[float, ...], robot: Robot) -> None:
    up = up_in_base(rpy_pose((0.0, 0.0, 0.0), rpy)[:3, :3])  # type: ignore[arg-type]
    e = directions(seed=10, m=2000)
    room = two_axes(robot).room(e, up)
    remaining = off_upright(robot, two_axes(robot).joints(e, up, k), e, up)
    assert remaining == pytest.approx(np.maximum(0.0, -room), abs=1e-9)
    both = [two_axes(robot).joints(e, up, j) for j in (0, 1)]
    apart = np.abs(np.angle(np.exp(1j * (both[0] - both[1])))).max(axis=1)
    assert (apart[room < -1e-9] < 1e-9).all()
    assert (apart[room > 1e-2] > 1e-2).all()


def turned_rotator() -> Robot:
    """Return a rotator with an offset, an arm and a twist."""
    joint = Joint(a_m=0.1, d_m=0.2, alpha_deg=30.0, offset_deg=50.0, lower_deg=-360.0, upper_deg=360.0)
    return Robot(name="turned", title="", joints=(joint,), zero_flange_m=(0.0, 0.0, 0.0), reach_m=1.0, source="test")


@pytest.mark.parametrize("robot", [load_positioner("rotator"), turned_rotator()], ids=["rotator", "turned"])
def test_rotator_brings_directions_as_near_to_upright_as_one_axis_can(robot: Robot) -> None:
    e = directions(seed=9, m=200)
    q, _ = one_axis(robot).joints(e, UP)
    remaining = off_upright(robot, q, e, UP)
    along_axis = e @ table_poses(robot, np.zeros((1, 1)))[0, 2, :3]  # the axis is level: this part stays
    expected = np.abs(np.arcsin(along_axis))
    assert remaining == pytest.approx(expected, abs=1e-12)
    for step in (-1e-3, 1e-3):
        assert (off_upright(robot, q + step, e, UP) > remaining).all()


def test_direction_along_the_rotators_axis_is_free() -> None:
    e = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    q, free = one_axis(load_positioner("rotator")).joints(e, UP, free_theta=0.3)
    assert free.tolist() == [True, False]
    assert q[0, 0] == pytest.approx(0.3, abs=1e-15)


def test_robots_of_other_builds_are_refused_in_one_line() -> None:
    with pytest.raises(KinematicsError, match=r"^positioner 'rotator': has 1 joints; this inverse needs two$"):
        two_axes(load_positioner("rotator"))
    with pytest.raises(KinematicsError, match=r"^positioner 'dkp_400': has 2 joints; this inverse needs one$"):
        one_axis(DKP)
    with pytest.raises(KinematicsError, match=r"^positioner 'oblique': joints\.1\.alpha_deg is 180, so its axes are "):
        two_axes(oblique(alpha_deg=180.0))


def test_misspelt_positioner_is_answered_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(CellError, match=r"^dkp_40: no such file and no built-in positioner .*'dkp_400'\?$"):
        load_positioner("dkp_40")
