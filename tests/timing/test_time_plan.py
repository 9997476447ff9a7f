from dataclasses import replace

import numpy as np
import pytest

from nlpweld.errors import MotionError, PlanError
from nlpweld.plan import load_plan
from nlpweld.timing import time_plan
from nlpweld.timing.cycle import Cycle
from nlpweld.timing.joints import along_seam
from nlpweld.timing.wanted import wanted
from nlpweld.verify import time_rules
from nlpweld.verify.reference import link_poses, tcp_pose
from nlpweld.verify.timing import verify_timing

from .helpers import with_drives, with_timing

PHASES = ["approach", "plunge", "weld", "withdraw", "retreat"]


@pytest.mark.parametrize("name", ["timed_tee", "timed_flange", "timed_trough"])
def test_every_cell_is_timed_and_verified(name, request, tmp_path):
    plan = request.getfixturevalue(name)
    report = verify_timing(plan)
    assert report.feasible, str(report)
    assert [phase for phase, _, _ in report.phases] == PHASES
    assert report.slowed == ()
    assert report.fastest_m_s == pytest.approx(plan.cell.timing.torch.speed_m_s, rel=1e-4)
    assert max(report.closure_m, report.closure_rad, report.seam_m) < 2e-7
    again = load_plan(plan.save(tmp_path / "plan.json"))
    assert again.timeline.duration_s == plan.timeline.duration_s


def test_the_plan_s_points_are_passed_on_its_own_joints(tee, timed_tee):
    line = timed_tee.timeline
    fine = np.linspace(*line.span_s("weld"), 20_001)
    when = np.interp(tee.s, line.s_at(fine), fine)
    for name, q in line.at(when).items():
        assert q == pytest.approx(tee.paths[name], abs=3e-3)  # the parameter is linear between instants


def test_handlers_wind_along_a_closed_seam_and_it_is_said(timed_tee):
    report = verify_timing(timed_tee)
    assert any(report.left["handler_1"])
    assert report.left == report.windings
    assert "once the part is released" in str(report)


def test_a_positioner_unwinds_by_itself(timed_flange):
    report = verify_timing(timed_flange)
    assert report.windings["positioner"] == (0, -1)
    assert not any(any(turns) for turns in report.left.values())


def test_torches_leave_straight_up_where_no_way_along_their_axes_is_free(trough, monkeypatch):
    """Their axes lean by 45 degrees here."""
    own = Cycle._trouble
    monkeypatch.setattr(Cycle, "_trouble", lambda self, *_: own(self, *_) if self.upwards else ("too near", True))
    timed = time_plan(trough, 0.04)
    assert verify_timing(timed).feasible
    station, line = timed.cell.stations[0], timed.timeline
    begin, end = (
        tcp_pose(station, link_poses(station, line.at(np.array([t]))["robot_1"]))[0] for t in line.span_s("withdraw")
    )
    assert end[:3, 3] - begin[:3, 3] == pytest.approx([0.0, 0.0, timed.cell.timing.stand_off_m], abs=1e-6)
    monkeypatch.setattr(time_rules, "LEAN", np.radians(40.0))
    assert {failure.check for failure in verify_timing(timed).failures} == {"axis"}


def test_without_blends_it_stops_at_kinks(trough):
    line = time_plan(with_timing(trough, blend_m=0.0), 0.04).timeline
    begin, end = line.span_s("weld")
    inside = (line.t_s > begin + 1) & (line.t_s < end - 1)
    still = inside & (np.abs(line.tracks["robot_1"].rate).max(axis=1) < 1e-12)
    assert still.sum() == 2


def test_slow_drives_slow_the_weld_and_it_is_told_where(tee):
    slow = with_drives(tee, 0, speed_deg_s=(185.0, 185.0, 210.0, 60.0, 410.0, 705.0))
    report = verify_timing(time_plan(slow, 0.05))
    assert report.feasible, str(report)
    assert report.slowed
    assert {(one.use.robot, one.use.joint, one.use.kind) for one in report.slowed} == {("handler_1", "J4", "rate")}
    assert all(one.least_m_s < 0.05 and one.use.used > 0.9 for one in report.slowed)
    assert "slowed to" in str(report)


def test_same_input_same_timeline(tee, timed_tee):
    again = time_plan(tee, 0.05).timeline
    for name, track in timed_tee.timeline.tracks.items():
        assert (again.tracks[name].q == track.q).all()


def test_free_angles_go_smoothly_through_the_plan_s_points(tee):
    bow = np.radians(4) * np.where(np.arange(len(tee.s)) % 2, 1.0, -1.0)
    free = tee.with_freedom({"spin.welder": bow})
    with pytest.raises(PlanError, match="without closure: welder"):
        time_plan(free, 0.05)
    asked = wanted(free, 0.0)
    arm = along_seam(tee, wanted(tee, 0.0), wanted(tee, 0.0)).arms["welder"]
    path = arm.joints(asked.tool(arm.station, tee.s, asked.work(tee.s)[0]), tee.paths["welder"][0])
    free = replace(free, paths={**free.paths, "welder": path})
    along = along_seam(free, asked, asked)
    q = along.curve.at(np.linspace(0, along.curve.length, 401))
    own, s = q[:, along.columns["welder"]], np.clip(q[:, -1], 0.0, 1.0)
    assert own == pytest.approx(arm.joints(asked.tool(arm.station, s, asked.work(s)[0]), own[0]), abs=1e-10)
    report = verify_timing(time_plan(free, 0.05))
    assert report.feasible, str(report)
    assert report.seam_m < 2e-8
    assert 0.1 < np.degrees(report.blended_rad) < 1.0  # splines leave the plan's straight lines by as much


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_a_speed_that_is_none(tee, speed):
    with pytest.raises(MotionError, match="speed_m_s"):
        time_plan(tee, speed)


def test_a_cell_without_timing(tee):
    with pytest.raises(MotionError, match=r"three_er16: has no \[timing\]"):
        time_plan(replace(tee, cell=tee.cell.model_copy(update={"timing": None})))


def test_a_robot_without_accelerations(tee):
    with pytest.raises(MotionError, match=r"'er16_1600': drives.acceleration_deg_s2 is not stated"):
        time_plan(with_drives(tee, 1, acceleration_deg_s2=None))


def test_a_plan_without_closure(tee):
    path = tee.paths["handler_2"].copy()
    path[5, 2] += 0.01
    with pytest.raises(PlanError, match=r"without closure: handler_2 is 0.573 deg off .* point 5"):
        time_plan(replace(tee, paths={**tee.paths, "handler_2": path}))


def test_a_plan_that_turns_by_whole_turns(tee):
    path = tee.paths["welder"].copy()
    path[9:, 5] -= 2 * np.pi
    with pytest.raises(PlanError, match=r"torn: welder .* point 9"):
        time_plan(replace(tee, paths={**tee.paths, "welder": path}))


def test_a_plan_of_nan(tee):
    path = tee.paths["welder"].copy()
    path[3, 0] = np.nan
    with pytest.raises(PlanError, match="welder: the path holds NaN"):
        time_plan(replace(tee, paths={**tee.paths, "welder": path}))


def test_a_part_carried_in_beyond_a_joint_s_limit(tee):
    with pytest.raises(MotionError, match="approach: handler_1 J4 would leave its limits by"):
        time_plan(with_timing(tee, carry_m=(0.0, -0.2, 0.0)))


def test_a_home_within_the_work(tee):
    inside = {"welder": (90.0, 60.0, 10.0, 0.0, 20.0, -180.0)}
    with pytest.raises(MotionError, match=r"approach: .* - .* come to .* no way round"):
        time_plan(with_timing(tee, home_deg=inside))
