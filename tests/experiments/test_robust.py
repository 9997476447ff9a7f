"""The robust study: rows of stated, nominal and robust answers, and the figure drawn from them."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from nlpweld.cell import Cell, load_cell

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import robust as experiment


def report(mean: float, worst: float, w: float, feasible: int = 57) -> dict:
    least = {name: {"value": value, "scenario": "as stated"} for name, value in
             (("mmr_mean", worst), ("singularity", w), ("clearance_m", 0.02))}  # fmt: skip
    head = {"mmr_mean": mean, "at": [0.0, -0.2, 0.4], "clearance_along_m": 0.02, "feasible": feasible == 57}
    return {
        **head,
        "singularity_min": {"a": w, "b": 0.2},
        "worst_case": {**least, "scenarios": 57, "feasible": feasible},
    }


def record(label: str, formulation: str, solver: str, found: dict, verified: bool = True) -> dict:
    head = {"cell": label, "formulation": formulation, "solver": solver, "verified": verified, "report": found}
    return {**head, "solve_s": 2.0, "evaluations": 300, "seed": 0, "status": "SOLVED", "placement": {"x_m": 0.0}}


def records() -> list[dict]:
    return [
        record("three_er16", "reduced", "ipopt", report(0.30, 0.30, 0.1204)),
        record("three_er16-x1", "robust", "ipopt", report(0.298, 0.293, 0.1201)),
        record("three_er16-x1", "robust", "ipopt", report(0.299, 0.299, 0.1190, 40), verified=False),
        record("three_er16-x1", "robust", "ga", report(0.297, 0.292, 0.1205)),
    ]


def nominal(cell: Cell, stated: dict) -> dict:
    assert cell.uncertainty is not None
    return report(0.30, 0.295, 0.116, 4)


def test_rows_are_the_best_verified_answers_beside_the_nominal_optimum() -> None:
    table = experiment.robust_table([load_cell("three_er16")], [1.0], records(), nominal)
    assert table.answer.tolist() == ["nominal", "nominal", "robust ipopt", "robust ga"]
    assert table.errors.tolist() == [0.0, 1.0, 1.0, 1.0]
    assert table.objective_worst.tolist() == [0.30, 0.295, 0.293, 0.292]
    assert table.feasible.tolist() == [1, 4, 57, 57]
    assert table.verified.tolist() == [1, 0, 1, 1]
    text = experiment.markdown(table)
    assert text.count("\n") == 6
    assert "| 0.29300 |" in text


def test_errors_are_multiples_of_the_study_s_box_and_tasks_carry_them() -> None:
    cell = experiment.with_errors(load_cell("three_er16"), 2.0)
    assert cell.uncertainty.placement_m == (0.004,) * 3
    assert cell.uncertainty.base == pytest.approx([0.002, 0.002, 0.002, np.radians(0.2)])
    tasks = experiment.tasks([load_cell("three_er16")], {1.0: {"ipopt": 2}, 2.0: {"ga": 1}})
    told = [(t.cell.uncertainty is None, t.formulation, t.solver, t.label) for t in tasks]
    assert told[0] == (True, "reduced", "ipopt", "")
    assert told[1:3] == [(False, "robust", "ipopt", "three_er16-x1")] * 2
    assert told[3] == (False, "robust", "ga", "three_er16-x2")
    assert len({t.key for t in tasks}) == 4


def test_study_writes_table_and_figure_and_asks_for_a_nominal_report_once(tmp_path: Path, monkeypatch) -> None:
    asked = []

    def evaluated(nlp, x):
        asked.append(nlp.formulation)
        found = report(0.30, 0.295, 0.116, 4)
        return None, type("Report", (), {"to_json": lambda self: found})()

    known = records()
    known[0]["placement"] = {"x_m": 0.0, "y_m": -0.2, "z_m": 0.4, "yaw_rad": 0.0}
    monkeypatch.setattr(experiment, "solved", lambda todo, *_: known)
    monkeypatch.setattr(experiment, "evaluate_plan", evaluated)
    for _ in range(2):
        experiment.study(tmp_path, 1, Console(quiet=True), [load_cell("three_er16")], {1.0: {"ipopt": 1}})
    assert asked == ["robust"]
    assert (tmp_path / "figures" / "robust.png").stat().st_size > 10_000
    assert (tmp_path / "tables" / "robust.md").read_text().count("\n") == 6
    assert json.loads((tmp_path / "data" / "box.json").read_text()).items() >= experiment.BOX.items()
