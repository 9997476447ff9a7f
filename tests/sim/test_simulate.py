"""Timed plans played: what holds, and what must be caught."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nlpweld.errors import OptionError, PlanError
from nlpweld.plan import Plan
from nlpweld.sim.control import inverse_dynamics
from nlpweld.sim.model import open_model
from nlpweld.sim.options import Masses, Servos, SimOptions
from nlpweld.sim.planned import planned
from nlpweld.sim.simulate import Simulation, simulate
from nlpweld.verify import reference as ref

from .conftest import QUICK
from .timed import offset

pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")

SOON = (0.0, 0.2)


def turn(joint: int, by_rad: float) -> np.ndarray:
    return by_rad * np.eye(6)[joint - 1]


def servos(**fields) -> SimOptions:
    return replace(QUICK, servos=Servos(**fields))


def test_a_good_plan_holds(carried_run: Simulation) -> None:
    report = carried_run.report
    assert report.holds, str(report)
    assert report.torches["welder"].seam_m.value < 1e-4
    assert all(grasp.drift_m.value < 1e-5 for grasp in report.grasps.values())
    assert all(grasp.gap_m.value < 1e-5 for grasp in report.grasps.values())
    assert report.clearance_m > 0.01
    assert not report.contacts


def test_grasps_bear_the_weight_of_the_workpiece(carried: Plan) -> None:
    from nlpweld.sim.play import play, stage

    set_up = stage(carried, QUICK, SOON)
    kept = play(carried, set_up, QUICK)
    force, torque = kept.wrench[-1, :, :3], kept.wrench[-1, :, 3:]
    weight = set_up.model.body("workpiece").subtreemass[0] * 9.81
    assert force.sum(axis=0) == pytest.approx([0, 0, weight], abs=0.02 * weight)
    grasps = [(kept.work[-1] @ s.coupling.T_C_E)[:3, 3] for s in carried.cell.stations[:2]]
    centre = kept.work[-1, :3, :3] @ set_up.model.body("workpiece").ipos + kept.work[-1, :3, 3]
    moment = torque.sum(axis=0) + sum(np.cross(p - centre, f) for p, f in zip(grasps, force, strict=True))
    assert np.abs(moment).max() < 0.5  # and each grasp's own torque is of some 20 N m
    assert np.abs(torque).max() > 5


def test_servos_bear_the_arm_and_what_it_holds(carried: Plan) -> None:
    from nlpweld.sim.play import play, stage

    kept = play(carried, stage(carried, QUICK, SOON), QUICK)
    arms = open_model(carried.cell, carried.placement, Masses(work_kg_m3=1e-6))
    rates = (planned(carried.cell, carried.timeline, kept.t_s[-1:], k) for k in (1, 2))
    weight = inverse_dynamics(arms, kept.q[-1:], *rates)[0]
    for g, station in enumerate(carried.cell.stations[:2]):
        own = slice(6 * g, 6 * g + 6)
        links = ref.link_poses(station, kept.q[-1:, own])
        J = ref.jacobian(links, ref.tcp_pose(station, links))[0]
        assert kept.torque_nm[-1, own] == pytest.approx(weight[own] + J.T @ kept.wrench[-1, g], abs=0.5)


def test_a_workpiece_on_a_positioner_is_welded_true(turned: Plan) -> None:
    report = simulate(turned, QUICK, SOON).report
    assert report.holds, str(report)
    assert not report.grasps
    assert report.squeeze_n is None
    assert report.torches["robot_1"].seam_m.value < 1e-4
    assert set(report.servo_nm) == {"robot_1", "positioner"}


@pytest.mark.parametrize(("name", "by_rad"), [("handler_1", 2e-3), ("handler_2", -2e-3)])
def test_an_opened_chain_is_caught_by_name_instant_and_size(carried: Plan, name: str, by_rad: float) -> None:
    report = simulate(offset(carried, name, turn(1, by_rad)), QUICK, SOON).report
    assert not report.holds
    gaps = [c for c in report.complaints if c.what == "gap"]
    assert [c.who for c in gaps] == [name]
    assert gaps[0].value == pytest.approx(2.3e-3, abs=0.5e-3)
    assert 0.0 <= gaps[0].at_s <= SOON[1]
    other = "handler_2" if name == "handler_1" else "handler_1"
    assert report.grasps[other].gap_m.value == 0.0
    assert {c.who for c in report.complaints if c.what == "force"} == {"handler_1", "handler_2"}
    assert f"{name} at " in str(report)


def test_a_torch_beside_its_seam_is_caught(carried: Plan) -> None:
    report = simulate(offset(carried, "welder", turn(1, 3e-3)), QUICK, SOON).report
    assert [(c.what, c.who) for c in report.complaints] == [("torch", "welder")]


def test_a_collision_shows_its_contacts(carried: Plan) -> None:
    report = simulate(offset(carried, "welder", turn(2, 0.12)), QUICK, SOON).report
    touched = {contact.pair for contact in report.contacts}
    assert any("welder." in pair and "workpiece." in pair for pair in touched)
    assert {c.who for c in report.complaints if c.what == "contact"} == touched
    assert report.clearance_m < 0
    assert all(contact.depth_m > 0 and contact.from_s <= contact.deepest_s for contact in report.contacts)


def test_a_joint_beyond_its_stop_is_caught(carried: Plan) -> None:
    limit = carried.cell.stations[2].robot.limits_rad[5, 1]
    by = limit + 0.01 - carried.timeline.tracks["welder"].q[0, 5]
    report = simulate(offset(carried, "welder", turn(6, by)), QUICK, SOON).report
    stops = [c for c in report.complaints if c.what == "stop"]
    assert [c.who for c in stops] == ["welder.J6"]
    assert stops[0].value == pytest.approx(0.01, abs=0.002)


def test_what_controllers_know_shows_in_the_error(carried: Plan) -> None:
    def error(**fields) -> float:
        return max(simulate(carried, servos(**fields), (1.5, 1.7)).report.servo_error_rad["welder"])

    assert error() < 0.1 * error(model_error=0.2)
    assert error(model_error=0.2) < 0.5 * error(feed_forward="rates")
    with pytest.raises(OptionError, match="'guess' is unknown"):
        error(feed_forward="guess")


def test_servos_that_are_too_weak_let_go(carried: Plan) -> None:
    report = simulate(carried, servos(torque_limit_nm=100.0), SOON).report
    assert not report.holds
    assert max(max(torques) for torques in report.servo_nm.values()) == pytest.approx(100.0)


def test_the_same_again(carried: Plan, carried_run: Simulation) -> None:
    again = simulate(carried, QUICK, (0.0, 2.0))
    assert again.series.equals(carried_run.series)


def test_an_untimed_plan_and_a_wrong_span_are_refused(carried: Plan) -> None:
    with pytest.raises(PlanError, match="nlpweld time PLAN --out FILE"):
        simulate(carried.timed(None))
    for span in ((-1.0, None), (2.0, 1.0), (0.0, 99.0)):
        with pytest.raises(OptionError, match="is not within the plan's 0 to 4 s"):
            simulate(carried, QUICK, span)


def test_the_report_is_plain_data_and_fits_a_terminal(carried: Plan, carried_run: Simulation) -> None:
    spoiled = simulate(offset(carried, "welder", turn(2, 0.12)), QUICK, SOON).report
    assert carried.timeline is not None
    unwelded = carried.timed(replace(carried.timeline, phases=(("approach", 4.0),)))
    for report in (carried_run.report, spoiled, simulate(unwelded, QUICK, SOON).report):
        assert max(len(line) for line in str(report).splitlines()) <= 79
        data = json.loads(json.dumps(report.to_json(), allow_nan=False))
        assert data["holds"] == report.holds
        assert data["options"]["masses"]["work_kg_m3"] == 7850.0
        assert data["grasps"]["handler_1"]["drift_m"]["value"] == report.grasps["handler_1"].drift_m.value


def test_numbers_that_end_are_told_and_nothing_is_left_behind(carried: Plan, tmp_path, monkeypatch, capfd) -> None:
    monkeypatch.chdir(tmp_path)
    stiff = SimOptions(
        numerics=replace(QUICK.numerics, integrator="euler", weld_time_s=2e-3), servos=Servos(frequency_hz=80.0)
    )
    report = simulate(carried, stiff, SOON).report
    assert [c.what for c in report.complaints] == ["diverged"]
    assert "diverged at " in str(report)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")
