"""How the main types show themselves in a notebook: small tables that are well formed and say what is so."""

import dataclasses
import subprocess
import sys
from xml.etree import ElementTree

from nlpweld.bench.answer import Answer
from nlpweld.html_table import html_table
from nlpweld.sim.options import SimOptions
from nlpweld.sim.report import Complaint, GraspResult, Peak, SimReport, TorchResult
from nlpweld.solvers import Outcome
from nlpweld.verify.check import verify
from nlpweld.verify.timing import verify_timing
from nlpweld.verify.timing_report import Failure
from tests.export.timed import carried, turned


def read(markup: str) -> list[tuple[str, list[list[str]]]]:
    """Return caption and rows of every table, parsed strictly."""
    tables = ElementTree.fromstring(f"<div>{markup}</div>").findall("table")
    return [(t.findtext("caption"), [[c.text or "" for c in row] for row in t.iter("tr")]) for t in tables]


def test_text_stays_text():
    ((title, rows),) = read(html_table("a < b", [("<b>x</b>", 1.5)], ("&", '"')))
    assert title == "a < b"
    assert rows == [["&", '"'], ["<b>x</b>", "1.5"]]


def test_cell_shows_who_does_what():
    ((title, rows),) = read(carried().cell._repr_html_())
    assert title.startswith("three_er16: ")
    assert [row[0] for row in rows] == ["", "handler_1", "handler_2", "welder", "seam", "searched"]
    assert rows[1][1:] == ["ESTUN ER16-1600, 16 kg, reach 1.59 m, tight", "(1.0, -1.0, 0.05)"]
    assert rows[4][1:] == ["saddle, 36 points", "closed"]
    assert rows[5][1:] == ["x_m, y_m, z_m", "[-0.6, 0.6], [-1, 0.6], [0.1, 1.2]"]
    ((_, rows),) = read(turned().cell._repr_html_())
    assert rows[2][0] == "positioner"


def test_plan_shows_its_spans_and_whether_it_is_timed():
    plan = turned()
    ((title, rows),) = read(plan._repr_html_())
    assert "(0.0000, -1.0000, 0.5000) m, 36 points, 21.50 s" in title
    by_name = {row[0]: row[1:] for row in rows}
    assert by_name["robot_1"][0] == "front-up-noflip"
    assert by_name["positioner"] == ["", "-135.0 to -135.0, -170.0 to 180.0"]
    assert "not timed" in plan.timed(None)._repr_html_()


def test_report_shows_its_numbers_and_what_is_broken():
    plan = turned()
    report = verify(plan)
    ((title, rows),) = read(report._repr_html_())
    assert title.endswith("feasible")
    assert rows[1] == [
        "product of w [m^3]",
        *(f"{x:.6g}" for x in (report.mmr_mean, report.mmr_min, report.mmr_min_along)),
    ]
    assert ["clearance [mm]", "", f"{1e3 * report.clearance_m:.6g}", f"{1e3 * report.clearance_along_m:.6g}"] in rows
    strict = plan.cell.with_(constraints={"clearance_m": 0.1})
    (title, _), (_, broken) = read(verify(type(plan)(strict, plan.placement_m, plan.s, plan.paths))._repr_html_())
    assert "NOT feasible" in title
    assert any("clearance" in row[0] for row in broken)


def test_answer_tells_claim_from_finding():
    report = verify(turned())
    claimed = Outcome("SOLVED", None, mode=0, objective=0.5, evaluations=1234, build_s=1.0, solve_s=2.0, message="done")
    (title, rows), (found, _) = read(Answer(claimed, turned(), report)._repr_html_())
    assert title == "answer: verified"
    assert rows[:2] == [["claimed", "SOLVED (done)"], ["evaluations", "1,234"]]
    assert found.endswith("feasible")
    assert read(Answer(claimed, None, None)._repr_html_())[0][0] == "answer: no answer to verify"
    refused = dataclasses.replace(report, feasible=False)
    assert read(Answer(claimed, turned(), refused)._repr_html_())[0][0] == "answer: NOT verified"


def test_a_timing_report_tells_phases_and_failures():
    plan = carried()
    report = verify_timing(plan)
    (title, rows), *rest = read(report._repr_html_())
    assert title.startswith(f"{plan.cell.name}: cycle {report.cycle_s:.3f} s")
    assert [row[0] for row in rows[1:]] == [name for name, _ in plan.timeline.phases]
    assert len(rest) == bool(report.failures)
    assert title.endswith("NOT verified") == bool(report.failures)
    good, bad = (
        dataclasses.replace(report, failures=found) for found in ((), (Failure("rate", 1.0, "weld", 2.0, 1.0),))
    )
    assert [t for t, _ in read(good._repr_html_())] == [title.replace("NOT verified", "verified")]
    assert read(bad._repr_html_())[1] == ("failures", [[str(bad.failures[0])]])


def test_a_simulation_tells_what_came_of_torches_and_grasps():
    none, options = Peak(0.0, 0.0), SimOptions()
    torch = TorchResult(Peak(1.5e-3, 2.0), 1e-3, none, none)
    grasp = GraspResult(*[Peak(2e-6, 1.0)] * 6)
    report = SimReport(
        "c", 0.0, 1.0, {"welder": torch}, {"handler": grasp}, squeeze_n=None, servo_nm={}, servo_error_rad={},
        clearance_m=0.02, clearance_s=1.0, clearance_pair="a - b", contacts=(), wall_s=0.1, steps=9, options=options,
        complaints=(Complaint("torch", "welder", 2.0, 1.5e-3, 1e-3, "m"),),
    )  # fmt: skip
    (title, rows), (_, missed) = read(report._repr_html_())
    assert "does NOT hold" in title
    assert rows[0] == ["torch of welder", "1.5 mm off the seam"]
    assert rows[1][1].startswith("drifts 2")
    assert missed == [[str(report.complaints[0])]]


def test_a_cell_shows_itself_without_what_is_slow_to_load():
    code = "import nlpweld as nw, sys; nw.load_cell('three_er16')._repr_html_(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert "nlpweld.html_table" in loaded
    assert not {"pandas", "matplotlib", "casadi", "jinja2", "sphinx"} & set(loaded)
