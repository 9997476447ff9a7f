"""The study of every solver: references, and what is above their bound."""

import sys
from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

from all_cells import reference_table, references, study

from nlpweld.cell import library_names
from nlpweld.errors import ReferenceFileError
from tests.records import made


def test_every_built_in_cell_has_a_reference_of_its_present_version() -> None:
    known = references(library_names("cells"))
    assert all(reference.rigorous and 0.0 <= reference.gap < 1e-3 for reference in known.values())


def test_an_answer_above_the_bound_is_refused() -> None:
    known = references(["three_er16"])
    below = made.record(report={**made.report(0.29), "objective": 0.29})
    table = reference_table(known, [below])
    assert table["best_regret_percent"][0] == pytest.approx(100 * (1 - 0.29 / known["three_er16"].objective))
    above = made.record(report={**made.report(0.31), "objective": 0.31})
    with pytest.raises(ReferenceFileError, match=r"0\.31 is above the bound"):
        reference_table(known, [below, above])
    reference_table({"three_er16": replace(known["three_er16"], upper_bound=0.4)}, [above])


def test_small_study_has_regret_and_a_page(tmp_path: Path) -> None:
    study(Namespace(quick=True, out=tmp_path, workers=1, no_figures=False), Console(quiet=True))
    table = pd.read_csv(tmp_path / "tables" / "summary.csv").set_index("solver")
    assert table.loc["hybrid", "verified"] == 1
    assert table.loc["hybrid", "regret_percent"] < 0.1
    assert (tmp_path / "report.html").stat().st_size > 100_000
    assert "stated reference" in (tmp_path / "report.html").read_text()
