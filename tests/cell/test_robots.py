"""The robot library against sources independent of its DH rows."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from nlpweld.cell import Robot, library_names, load_cell, load_robot
from nlpweld.cell.checked import Sourced, holds_number

ROBOTS = library_names("robots")


class Pose(NamedTuple):
    """A flange pose computed elsewhere: controller angles [deg], position [m], two axes of the flange frame there."""

    robot: str
    joints_deg: tuple[float, ...]
    position_m: tuple[float, float, float]
    x_axis: tuple[float, float, float]
    z_axis: tuple[float, float, float]


# Origin: the URDF chain base_link to tool0 (ESTUN: to flange) of the file named in each robot's `source`, at these
# joint angles, multiplied out from the URDF's origins and axes alone. er16_1600 has no URDF: the modified-DH chain of
# its catalogue entry, another convention than the library's. 6 digits count: the GP25's URDF writes pi/2 as 1.570796.
# fmt: off
FIRST, SECOND = (35, 20, -25, 40, 50, -70), (-110, -40, 30, -95, -60, 130)
POSES = [
    Pose("er16_1600", FIRST, (0.951302686, -0.723215155, 1.195649101),
         (-0.173175987, -0.584997820, 0.792330504), (0.284001482, -0.799974118, -0.528568414)),
    Pose("er16_1600", SECOND, (-0.089533366, 0.485623987, 1.192358074),
         (-0.378636625, 0.299387076, 0.875786324), (0.637806099, 0.770095667, 0.012491698)),
    Pose("er20_1780_a6", FIRST, (1.046890235, -0.807578587, 1.384263424),
         (0.173175987, 0.584997820, -0.792330504), (0.284001482, -0.799974118, -0.528568415)),
    Pose("er20_1780_a6", SECOND, (-0.070045512, 0.505232699, 1.380042745),
         (0.378636625, -0.299387077, -0.875786323), (0.637806099, 0.770095667, 0.012491698)),
    Pose("gp25", FIRST, (0.955110594, 0.728887052, 0.794480638),
         (0.627488961, -0.266884255, 0.731457721), (0.429794051, 0.902059363, -0.039572461)),
    Pose("gp25", SECOND, (0.164708657, 0.200287964, 1.952219607),
         (0.557509452, 0.790835304, -0.252512839), (0.776470359, -0.389118434, 0.495661806)),
    Pose("irb2400", FIRST, (0.910040916, 0.688312211, 1.432843852),
         (0.173175987, -0.584997820, -0.792330504), (0.284001482, 0.799974118, -0.528568414)),
    Pose("irb2400", SECOND, (-0.071281226, -0.410252107, 1.420176548),
         (0.378636625, 0.299387076, -0.875786324), (0.637806099, -0.770095667, 0.012491698)),
    Pose("kr16_2", FIRST, (1.330524717, -1.026619471, 0.382440026),
         (0.173175987, 0.584997820, -0.792330504), (0.284001482, -0.799974118, -0.528568414)),
    Pose("kr16_2", SECOND, (-0.394064493, 1.481230952, 1.195945271),
         (0.378636625, -0.299387076, -0.875786324), (0.637806099, 0.770095667, 0.012491698)),
    Pose("m10ia", FIRST, (0.820503619, 0.634634233, 0.698731370),
         (0.627488821, -0.266884550, 0.731457734), (0.429794222, 0.902059294, -0.039572185)),
    Pose("m10ia", SECOND, (0.147664803, 0.153460360, 1.629000140),
         (0.557509198, 0.790835431, -0.252513001), (0.776470557, -0.389118200, 0.495661679)),
]
# fmt: on

# The flange frame of these URDFs is the DH flange turned by 180 degrees about its own z; the others coincide.
HALF_TURNED = {"er20_1780_a6", "irb2400", "kr16_2"}

# reach_m is a published figure; the definition that fits them is the largest distance of the wrist centre from the
# first axis within the limits of J2 and J3. Two figures are coarser: the ER16's leaves out the forearm offset a3 (see
# below), the ER20-1780's is rounded to 10 mm.
REACH_TOLERANCE_M = {"er16_1600": 0.0115, "er20_1780_a6": 0.003}


def flange_pose(robot: Robot, joints_deg: tuple[float, ...]) -> np.ndarray:
    """Multiply out the standard DH rows at controller angles; returns shape (4, 4)."""
    T_b_f = np.eye(4)
    for joint, angle in zip(robot.joints, joints_deg, strict=True):
        t, al = np.radians(joint.sign * angle + joint.offset_deg), np.radians(joint.alpha_deg)
        c, s, ca, sa = np.cos(t), np.sin(t), np.cos(al), np.sin(al)
        a, d = joint.a_m, joint.d_m
        row = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        T_b_f = T_b_f @ np.array(row)
    return T_b_f


def largest_wrist_radius_m(robot: Robot) -> float:
    """Search J2 and J3 within their limits, in quarter degrees, for the wrist centre farthest from axis 1 [m]."""
    (a1, a2, a3), d4 = [joint.a_m for joint in robot.joints[:3]], robot.joints[3].d_m
    q2, q3 = (np.linspace(low, high, int(np.degrees(high - low) * 4) + 1) for low, high in robot.limits_rad[1:3])
    t2 = q2[:, None] + np.radians(robot.joints[1].offset_deg)
    t23 = t2 + q3[None, :] + np.radians(robot.joints[2].offset_deg)
    return float(np.max(a1 + a2 * np.cos(t2) + a3 * np.cos(t23) - d4 * np.sin(t23)))


@pytest.mark.parametrize("name", ROBOTS)
def test_flange_at_controller_zero_is_where_the_source_has_it(name: str) -> None:
    robot = load_robot(name)
    assert flange_pose(robot, (0.0,) * 6)[:3, 3] == pytest.approx(robot.zero_flange_m, abs=1e-6)


@pytest.mark.parametrize("pose", POSES, ids=lambda p: f"{p.robot}-{p.joints_deg[0]:g}")
def test_flange_pose_is_the_source_chains(pose: Pose) -> None:
    T_b_f = flange_pose(load_robot(pose.robot), pose.joints_deg)
    turn = -1.0 if pose.robot in HALF_TURNED else 1.0
    assert T_b_f[:3, 3] == pytest.approx(pose.position_m, abs=1e-6)
    assert turn * T_b_f[:3, 0] == pytest.approx(pose.x_axis, abs=1e-6)
    assert T_b_f[:3, 2] == pytest.approx(pose.z_axis, abs=1e-6)


@pytest.mark.parametrize("pose", POSES, ids=lambda p: f"{p.robot}-{p.joints_deg[0]:g}")
def test_source_poses_move_every_joint_within_limits(pose: Pose) -> None:
    robot = load_robot(pose.robot)
    signs = np.array([joint.sign for joint in robot.joints])
    q = np.radians(signs * np.array(pose.joints_deg))
    assert np.all(q != 0.0)
    assert np.all((robot.limits_rad[:, 0] <= q) & (q <= robot.limits_rad[:, 1]))


@pytest.mark.parametrize("name", ROBOTS)
def test_every_library_robot_is_held_against_two_source_poses(name: str) -> None:
    assert sum(pose.robot == name for pose in POSES) >= 2


@pytest.mark.parametrize("name", ROBOTS)
def test_reach_is_the_largest_wrist_radius(name: str) -> None:
    robot = load_robot(name)
    assert largest_wrist_radius_m(robot) == pytest.approx(robot.reach_m, abs=REACH_TOLERANCE_M.get(name, 0.001))


def test_er16_reach_leaves_out_the_forearm_offset() -> None:
    robot = load_robot("er16_1600")
    a1, a2, d4 = robot.joints[0].a_m, robot.joints[1].a_m, robot.joints[3].d_m
    assert a1 + a2 + d4 == pytest.approx(robot.reach_m, abs=1e-9)
    assert largest_wrist_radius_m(robot) == pytest.approx(1.6012, abs=1e-4)


def test_irb2400_stretches_no_farther_than_its_elbow_limit_lets_it() -> None:
    robot = load_robot("irb2400")
    a1, a2, a3, d4 = *(joint.a_m for joint in robot.joints[:3]), robot.joints[3].d_m
    assert a1 + a2 + np.hypot(a3, d4) > robot.reach_m + 0.02


@pytest.mark.parametrize("name", ROBOTS)
def test_arm_has_parallel_elbow_and_spherical_wrist(name: str) -> None:
    robot = load_robot(name)
    a, d, alpha, _ = robot.dh.T
    assert np.all(a[3:] == 0.0)
    assert np.all(d[[1, 2, 4]] == 0.0)
    assert np.degrees(alpha) == pytest.approx([-90, 0, -90, 90, -90, 0], abs=1e-12)
    assert np.all(a[:2] > 0.0)
    assert np.all(d[[0, 3, 5]] > 0.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_limits_are_ordered_about_zero_after_sign_mapping(name: str) -> None:
    robot = load_robot(name)
    for joint, (low, high) in zip(robot.joints, np.degrees(robot.limits_rad), strict=True):
        assert low < 0.0 < high
        ends = (joint.lower_deg, joint.upper_deg) if joint.sign == 1 else (-joint.upper_deg, -joint.lower_deg)
        assert (low, high) == pytest.approx(ends, abs=1e-9)


# Worked out by hand from the URDFs' axes: controller limits, mirrored where the axis opposes the DH axis.
LOPSIDED = [
    ("er20_1780_a6", 2, (-95.0, 160.0)),
    ("er20_1780_a6", 3, (-170.0, 80.0)),
    ("gp25", 3, (-160.0, 86.0)),
    ("gp25", 5, (-150.0, 155.0)),
    ("irb2400", 3, (-60.0, 65.0)),
    ("kr16_2", 2, (-155.0, 35.0)),
    ("kr16_2", 3, (-130.0, 154.0)),
    ("m10ia", 2, (-90.0, 160.0)),
    ("m10ia", 3, (-264.0, 180.0)),
]


@pytest.mark.parametrize(("name", "number", "expected_deg"), LOPSIDED)
def test_lopsided_limits_fall_on_the_right_side(name: str, number: int, expected_deg: tuple[float, float]) -> None:
    assert np.degrees(load_robot(name).limits_rad[number - 1]) == pytest.approx(expected_deg, abs=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_speeds_are_stated_for_all_joints_and_accelerations_where_a_maker_does(name: str) -> None:
    drives = load_robot(name).drives
    assert drives is not None
    assert len(drives.speed_deg_s) == 6
    assert (drives.acceleration_deg_s2 is not None) == (name in ("er16_1600", "er20_1780_a6"))


def holds_number_at_any_depth(value: Any) -> bool:
    """Tell whether a number hides anywhere in nested tables and lists."""
    if isinstance(value, dict):
        return any(holds_number_at_any_depth(item) for item in value.values())
    if isinstance(value, list | tuple):
        return any(holds_number_at_any_depth(item) for item in value)
    return holds_number(value)


def unsourced(table: Sourced, own_tables: tuple[str, ...] = ()) -> list[str]:
    """Name the fields that hold numbers without a source; tables in ``own_tables`` carry their own."""
    data = table.model_dump(exclude={"source", *own_tables})
    return [key for key, value in data.items() if holds_number_at_any_depth(value) and not table.source_of(key).strip()]


@pytest.mark.parametrize("name", ROBOTS)
def test_every_number_has_a_source(name: str) -> None:
    robot = load_robot(name)
    assert unsourced(robot, own_tables=("bodies", "drives")) == []
    assert unsourced(robot.drives) == []
    assert [unsourced(body) for body in robot.bodies] == [[]] * len(robot.bodies)


@pytest.mark.parametrize("name", [name for name in ROBOTS if name != "er16_1600"])
def test_joint_source_names_repository_file_and_commit(name: str) -> None:
    source = load_robot(name).source_of("joints")
    assert "urdf/" in source
    assert ".xacro" in source
    assert "(commit " in source


@pytest.mark.parametrize("name", ROBOTS)
def test_bodies_cover_the_arm_from_base_to_flange_and_say_they_are_chosen(name: str) -> None:
    robot = load_robot(name)
    assert [body.name for body in robot.bodies] == ["base_column", "upper_arm", "forearm", "wrist"]
    spans = [(body.start.frame, body.end.frame) for body in robot.bodies]
    assert spans == [("link0", "link0"), ("link1", "link2"), ("link2", "link4"), ("link4", "link6")]
    assert robot.bodies[0].end.at_m[2] == pytest.approx(robot.joints[0].d_m - 0.1, abs=1e-9)
    assert all(body.source_of("radius_m").startswith("chosen") for body in robot.bodies)


def test_every_built_in_robot_loads_under_its_file_name() -> None:
    assert len(ROBOTS) >= 6
    assert [load_robot(name).name for name in ROBOTS] == ROBOTS


def test_every_built_in_cell_loads() -> None:
    cells = library_names("cells")
    assert "three_er16" in cells
    assert [load_cell(name).name for name in cells] == cells
