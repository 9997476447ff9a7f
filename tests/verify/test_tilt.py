"""Plans that tilt the weld on a positioner: what its joints do counts, whatever the plan says of it."""

import math

import numpy as np
import pytest

from nlpweld.cell import Cell, load_positioner
from nlpweld.errors import PlanError
from nlpweld.plan import Plan
from nlpweld.verify import between
from nlpweld.verify.check import verify
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.scene import look

from .helpers import cell_with, changed, found, only, with_path
from .welders import PLACES
from .welders import plan as plan_of_welders

POINT = 20


def tilts(s: np.ndarray, size: float = 1.0) -> dict[str, np.ndarray]:
    """Return slopes and rotations within the bands, up to 0.06 and 0.12 rad; slope has its greatest near point 20."""
    way = 2 * np.pi * s
    return {"slope": size * 0.06 * np.sin(way), "rotation": size * -0.12 * np.sin(way) * np.cos(way) * 2}


@pytest.fixture(scope="module")
def tilted_single(single: Cell) -> Plan:
    return plan_of_welders(single, (0.0, -1.0), freedom=tilts(np.arange(72) / 72))


@pytest.fixture(scope="module")
def tilted_dual(dual: Cell) -> Plan:
    s = np.linspace(0, 1, 72)
    return plan_of_welders(dual, PLACES["C"], freedom={**tilts(s), "spin.robot_1": 0.3 * np.sin(s)})


def told(plan: Plan, name: str, point: int, value: float) -> Plan:
    """Return a plan that says something else of one angle at one point."""
    angle = plan.freedom[name].copy()
    angle[point] = value
    return plan.with_freedom({**plan.freedom, name: angle})


def follower(plan: Plan, name: str, point: int, value: float, place: tuple[float, float] = (0.0, -1.0)) -> Plan:
    """Return a plan whose positioner, and robots with it, really have another angle at one point."""
    return plan_of_welders(plan.cell, place, freedom=told(plan, name, point, value).freedom)


@pytest.mark.parametrize("name", ["tilted_single", "tilted_dual"])
def test_tilted_plan_is_accepted_and_its_tilt_read_off_the_joints(request, name):
    plan = request.getfixturevalue(name)
    report = verify(plan)
    assert report.feasible, str(report)
    assert max(report.posture_rad, report.closure_m, report.closure_rad) < 1e-9
    free = Offsets(plan.s, plan.cell.seam.closed, plan.freedom)
    motion = between.whole_motion(plan.cell, plan.placement, plan.s, plan.paths, free)
    assert len(motion.s) > 2 * len(plan.s)
    seen = look(plan.cell, plan.placement, motion).tilt
    for angle in ("slope", "rotation"):
        np.testing.assert_allclose(seen[angle], free.at(motion.s)[angle], atol=1e-9)
        np.testing.assert_allclose(seen[angle][motion.at], plan.freedom[angle], atol=1e-12)


def test_tilt_that_is_not_told(tilted_single: Plan):
    report = verify(tilted_single.with_freedom({}))
    assert {v.constraint for v in report.violations} == {
        "posture",
        "continuity",
    }  # between the points it is held upright
    (violation,) = found(report, "posture")
    assert violation.robot == "positioner"
    slope, rotation = (tilted_single.freedom[name][violation.point] for name in ("slope", "rotation"))
    assert violation.value == pytest.approx(np.arccos(np.cos(slope) * np.cos(rotation)))


@pytest.mark.parametrize("angle", ["slope", "rotation"])
def test_lie_about_the_joints_is_named_with_its_point(tilted_single: Plan, angle):
    """The robots follow the table where it is, so that all else is as it should be."""
    lie = told(tilted_single, angle, POINT, tilted_single.freedom[angle][POINT] - 2e-6)
    (violation,) = only(verify(lie), "posture")
    assert (violation.robot, violation.point, violation.unit) == ("positioner", POINT, "rad")
    assert violation.value == pytest.approx(2e-6, rel=0.01)
    assert f"posture positioner at point {POINT}" in str(violation)


@pytest.mark.parametrize(("angle", "band"), [("slope", 5.0), ("rotation", 10.0)])
def test_tilt_outside_its_band_is_named_by_plan_and_joints(tilted_single: Plan, angle, band):
    report = verify(follower(tilted_single, angle, POINT, np.radians(band + 0.5)))
    violations = only(report, "freedom")
    assert {v.robot for v in violations} == {"workpiece", "positioner"}
    for violation in violations:
        assert (violation.joint, violation.point) == (angle, POINT)
        assert math.degrees(violation.value) == pytest.approx(band + 0.5)
        assert math.degrees(violation.limit) == pytest.approx(band)
    assert f"freedom positioner {angle} at point {POINT}" in str(report)


@pytest.mark.parametrize(("angle", "band"), [("slope", 5.0), ("rotation", 10.0)])
def test_tilt_outside_its_band_that_the_plan_hides(tilted_single: Plan, angle, band):
    """The plan says it is at the edge of the band; joints say it is beyond."""
    beyond = follower(tilted_single, angle, POINT, np.radians(band + 0.1))
    report = verify(told(beyond, angle, POINT, np.radians(band)))
    assert {v.constraint for v in report.violations} == {"posture", "freedom"}
    for constraint in ("posture", "freedom"):
        (violation,) = found(report, constraint)
        assert (violation.robot, violation.point) == ("positioner", POINT)
    assert math.degrees(violation.value) == pytest.approx(band + 0.1)


def test_joints_of_the_positioner_that_are_off_are_no_tilt(tilted_dual: Plan):
    path = tilted_dual.paths["positioner"].copy()
    path[POINT, 0] += 1e-3
    report = verify(with_path(tilted_dual, "positioner", path))
    assert {v.constraint for v in report.violations} == {"posture", "closure"}
    (posture,) = found(report, "posture")
    assert (posture.robot, posture.point, posture.value) == ("positioner", POINT, pytest.approx(1e-3))
    assert {(v.robot, v.point) for v in found(report, "closure")} == {("robot_1", POINT), ("robot_2", POINT)}


def test_steps_of_the_table_count_where_it_tilts(tilted_single: Plan, single_plan: Plan):
    steps = np.degrees(np.abs(np.diff(tilted_single.paths["positioner"][:, 1])))
    report = verify(tilted_single)
    assert math.degrees(report.joint_step_rad) >= steps.max() > 5.0
    cell = cell_with(single_plan.cell, freedom={"joint_step_deg": steps.max() - 1e-6})
    (violation,) = only(verify(changed(tilted_single, cell=cell)), "joint_step")
    assert (violation.robot, violation.joint, violation.point) == ("positioner", "J2", int(steps.argmax()))
    cell = cell_with(single_plan.cell, freedom={"joint_step_deg": 4.0})  # the table turns 5 deg, by no freedom
    assert verify(changed(single_plan, cell=cell).with_freedom({"spin.robot_1": np.zeros(72)})).feasible


def test_one_axis_has_no_slope_and_rotation_to_give(single_plan: Plan):
    held = single_plan.cell.positioner.model_copy(update={"robot": load_positioner("rotator"), "may_touch": ()})
    cell = single_plan.cell.model_copy(update={"positioner": held})
    alone = with_path(changed(single_plan, cell=cell), "positioner", single_plan.paths["positioner"][:, 1:])
    with pytest.raises(PlanError, match=r"freedom\.slope: the cell has no free angle of that name"):
        verify(alone.with_freedom(tilts(single_plan.s)))
