"""Timed plans, spoiled in every way: each is caught, and named by robot, joint and phase."""

from dataclasses import replace

import numpy as np
import pytest

from nlpweld.cell import load_cell
from nlpweld.errors import PlanError
from nlpweld.plan import Plan
from nlpweld.timeline import Timeline, Track
from nlpweld.timing import time_plan
from nlpweld.verify.timing import verify_timing
from nlpweld.verify.timing_report import Failure, TimingReport

from ..timing.conftest import LOOKS, C, at
from ..timing.helpers import with_timing
from .helpers import station_with


@pytest.fixture(scope="module")
def timed() -> Plan:
    return time_plan(at(load_cell("three_er16").with_(seam={"points": 18}, constraints=LOOKS), C), 0.05)


@pytest.fixture(scope="module")
def on_table() -> Plan:
    return time_plan(
        at(load_cell("robot_positioner").with_(seam={"points": 18}, constraints=LOOKS), (0.0, -1.0, 0.5)), 0.05
    )


def with_line(plan: Plan, **fields) -> Plan:
    return plan.timed(replace(plan.timeline, **fields))


def with_track(plan: Plan, name: str, **fields) -> Plan:
    line = plan.timeline
    return with_line(plan, tracks={**line.tracks, name: replace(line.tracks[name], **fields)})


def pushed(plan: Plan, name: str, joint: int, by: float, phase: str) -> Plan:
    """Push one joint off at the instant in the middle of a phase."""
    line = plan.timeline
    q = line.tracks[name].q.copy()
    q[np.abs(line.t_s - sum(line.span_s(phase)) / 2).argmin(), joint] += by
    return with_track(plan, name, q=q)


def of(report: TimingReport, check: str) -> list[Failure]:
    assert not report.feasible
    found = [failure for failure in report.failures if failure.check == check]
    assert found, str(report)
    return found


def only(report: TimingReport, check: str) -> list[Failure]:
    assert {failure.check for failure in report.failures} == {check}, str(report)
    return of(report, check)


def test_as_it_is_nothing_fails(timed, on_table):
    assert verify_timing(timed).failures == ()
    assert verify_timing(on_table).failures == ()


def test_run_too_fast(timed):
    line, tracks = timed.timeline, {}
    for name, track in line.tracks.items():
        tracks[name] = Track(track.q, 20 * track.rate, 400 * track.acceleration)
    phases = tuple((name, until / 20) for name, until in line.phases)
    report = verify_timing(timed.timed(Timeline(line.t_s / 20, line.s, phases, tracks)))
    for check in ("rate", "acceleration", "jerk", "speed"):
        assert of(report, check)
    rate = next(one for one in of(report, "rate") if one.robot == "handler_1" and one.joint == "J4")
    assert rate.phase == "weld"
    assert rate.limit == pytest.approx(np.radians(480))


def test_a_jerk_between_instants_alone(timed):
    line = timed.timeline
    bent = line.tracks["handler_1"].acceleration.copy()
    bent[np.abs(line.t_s - 3.0).argmin(), 2] += 2.0  # under the limit of 23.6, but not what the angles ask
    (failure,) = of(verify_timing(with_track(timed, "handler_1", acceleration=bent)), "jerk")
    assert (failure.robot, failure.joint, failure.phase) == ("handler_1", "J3", "weld")
    assert abs(failure.t_s - 3.0) < 0.1


def test_what_goes_astray_between_instants_alone(timed):
    line = timed.timeline
    (begin, end), keep = line.span_s("weld"), np.ones(len(line.t_s), dtype=bool)
    inside = np.flatnonzero((line.t_s > begin + 0.3) & (line.t_s < end - 0.3))
    keep[np.setdiff1d(inside, inside[::20])] = False
    tracks = {
        name: Track(track.q[keep], track.rate[keep], track.acceleration[keep]) for name, track in line.tracks.items()
    }
    report = verify_timing(timed.timed(Timeline(line.t_s[keep], line.s[keep], line.phases, tracks)))
    assert {failure.phase for failure in of(report, "closure")} == {"weld"}
    assert of(report, "seam")


def test_a_joint_beyond_its_limit(timed):
    (failure,) = of(verify_timing(pushed(timed, "welder", 4, 2.0, "approach")), "joint_limit")
    assert (failure.robot, failure.joint, failure.phase) == ("welder", "J5", "approach")


def test_a_handler_that_is_not_rigid_to_the_part(timed):
    failures = of(verify_timing(pushed(timed, "handler_2", 1, 1e-5, "weld")), "closure")
    assert {failure.robot for failure in failures} == {"handler_2"}
    assert {failure.phase for failure in failures} == {"weld"}


def test_a_torch_off_its_seam(timed):
    (failure,) = of(verify_timing(pushed(timed, "welder", 1, 1e-5, "weld")), "seam")
    assert failure.robot == "welder"
    assert 5e-6 < failure.value < 2e-5


def test_a_weld_of_half_the_seam(timed):
    line = timed.timeline
    shorter = tuple((name, 3.0 if name == "plunge" else until) for name, until in line.phases)
    failures = of(verify_timing(with_line(timed, phases=shorter)), "seam")
    assert any("begins elsewhere" in failure.note for failure in failures)
    assert of(verify_timing(with_line(timed, phases=shorter)), "axis")


def test_a_torch_held_otherwise(timed):
    turned = replace(timed, cell=station_with(timed.cell, 2, heading_deg=90.1))
    (failure,) = only(verify_timing(turned), "torch")
    assert failure.robot == "welder"
    assert failure.value == pytest.approx(np.radians(0.1), rel=1e-6)


def test_a_weld_out_of_position(on_table):
    posture = on_table.cell.posture.model_copy(update={"turn_deg": 0.1})
    tilted = replace(on_table, cell=on_table.cell.model_copy(update={"posture": posture}))
    (failure,) = only(verify_timing(tilted), "posture")
    assert failure.value == pytest.approx(np.radians(0.1), rel=1e-6)
    moved = replace(on_table, placement_m=on_table.placement_m + np.array([0.0, 1e-4, 0.0]))
    assert of(verify_timing(moved), "seam")


def test_a_part_that_is_elsewhere(timed):
    moved = replace(timed, placement_m=timed.placement_m + np.array([0.0, 0.0, 1e-4]))
    report = verify_timing(moved)
    assert of(report, "posture")[0].value == pytest.approx(1e-4, rel=1e-3)
    assert {failure.phase for failure in of(report, "carry")} == {"approach", "plunge", "withdraw", "retreat"}


@pytest.mark.parametrize(
    ("fields", "check"),
    [
        ({"carry_m": (0.0, 0.0, 0.1)}, "carry"),
        ({"home_deg": {"welder": (90.0, -20.0, 10.0, 0.0, 60.0, -179.0)}}, "home"),
    ],
)
def test_another_cell_s_timing(timed, fields, check):
    failures = only(verify_timing(with_timing(timed, **fields)), check)
    assert {failure.phase for failure in failures} == {"approach", "retreat"}


def test_a_torch_faster_than_asked(timed):
    slower = timed.cell.timing.torch.model_copy(update={"speed_m_s": 0.049})
    (failure,) = only(verify_timing(with_timing(timed, torch=slower)), "speed")
    assert failure.value == pytest.approx(0.05, rel=1e-4)


def test_bodies_that_come_too_near(timed):
    constraints = timed.cell.constraints.model_copy(update={"clearance_m": 0.021})
    strict = replace(timed, cell=timed.cell.model_copy(update={"constraints": constraints}))
    failures = only(verify_timing(strict), "clearance")
    assert {failure.phase for failure in failures} == {"approach", "retreat"}
    assert failures[0].pair == "handler_1.forearm - welder.torch_body"


def test_other_joints_at_the_plan_s_points(timed):
    path = timed.paths["welder"].copy()
    path[7, 2] += 0.01
    (failure,) = only(verify_timing(replace(timed, paths={**timed.paths, "welder": path})), "points")
    assert failure.robot == "welder"
    assert "point 7" in failure.note


def test_a_start_at_speed(timed):
    rate = timed.timeline.tracks["welder"].rate.copy()
    rate[0, 0] = 0.01
    failures = of(verify_timing(with_track(timed, "welder", rate=rate)), "rest")
    assert (failures[0].robot, failures[0].joint, failures[0].t_s) == ("welder", "J1", 0.0)


def test_a_torch_that_swings_in(timed):
    failures = of(verify_timing(pushed(timed, "welder", 0, 1e-3, "plunge")), "axis")
    assert {failure.phase for failure in failures} == {"plunge"}


def test_a_phase_left_out(timed):
    line = timed.timeline
    without = tuple(phase for phase in line.phases if phase[0] != "withdraw")
    (failure,) = of(verify_timing(with_line(timed, phases=without)), "phases")
    assert failure.phase == "withdraw"
    with pytest.raises(PlanError, match="has no weld"):
        verify_timing(with_line(timed, phases=(line.phases[0], line.phases[-1])))


def test_what_is_no_number_or_no_timeline(timed):
    q = timed.timeline.tracks["welder"].q.copy()
    q[3, 3] = np.nan
    with pytest.raises(PlanError, match=r"tracks.welder: not one finite row"):
        verify_timing(with_track(timed, "welder", q=q))
    with pytest.raises(PlanError, match="has no timeline"):
        verify_timing(timed.timed(None))


def test_a_report_is_plain_data_and_fits_a_screen(timed):
    report = verify_timing(pushed(timed, "handler_2", 1, 1e-3, "weld"))
    data = report.to_json()
    assert data["feasible"] is False
    assert data["failures"][0]["check"] in str(report)
    assert max(len(line) for line in str(report).splitlines()) <= 80
