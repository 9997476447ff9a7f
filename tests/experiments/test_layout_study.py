"""The layout study: what its cases free, gains over bases that are held, and a small study from end to end."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

from layout import HALF_DEG, HALF_M, Case, freed, layout_table, markdown, moves, study, tasks

from nlpweld.bench import engines
from nlpweld.cell import load_cell
from nlpweld.engine import choice
from nlpweld.records.model import Record
from tests.bench.here import run_here
from tests.records import made

CASES = (Case("three_er16", "fixed"), Case("three_er16", "welder", ("welder",)))


def record(case: Case, mean: float, verified: bool = True) -> Record:
    base = {"x_m": 0.1, "y_m": 0.9, "yaw_rad": np.radians(5.0)}
    head = {"cell": case.label, "verified": verified, "solve_s": 1.0, "build_s": 2.0}
    report = {"mmr_mean": mean, "mmr_min": mean / 2}
    return made.record(**head, report=report, layout={"welder": base} if case.robots else {})


def test_gain_is_over_the_best_verified_answer_with_bases_held() -> None:
    fixed, free = CASES
    records = [record(fixed, 0.2), record(fixed, 0.25), record(fixed, 0.9, verified=False)]
    records += [record(free, 0.3), record(free, 0.2999), record(free, 0.27)]
    table = layout_table(CASES, records).set_index("free")
    assert table.loc["fixed", ["runs", "verified", "found", "variables"]].tolist() == [3, 2, 1, 3]
    assert table.loc["welder", ["runs", "verified", "found", "variables"]].tolist() == [3, 3, 2, 5]
    assert table.loc["welder", "gain_percent"] == pytest.approx(20.0)
    assert table.loc["welder", "moves"] == "welder +0.100 -0.100 m +5.0 deg"
    assert moves(load_cell("three_er16"), records[0]) == ""


def test_case_without_a_verified_answer_has_no_figures() -> None:
    text = markdown(layout_table(CASES, [record(CASES[0], 0.25), record(CASES[1], 0.3, verified=False)]))
    assert len(text.strip().splitlines()) == 4
    assert "nan" not in text


def test_case_frees_just_its_robots_about_where_they_stand() -> None:
    cell = load_cell("dual_welder_positioner")
    one = freed(cell, ("robot_1",), turns=True)
    assert one.variables[2:] == ("robot_1.x_m", "robot_1.y_m", "robot_1.yaw_rad")
    assert one.box[:, 2:] - cell.stations[0].base == pytest.approx(
        np.array([[-0.2, -0.2, -np.pi / 6]] * 2) * [[1], [-1]]
    )
    assert freed(cell, (), turns=False).content_hash == cell.content_hash
    assert len({task.place for task in tasks(2)}) == len(tasks(2))


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run tasks here and on NumPy, which is ready sooner than a new cell is compiled."""
    monkeypatch.setattr(choice, "find_spec", lambda name: None)
    monkeypatch.setattr(engines, "run_apart", run_here)


@pytest.mark.usefixtures("in_this_process")
def test_small_study_is_verified_draws_and_resumes(tmp_path: Path) -> None:
    cases = (Case("robot_positioner", "fixed"), Case("robot_positioner", "xy", ("robot_1",)))
    table = study(tmp_path, 1, 1, Console(quiet=True), cases, points=18)
    assert table.verified.tolist() == [1, 1]
    assert table.gain_percent.tolist()[0] == 0.0
    assert table.gain_percent.tolist()[1] > -0.05
    assert (tmp_path / "figures" / "layout_robot_positioner.png").stat().st_size > 10_000
    before = [path.stat().st_mtime_ns for path in sorted((tmp_path / "records").rglob("*.json"))]
    study(tmp_path, 1, 1, Console(quiet=True), cases, points=18)
    assert [path.stat().st_mtime_ns for path in sorted((tmp_path / "records").rglob("*.json"))] == before
    assert (tmp_path / "tables" / "layout.md").read_text().count("\n") == 4
    assert json.loads((tmp_path / "data" / "box.json").read_text()) == {"half_m": HALF_M, "half_deg": HALF_DEG}
