"""The palletising study: its tables, what it says of solvers, and runs that are not made twice."""

import sys
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import palletising
from palletising import report, solver_table, study, table_1

from nlpweld.palletising import load_pallet_task
from nlpweld.report import plots

SOLVERS = ["random_search", "slsqp"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("palletising")


@pytest.fixture(scope="module")
def found(folder: Path) -> dict[str, pd.DataFrame]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(palletising, "solver_names", lambda: SOLVERS)
        patch.setattr(plots, "ENDINGS", ("png",))
        return study(folder, 2, Console(quiet=True), quick=True)


def test_table_1_stands_beside_the_papers(found: dict[str, pd.DataFrame]) -> None:
    rows = found["table_1"].set_index("time")
    here, paper = rows.loc["planned, here"], rows.loc["planned, Cao et al."]
    assert here.before_s == pytest.approx(paper.before_s, rel=5e-4)
    assert here.after_s == pytest.approx(paper.after_s, rel=5e-4)
    late = rows.loc["run less planned, Cao et al."]
    assert (late.before_s, late.after_s) == pytest.approx((5.143, 5.123))
    assert (late.before_per_box_s, late.after_per_box_s) == pytest.approx((0.20572, 0.20492))
    assert table_1(load_pallet_task()).equals(found["table_1"])


def test_solvers_are_told_by_their_regret(found: dict[str, pd.DataFrame]) -> None:
    table = solver_table(found["runs"]).set_index("solver")
    assert table.runs.tolist() == [4, 4]  # two boxes, two seeds
    assert table.loc["slsqp", "worst_regret_s"] < 1e-6 < table.loc["random_search", "worst_regret_s"]
    assert table.loc["slsqp", "within 1e-6 s"] == 4


def test_everything_is_written_and_said(found: dict[str, pd.DataFrame], folder: Path) -> None:
    text = (folder / "tables" / "palletising.md").read_text()
    assert text == report(found)
    for told in (
        "| planned, here | 107.859 | 91.856 | 14.838 |",
        "4 of 4 combinations",
        "| C_speed | 1.5000 | 0 | 0 |",
    ):
        assert told in text
    assert "nan" not in text
    names = {path.stem for path in (folder / "figures").glob("*.png")}
    assert names == {"fig06_08_velocities", "fig09_12_stages", "box_times", "regret_by_solver", "same_totals"}
    assert all(path.stat().st_size > 10_000 for path in (folder / "figures").glob("*.png"))


def test_other_readings_are_off_by_less_than_a_tenth_of_a_percent(found: dict[str, pd.DataFrame]) -> None:
    off = found["readings"][["before_off_percent", "after_off_percent"]].abs().to_numpy()
    assert len(off) == 12
    assert 0.05 < off.max() < 0.1


def test_runs_are_not_made_twice_unless_the_task_is_another(
    found: dict[str, pd.DataFrame], monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []
    monkeypatch.setattr(palletising, "solver_names", lambda: SOLVERS)
    monkeypatch.setattr(palletising, "_run", lambda task, solver, *rest: made.append(solver) or {"regret_s": 0.0})
    task, known = load_pallet_task(), found["runs"]
    again = palletising.run_solvers(task, (1, 16), 2, known, lambda what: None)
    assert made == []
    assert again.regret_s.tolist() == known.regret_s.tolist()
    palletising.run_solvers(task.with_(cycle={"z_a_m": 1.9}), (1, 16), 2, known, lambda what: None)
    assert made == ["random_search"] * 4 + ["slsqp"] * 4
