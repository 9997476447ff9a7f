"""Every way to spoil a plan with a positioner is caught and named."""

import dataclasses
import math

import numpy as np
import pytest

from nlpweld.cell import Positioner
from nlpweld.plan import Plan
from nlpweld.verify import between, rules
from nlpweld.verify.check import verify
from nlpweld.verify.scene import look

from .helpers import cell_with, changed, found, only, station_with, with_path
from .welders import PLACES, plan, rot

WELDERS = {"robot_1", "robot_2"}


@pytest.mark.parametrize("joint", [0, 1])
def test_positioner_joint_off_at_one_point(dual_plan: Plan, joint):
    path = dual_plan.paths["positioner"].copy()
    path[17, joint] += 1e-3
    report = verify(with_path(dual_plan, "positioner", path))
    assert {v.constraint for v in report.violations} == {"posture", "closure"}
    (posture,) = found(report, "posture")
    assert (posture.robot, posture.point, posture.unit) == ("positioner", 17, "rad")
    assert posture.value == pytest.approx(1e-3)
    assert posture.s == pytest.approx(17 / 71)
    assert report.posture_rad == posture.value
    assert {(v.robot, v.point) for v in found(report, "closure")} == {(name, 17) for name in WELDERS}
    assert 1e-4 < report.closure_m < 1.5e-3


def test_robots_that_follow_a_positioner_that_is_off_close_all_the_same(dual):
    """The loops close on where the positioner is, not on where it should be."""
    report = verify(plan(dual, PLACES["A"], off=1e-3))
    (posture,) = only(report, "posture")
    assert posture.value == pytest.approx(1e-3)
    assert report.closure_m < 1e-9


def test_last_point_of_an_open_seam_is_not_the_first(dual_plan: Plan):
    path = dual_plan.paths["positioner"].copy()
    path[-1, 0] += 1e-3
    (posture,) = found(verify(with_path(dual_plan, "positioner", path)), "posture")
    assert (posture.point, posture.s) == (71, 1.0)


@pytest.mark.parametrize("index", [0, 1])
def test_torch_seam_swapped(dual_plan: Plan, index):
    cell = station_with(dual_plan.cell, index, seam=("second", "main")[index])
    report = verify(changed(dual_plan, cell=cell))
    assert {v.robot for v in found(report, "closure")} == {f"robot_{index + 1}"}
    assert report.closure_m == pytest.approx(1.0, abs=0.01)
    assert not found(report, "posture")


@pytest.mark.parametrize("angle", ["travel_deg", "work_deg", "spin_deg"])
def test_torch_held_otherwise(dual_plan: Plan, angle):
    angles = dual_plan.cell.stations[1].coupling.angles
    other = angles.model_copy(update={angle: getattr(angles, angle) + 0.1})
    violations = only(verify(changed(dual_plan, cell=station_with(dual_plan.cell, 1, angles=other))), "closure")
    assert {v.robot for v in violations} == {"robot_2"}
    assert {v.unit: v.value for v in violations}["rad"] == pytest.approx(np.radians(0.1), rel=0.01)


def test_stand_off(dual_plan: Plan):
    angles = dual_plan.cell.stations[0].coupling.angles.model_copy(update={"stand_off_m": 0.004})
    (violation,) = only(verify(changed(dual_plan, cell=station_with(dual_plan.cell, 0, angles=angles))), "closure")
    assert (violation.robot, violation.unit) == ("robot_1", "m")
    assert violation.value == pytest.approx(1e-3)


def test_positioner_a_turn_out_of_its_limits(dual_plan: Plan):
    path = dual_plan.paths["positioner"] + [0, 2 * np.pi]
    (violation,) = only(verify(with_path(dual_plan, "positioner", path)), "joint_limit")
    assert (violation.robot, violation.joint, violation.point) == ("positioner", "J2", 0)
    assert (violation.value, violation.limit) == pytest.approx((np.radians(450), np.radians(360)))


def test_positioner_out_of_its_limits_only_on_the_way_to_the_start(single_plan: Plan):
    """The table turns from 180 to -175 deg at the last point and on to -180."""
    joints = list(single_plan.cell.positioner.robot.joints)
    joints[1] = joints[1].model_copy(update={"lower_deg": -178.0})
    robot = single_plan.cell.positioner.robot.model_copy(update={"joints": tuple(joints)})
    report = verify(changed(single_plan, cell=cell_with(single_plan.cell, positioner={"robot": robot})))
    (violation,) = only(report, "joint_limit")
    assert (violation.robot, violation.joint, violation.point) == ("positioner", "J2", 71)
    assert (violation.value, violation.s) == pytest.approx((-np.pi, 0.0))


@pytest.mark.parametrize("name", ["dual_plan", "plan"])
def test_wrong_yaw(request, name):
    good = request.getfixturevalue(name)
    report = verify(changed(good, yaw_rad=1e-3))
    assert {v.constraint for v in report.violations} == {"box", "closure"}
    (box,) = found(report, "box")
    assert (box.joint, box.unit, box.value, box.limit) == ("yaw", "rad", 1e-3, 0)
    assert {v.robot for v in found(report, "closure")} == {st.name for st in good.cell.stations}


def test_held_coordinate_is_held_to_a_nanometre(dual_plan: Plan):
    up = np.array([0, 0, 1.0])
    assert verify(changed(dual_plan, placement_m=dual_plan.placement_m + 5e-10 * up)).feasible
    (box,) = only(verify(changed(dual_plan, placement_m=dual_plan.placement_m - 2e-9 * up)), "box")
    assert (box.joint, box.limit) == ("z", 0.5)


def test_placement_outside_the_box(dual_plan: Plan):
    cell = cell_with(dual_plan.cell, search={"lower_m": (-0.4, -1.8, 0.5)})
    (box,) = only(verify(changed(dual_plan, cell=cell)), "box")
    assert (box.joint, box.unit, box.limit) == ("x", "m", -0.4)


def test_posture_asked_for_is_another(dual_plan: Plan):
    report = verify(changed(dual_plan, cell=cell_with(dual_plan.cell, posture={"turn_deg": 0.0})))
    (posture,) = found(report, "posture")
    assert posture.value == pytest.approx(np.radians(45))


def test_half_the_positioner_path_a_turn_on(single_plan: Plan):
    path = single_plan.paths["positioner"].copy()
    path[36:, 1] += 2 * np.pi
    report = verify(with_path(single_plan, "positioner", path))
    assert ("positioner", "J2") in {(v.robot, v.joint) for v in found(report, "continuity")}
    assert {v.point for v in found(report, "continuity")} <= {35, 71}
    assert report.closure_m < 1e-9


def test_table_on_an_upright_axis_lifts_no_weld(single_plan: Plan):
    cell = one_axis(single_plan.cell, 0.0, tilt_deg=-180.0)
    alone = with_path(changed(single_plan, cell=cell), "positioner", single_plan.paths["positioner"][:, 1:])
    (posture,) = found(verify(alone), "posture")
    assert posture.value == pytest.approx(np.radians(45), abs=1e-6)


def test_weld_that_is_held_upright_at_the_points_alone(dual_plan: Plan):
    """A place between points 35 and 36 is charged to the positioner, and is no open loop of a robot."""
    motion = between.whole_motion(dual_plan.cell, dual_plan.placement, dual_plan.s, dual_plan.paths)
    gap = between.Unclosed("positioner", 0.5, 0.0, 0.02)
    scene = look(dual_plan.cell, dual_plan.placement, dataclasses.replace(motion, unclosed=[gap]))
    (posture,) = rules.violations(dual_plan, scene)
    assert (posture.constraint, posture.robot, posture.point, posture.s) == ("posture", "positioner", 35, 0.5)
    assert (posture.value, posture.limit) == (0.02, 1e-6)


def one_axis(cell, off_deg: float, tilt_deg: float = -135.0):
    """Return a copy of the single cell whose positioner is the table alone, on an axis that leans by an angle."""
    R = rot("XZX", np.radians(-90), np.radians(tilt_deg + off_deg), np.radians(-90))
    yaw, pitch, roll = np.degrees(angles_zyx(R))
    old: Positioner = cell.positioner
    robot = old.robot.model_copy(update={"joints": old.robot.joints[1:], "bodies": ()})
    fields = {"robot": robot, "base_rpy_deg": (roll, pitch, yaw), "may_touch": ()}
    return cell.model_copy(update={"positioner": old.model_copy(update=fields)})


def angles_zyx(R: np.ndarray) -> tuple[float, float, float]:
    yaw, pitch = math.atan2(R[1, 0], R[0, 0]), math.asin(max(-1.0, min(1.0, -R[2, 0])))
    return yaw, pitch, math.atan2(R[2, 1], R[2, 2])


@pytest.mark.parametrize(("off_deg", "fine"), [(0.0, True), (3.0, True), (4.99, True), (5.01, False), (8.0, False)])
def test_one_axis_may_be_off_by_what_iso_6947_allows(single_plan: Plan, off_deg, fine):
    cell = one_axis(single_plan.cell, off_deg)
    alone = with_path(changed(single_plan, cell=cell), "positioner", single_plan.paths["positioner"][:, 1:])
    report = verify(alone)
    assert report.posture_rad == pytest.approx(np.radians(off_deg), abs=1e-9)
    if off_deg == 0:
        assert report.feasible, str(report)
        return
    assert found(report, "closure")  # the robot follows the leaning table nowhere
    assert fine == (not found(report, "posture"))


def test_clearance_of_the_positioner(dual_plan: Plan):
    """Next after the torch and the trough: the rim and the pedestal, 0.1100 m apart."""
    report = verify(changed(dual_plan, cell=cell_with(dual_plan.cell, constraints={"clearance_m": 0.111})))
    pairs = {v.pair: v for v in only(report, "clearance")}
    rims = [v for pair, v in pairs.items() if pair.startswith("workpiece.near_rim") and "positioner.pedestal" in pair]
    assert min(v.value for v in rims) == pytest.approx(0.1100, abs=5e-5)
    assert {v.robot for v in rims} == {"workpiece"}


def test_hub_near_the_floor_and_the_pedestal_on_it(dual_plan: Plan):
    down = changed(dual_plan, placement_m=dual_plan.placement_m - [0, 0, 0.6])
    pairs = {v.pair for v in found(verify(down), "clearance")}
    assert {"positioner.hub - floor", "workpiece.leg_a - floor"} <= pairs
    assert "positioner.pedestal - floor" not in pairs


def test_number_that_is_none(dual_plan: Plan):
    path = dual_plan.paths["positioner"].copy()
    path[3, 1] = math.nan
    (violation,) = only(verify(with_path(dual_plan, "positioner", path)), "finite")
    assert (violation.robot, violation.point, violation.joint) == ("positioner", 3, "J2")
    assert only(verify(changed(dual_plan, yaw_rad=math.inf)), "finite")
