"""The reference study: what is known is left alone, and told in the table."""

import sys
from pathlib import Path

import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

from reference import known, main, study, table

from nlpweld.cell import load_cell
from nlpweld.reference.find import Effort
from nlpweld.reference.record import Reference, load_reference

STORED = Path(__file__).parents[2] / "results" / "reference" / "robot_positioner.json"


@pytest.fixture
def reference() -> Reference:
    return load_reference(STORED, load_cell("robot_positioner"))


def test_a_known_reference_is_not_built_again(reference: Reference, tmp_path: Path) -> None:
    reference.save(tmp_path / "robot_positioner.json")
    found = study(tmp_path, ["robot_positioner"], Effort(), Console(quiet=True))
    assert found == {"robot_positioner": reference}


def test_that_of_another_version_of_the_cell_is_not_known(reference: Reference, tmp_path: Path) -> None:
    path = reference.save(tmp_path / "robot_positioner.json")
    cell = load_cell("robot_positioner")
    assert known(path, cell) == reference
    assert known(path, cell.with_(constraints={"clearance_m": 0.02})) is None
    assert known(tmp_path / "none.json", cell) is None


def test_the_table_has_gaps_in_percent(reference: Reference) -> None:
    row = table({"robot_positioner": reference}).iloc[0]
    assert row.gap_percent == pytest.approx(100 * (1 - reference.objective / reference.upper_bound))
    assert row.open_boxes == 0


def test_the_command_prints_and_writes_the_table(
    reference: Reference, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    reference.save(tmp_path / "robot_positioner.json")
    monkeypatch.setattr(sys, "argv", ["reference.py", "--out", str(tmp_path), "--cells", "robot_positioner"])
    main()
    assert "robot_positioner" in capsys.readouterr().out
    assert (tmp_path / "reference.csv").read_text(encoding="utf-8").startswith("cell,objective,")
