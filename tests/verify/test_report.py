"""The report as people and programs read it."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from nlpweld.plan import Plan
from nlpweld.verify.check import verify
from nlpweld.verify.report import SHOWN, Report, Violation, unreachable, worst_first

from .helpers import cell_with


def violation(value: float, robot: str = "handler_1", joint: str | None = "J4") -> Violation:
    return Violation("joint_limit", robot, 7, value, 1.0, s=0.1, joint=joint, unit="rad")


def test_json_is_plain_and_complete(report: Report):
    data = report.to_json()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    means = {
        "mmr_mean",
        "mmr_min",
        "mmr_max",
        "m_tight_mean",
        "m_loose_mean",
        "manipulability_mean",
        "manipulability_min",
    }
    wanted = {"cell", "at", "n_points", "clearance_m", "joint_margin_rad", "feasible", "violations"} | means
    assert wanted <= set(data)
    assert "profile" not in data
    assert data["mmr_mean"] == report.mmr_mean
    assert data["manipulability_mean"]["welder"] == report.manipulability_mean["welder"]


def test_json_holds_the_profile_on_request(report: Report):
    data = report.to_json(profile=True)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["profile"]["mmr"] == report.profile["mmr"].tolist()


def test_placement_without_a_plan(cell):
    report = unreachable(cell, (0.5, 0.1, 1.0), "welder", 18, 72)
    assert not report.feasible
    assert math.isnan(report.mmr_mean)
    assert report.violations[0].constraint == "reach"
    data = json.loads(json.dumps(report.to_json(), allow_nan=False))
    assert data["mmr_mean"] is None
    assert data["manipulability_min"] == {"handler_1": None, "handler_2": None, "welder": None}
    assert {k: data["violations"][0][k] for k in ("constraint", "robot", "point", "value", "s")} == {
        "constraint": "reach", "robot": "welder", "point": 18, "value": None, "s": 0.25,
    }  # fmt: skip
    assert "reach welder at point 18" in str(report)


def test_no_plan_is_never_feasible(cell):
    assert not Report.without_plan(cell, (0, 0, 0), 72, []).feasible


def test_one_violation_for_each_robot_and_joint_the_worst_first():
    got = worst_first(
        [violation(1.2), violation(1.5), violation(1.1), violation(1.9, "welder"), violation(1.3, joint="J6")]
    )
    assert [(v.robot, v.joint, v.value) for v in got] == [
        ("welder", "J4", 1.9),
        ("handler_1", "J4", 1.5),
        ("handler_1", "J6", 1.3),
    ]


def test_broken_without_measure_comes_first():
    reach = Violation("reach", "welder", 1, math.nan, math.nan)
    assert worst_first([violation(9.0), reach])[0] is reach


@pytest.mark.parametrize("count", [0, 1, 30])
def test_text_fits_a_terminal(cell, report: Report, count):
    pairs = [f"handler_{i}.forearm - welder.torch_body" for i in range(count)]
    violations = [Violation("clearance", "x", 71, -0.123456, 0.01, s=0.99, pair=pair, unit="m") for pair in pairs]
    data = {name: getattr(report, name) for name in report.__dataclass_fields__}
    text = str(Report(**{**data, "violations": worst_first(violations), "feasible": not count}))
    assert max(len(line) for line in text.splitlines()) <= 80
    assert text.count("clearance handler_") == min(count, SHOWN)
    assert ("and 22 more" in text) == (count == 30)
    assert "0.284151" in text
    assert ("NOT feasible" in text) == (count > 0)


def test_violation_text_names_joint_point_and_units():
    assert str(violation(1.25)) == "joint_limit handler_1 J4 at point 7 (s 0.1000): 1.25 rad, limit 1"


def with_fields(report: Report, **fields) -> Report:
    return Report(**{**{name: getattr(report, name) for name in report.__dataclass_fields__}, **fields})


def test_text_of_a_cell_without_handlers_says_nothing_of_them(dual_report: Report):
    text = str(dual_report)
    assert max(len(line) for line in text.splitlines()) <= 79
    assert "product of w      mean 0.22696," in text
    assert "posture  " in text
    assert not [word for word in ("M_tight", "M_loose", "MMR", "nan", "yaw") if word in text]
    other = str(with_fields(dual_report, reading="mean"))
    assert "mean of w         mean" in other
    assert "M_loose           mean 0.22696" in other


def test_text_of_a_free_workpiece_says_nothing_of_posture(report: Report):
    assert "M_tight, M_loose  mean 0.21594, 0.423846" in str(report)
    assert "MMR (paper)       mean 0.284151" in str(report)
    assert "posture" not in str(report)
    assert report.posture_rad == 0.0


def test_yaw_is_told_where_there_is_one(dual_report: Report):
    assert "at (-0.5, -1.3, 0.5) m, yaw -12 deg, 72 points" in str(with_fields(dual_report, yaw_rad=np.radians(-12)))
    assert dual_report.to_json()["yaw_rad"] == 0.0


def test_json_of_a_cell_with_a_positioner_is_strict(dual_plan: Plan):
    data = verify(dual_plan).to_json(profile=True)
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert 0 <= data["posture_rad"] < 1e-9
    assert len(data["at"]) == 3


def test_placement_with_yaw_but_without_a_plan(dual):
    report = unreachable(dual, (0.5, -1.0, 0.5, 0.2), "robot_2", 71, 72)
    assert (report.at, report.yaw_rad) == ((0.5, -1.0, 0.5), 0.2)
    assert report.violations[0].s == 1.0  # the last point of an open seam is its end
    assert math.isnan(report.posture_rad)
    assert json.loads(json.dumps(report.to_json(), allow_nan=False))["posture_rad"] is None


def test_text_says_what_is_maximised_and_in_which_unit(cell, report: Report):
    assert "mean 0.284151, 0.153509 to 0.353748 [lengths in m]" in str(report)
    assert "maximised" not in str(report)
    soft = with_fields(report, over_seam="soft_minimum", exponent=8.0, objective=0.194779)
    text = " ".join(str(soft).split())  # the line is folded
    assert "maximised soft minimum (p = 8) 0.194779; least along the seam 0.15345" in text
    least = with_fields(report, over_seam="minimum", objective=0.153509, reading="millimetres")
    assert "maximised         least of the points 0.153509; least along the seam 0.15345" in str(least)
    assert "[lengths in mm]" in str(least)
    assert max(len(line) for r in (soft, least) for line in str(r).splitlines()) <= 79


def test_objective_is_what_the_plan_s_cell_asks_for(coarse: Plan):
    cells = [cell_with(coarse.cell, objective={"over_seam": over}) for over in ("mean", "minimum")]
    mean, least = (verify(replace(coarse, cell=c)) for c in cells)
    assert mean.objective == mean.mmr_mean == least.mmr_mean
    assert least.objective == least.mmr_min == mean.profile["mmr"].min()
    assert least.mmr_min_along < least.mmr_min  # between the points it is less
    assert least.to_json()["over_seam"] == "minimum"
