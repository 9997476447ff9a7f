"""Every single way to spoil a good plan, or to ask more of it than it gives, is caught and named."""

import math

import numpy as np
import pytest

from nlpweld.plan import Plan
from nlpweld.verify.check import verify
from nlpweld.verify.report import Report

from .helpers import BRANCH, ROBOTS, cell_with, changed, found, only, with_limits, with_path


@pytest.mark.parametrize(
    ("robot", "joint"), [("handler_1", 0), ("handler_1", 5), ("handler_2", 3), ("welder", 1), ("welder", 4)]
)
def test_one_joint_off_at_one_point(plan: Plan, robot, joint):
    path = plan.paths[robot].copy()
    path[17, joint] += 1e-3
    violations = only(verify(with_path(plan, robot, path)), "closure")
    assert {(v.robot, v.point) for v in violations} == {(robot, 17)}


@pytest.mark.parametrize(
    ("robot", "joint", "turns"), [("handler_1", 3, 1), ("handler_2", 0, -1), ("welder", 5, -1), ("welder", 4, 1)]
)
def test_path_shifted_by_a_turn_beyond_its_limits(plan: Plan, robot, joint, turns):
    path = plan.paths[robot].copy()
    path[:, joint] += turns * 2 * np.pi
    (violation,) = only(verify(with_path(plan, robot, path)), "joint_limit")
    assert (violation.robot, violation.joint) == (robot, f"J{joint + 1}")
    assert violation.limit == pytest.approx(np.radians([180, 140, 80, 360, 130, 360][joint]) * turns)


def test_path_that_leaves_its_limits_only_on_the_way_back_to_the_start(plan: Plan, report: Report):
    """J4 of handler_1 turns once, 358.76 to -1.24 deg; shifted, its points are inside and the seam's end is not."""
    path = plan.paths["handler_1"].copy()
    path[:, 3] -= 2 * np.pi
    assert path[:, 3].min() > -2 * np.pi
    (violation,) = only(verify(with_path(plan, "handler_1", path)), "joint_limit")
    assert (violation.robot, violation.joint, violation.point) == ("handler_1", "J4", 71)


@pytest.mark.parametrize("robot", ROBOTS)
def test_wrist_flipped_over_half_the_seam(plan: Plan, robot):
    path = plan.paths[robot].copy()
    path[36:] += [0, 0, 0, np.pi, 0, np.pi]
    path[36:, 4] *= -1
    report = verify(with_path(plan, robot, path))
    assert report.closure_m < 1e-9
    assert report.clearance_along_m == pytest.approx(0.0242114, abs=1e-3)
    assert {v.robot for v in found(report, "continuity")} == {robot}
    assert {v.point for v in found(report, "continuity")} <= {35, 71}
    assert {(v.robot, v.joint) for v in found(report, "branch")} == {(robot, "J5")}


@pytest.mark.parametrize(("joint", "singular_deg"), [(2, -80.2), (4, 0.0)])
def test_path_that_passes_smoothly_through_a_singularity_and_back(plan: Plan, joint, singular_deg):
    path = plan.paths["welder"].copy()
    beyond = 2 * np.radians(singular_deg) - path[:, joint]  # the other side, as far off
    path[:, joint] += (beyond - path[:, joint]) * np.sin(np.linspace(0, np.pi, len(path))) ** 2
    assert np.abs(np.diff(path[:, joint])).max() < 0.15
    report = verify(with_path(plan, "welder", path))
    assert ("welder", f"J{joint + 1}") in {(v.robot, v.joint) for v in found(report, "branch")}
    assert {v.robot for v in found(report, "singularity")} == {"welder"}


@pytest.mark.parametrize(
    ("feature", "label", "joint"), [(0, "back", "J1"), (1, "down", "J3"), (2, "flip", "J5"), (2, "up", "J5")]
)
def test_branch_label_wrong(plan: Plan, feature, label, joint):
    wrong = list(BRANCH["handler_2"])
    wrong[feature] = label
    (violation,) = only(verify(changed(plan, branches={**BRANCH, "handler_2": tuple(wrong)})), "branch")
    assert (violation.robot, violation.joint) == ("handler_2", joint)
    assert "the plan says" in violation.note


@pytest.mark.parametrize(
    ("asked", "joint"), [({"shoulder": "back"}, "J1"), ({"elbow": "down"}, "J3"), ({"wrist": "flip"}, "J5")]
)
def test_branch_the_cell_forbids(plan: Plan, asked, joint):
    violations = only(verify(changed(plan, cell=cell_with(plan.cell, configuration=asked))), "branch")
    assert {(v.robot, v.joint) for v in violations} == {(r, joint) for r in ROBOTS}


def test_placement_moved(plan: Plan):
    report = verify(changed(plan, placement_m=plan.placement_m + np.array([1e-3, 0, 0])))
    at_points = [v for v in found(report, "closure") if v.unit == "m"]
    assert {v.robot for v in at_points} == set(ROBOTS)
    assert [v.value for v in at_points] == pytest.approx([1e-3] * 3)
    assert not found(report, "box")


def test_two_points_swapped(plan: Plan):
    path = plan.paths["welder"].copy()
    path[[20, 40]] = path[[40, 20]]
    report = verify(with_path(plan, "welder", path))
    assert {v.robot for v in found(report, "closure")} == {"welder"}
    assert {v.point for v in found(report, "closure")} <= {20, 40}
    assert {v.robot for v in found(report, "continuity")} == {"welder"}


def test_path_of_another_robot(plan: Plan):
    report = verify(with_path(plan, "handler_1", plan.paths["handler_2"]))
    assert {v.robot for v in found(report, "closure")} == {"handler_1"}
    assert report.closure_m > 0.5


@pytest.mark.parametrize(
    ("search", "axis"), [({"upper_m": (0.02, 0.6, 1.2)}, "x"), ({"lower_m": (-0.6, -1.0, 0.41)}, "z")]
)
def test_placement_outside_the_box(plan: Plan, search, axis):
    (violation,) = only(verify(changed(plan, cell=cell_with(plan.cell, search=search))), "box")
    assert violation.joint == axis
    assert violation.value == {"x": 0.023, "z": 0.404}[axis]


def test_singularity_floor_raised(plan: Plan):
    cell = cell_with(plan.cell, constraints={"singularity_floor_m3": 0.13})
    (violation,) = only(verify(changed(plan, cell=cell)), "singularity")
    assert (violation.robot, violation.limit) == ("handler_1", 0.13)
    assert violation.value == pytest.approx(0.123318, abs=1e-6)


def test_floor_between_the_least_at_points_and_the_least_on_the_way(plan: Plan):
    """All 72 points hold; the motion between two of them does not."""
    cell = cell_with(plan.cell, constraints={"singularity_floor_m3": 0.12335})
    (violation,) = only(verify(changed(plan, cell=cell)), "singularity")
    assert violation.robot == "handler_1"
    assert abs(violation.s * 72 - round(violation.s * 72)) > 0.1


def test_clearance_raised(plan: Plan):
    cell = cell_with(plan.cell, constraints={"clearance_m": 0.025})
    violations = only(verify(changed(plan, cell=cell)), "clearance")
    assert {v.pair for v in violations} == {f"handler_{k}.forearm - welder.torch_body" for k in (1, 2)}
    assert {v.robot for v in violations} == {"handler_1", "handler_2"}


def test_clearance_between_the_least_at_points_and_the_least_on_the_way(plan: Plan, report: Report):
    assert report.profile["clearance_m"].min() > 0.0244
    cell = cell_with(plan.cell, constraints={"clearance_m": 0.0243})
    violations = only(verify(changed(plan, cell=cell)), "clearance")
    assert {v.point for v in violations} == {71, 36}


def test_penetration_is_measured_in_depth(plan: Plan):
    robot = plan.cell.stations[2].robot
    fat = tuple(b.model_copy(update={"radius_m": b.radius_m + 0.2}) if b.name == "wrist" else b for b in robot.bodies)
    welder = plan.cell.stations[2].model_copy(update={"robot": robot.model_copy(update={"bodies": fat})})
    cell = plan.cell.model_copy(update={"stations": (*plan.cell.stations[:2], welder)})
    pairs = {v.pair: v.value for v in only(verify(changed(plan, cell=cell)), "clearance")}
    assert pairs["handler_2.forearm - welder.wrist"] == pytest.approx(0.0461686 - 0.2, abs=1e-6)


def test_everything_stands_on_the_floor(plan: Plan):
    """The whole cell, let down by a quarter of a metre, reaches through the floor; its base columns may."""
    stations = []
    for station in plan.cell.stations:
        x, y, z = station.base_position_m
        stations.append(station.model_copy(update={"base_position_m": (x, y, z - 0.25)}))
    cell = plan.cell.model_copy(update={"stations": tuple(stations)})
    low = changed(plan, cell=cell, placement_m=plan.placement_m - np.array([0, 0, 0.25]))
    violations = found(verify(low), "clearance")
    assert violations
    assert all(v.pair.endswith(" - floor") for v in violations)
    assert {"workpiece.main_pipe - floor"} <= {v.pair for v in violations}
    assert not [v for v in violations if "base_column" in v.pair]


def test_narrower_joint_limits(plan: Plan):
    cell = with_limits(plan.cell, "handler_1", 4, upper_deg=95.0)
    (violation,) = only(verify(changed(plan, cell=cell)), "joint_limit")
    assert (violation.robot, violation.joint) == ("handler_1", "J5")
    assert violation.limit == pytest.approx(np.radians(95))
    assert violation.value > np.radians(97.5)


def test_limits_of_a_joint_that_counts_backwards(plan: Plan):
    """J1's controller counts the other way: its lower limit bounds the DH angle (125 to 143 deg) from above."""
    cell = with_limits(plan.cell, "handler_1", 0, lower_deg=-140.0)
    (violation,) = only(verify(changed(plan, cell=cell)), "joint_limit")
    assert (violation.robot, violation.joint) == ("handler_1", "J1")
    assert violation.limit == pytest.approx(np.radians(140))


def test_dip_between_the_points_of_a_coarse_plan(coarse: Plan):
    got = verify(coarse)
    least, dip = got.manipulability_min["handler_1"], got.singularity_min["handler_1"]
    assert dip < least - 0.001
    cell = cell_with(coarse.cell, constraints={"singularity_floor_m3": (least + dip) / 2})
    violations = {v.robot: v for v in only(verify(changed(coarse, cell=cell)), "singularity")}
    assert violations["handler_1"].value == pytest.approx(dip)


def test_fewer_points_than_the_cell_has(plan: Plan, coarse: Plan):
    (violation,) = only(verify(changed(coarse, cell=plan.cell)), "points")
    assert (violation.value, violation.limit) == (6, 72)


def test_points_moved_along_the_seam_to_where_it_is_easy(coarse: Plan):
    s = coarse.s.copy()
    s[2] += 0.01
    assert found(verify(changed(coarse, s=s)), "points")[0].point == 2


@pytest.mark.parametrize("value", [math.nan, -math.inf, 1e200])
def test_number_that_is_none(plan: Plan, value):
    path = plan.paths["welder"].copy()
    path[3, 2] = value
    report = verify(with_path(plan, "welder", path))
    (violation,) = only(report, "finite")
    assert (violation.robot, violation.point, violation.joint) == ("welder", 3, "J3")
    assert math.isnan(report.mmr_mean)
    assert only(verify(changed(plan, placement_m=np.array([0, value, 0]))), "finite")


def test_absurd_placement_is_an_answer_and_not_an_accident(plan: Plan):
    report = verify(changed(plan, placement_m=np.array([1e6, 0.0, 0.0])))
    assert found(report, "box")
    assert found(report, "closure")
