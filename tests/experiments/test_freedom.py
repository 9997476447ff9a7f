"""The freedom study: gains over the reduced form, and a row for every cell and formulation."""

import sys
from argparse import Namespace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

from freedom import freedom_table, markdown, study

from nlpweld.records.model import Record
from tests.records import made


def record(formulation: str, mean: float, verified: bool = True) -> Record:
    report = {"mmr_mean": mean, "mmr_min": mean / 2, "joint_step_rad": np.radians(19.0)}
    return made.record(cell="a", formulation=formulation, verified=verified, report=report)


def test_gain_is_over_the_best_verified_reduced_answer() -> None:
    records = [record("reduced", 0.2), record("reduced", 0.25), record("reduced", 0.9, verified=False)]
    records += [record("redundant", 0.3), record("redundant", 0.2998), record("redundant", 0.27)]
    table = freedom_table(records).set_index("formulation")
    assert table.loc["reduced", ["runs", "verified", "found"]].tolist() == [3, 2, 1]
    assert table.loc["redundant", "gain_percent"] == pytest.approx(20.0)
    assert table.loc["redundant", "found"] == 2
    assert table.loc["redundant", "joint_step_deg"] == pytest.approx(19.0)
    assert table.loc["redundant", "mmr_min"] == 0.15


def test_markdown_has_a_line_for_every_row_and_leaves_unknown_numbers_out() -> None:
    text = markdown(freedom_table([record("reduced", 0.25), record("redundant", 0.3, verified=False)]))
    lines = text.strip().splitlines()
    assert len(lines) == 4
    assert "nan" not in text
    assert "| 0.25000 |" in lines[2]


def test_small_study_runs_is_verified_and_resumes(tmp_path: Path) -> None:
    asked = Namespace(quick=True, out=tmp_path, workers=1)
    study(asked, Console(quiet=True))
    table = pd.read_csv(tmp_path / "tables" / "freedom.csv")
    assert table.verified.tolist() == [1, 1]
    assert table.gain_percent.tolist()[1] > 2.0
    before = [path.stat().st_mtime_ns for path in sorted(tmp_path.rglob("*.json"))]
    study(asked, Console(quiet=True))
    assert [path.stat().st_mtime_ns for path in sorted(tmp_path.rglob("*.json"))] == before
    assert (tmp_path / "tables" / "freedom.md").read_text().count("\n") == 4
