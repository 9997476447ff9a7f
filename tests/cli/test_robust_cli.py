"""Errors of the set-up on the command line."""

import json
from pathlib import Path

import pytest

from nlpweld.cell.files import LIBRARY

CELL = (LIBRARY / "cells" / "robot_positioner.toml").read_text(encoding="utf-8")
AT = ["--at", "0", "-1.2", "0.5"]


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    stated = '[uncertainty]\nplacement_m = [0.002, 0.0, 0.0]\nsource = "a test"\n\n[objective]'
    path = tmp_path / "cell.toml"
    path.write_text(CELL.replace("[objective]", stated, 1), encoding="utf-8")
    return path


def test_placement_and_its_plan_are_verified_under_the_stated_errors(call, cell: Path, tmp_path: Path) -> None:
    code, out, _ = call("evaluate", cell, *AT, "--points", "24", "--robust", "--out", tmp_path / "plan.json", "--json")
    found = json.loads(out)
    assert code == 0
    assert found["worst_case"]["scenarios"] == found["worst_case"]["feasible"] == 3 + 16
    assert found["worst_case"]["mmr_mean"]["value"] < found["mmr_mean"]
    assert found["worst_case"]["mmr_mean"]["scenario"] in ("placement +2 mm in x", "placement -2 mm in x")
    code, out, _ = call("verify", tmp_path / "plan.json", "--robust", "--samples", "2", "--json")
    again = json.loads(out)["worst_case"]
    assert code == 0
    assert again["scenarios"] == 3 + 2
    assert again["mmr_mean"] == found["worst_case"]["mmr_mean"]
    code, out, err = call("verify", tmp_path / "plan.json", "--samples", "2")
    assert (code, out) == (2, "")
    assert "--robust" in err


@pytest.mark.parametrize(
    "arguments",
    [["evaluate", "robot_positioner", *AT, "--robust"], ["solve", "robot_positioner", "--formulation", "robust"]],
)
def test_a_cell_without_errors_is_one_line_that_names_the_table(call, arguments: list[str]) -> None:
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    assert "robot_positioner: no [uncertainty] table" in err


def test_negative_error_is_one_line_that_names_the_field(call, cell: Path) -> None:
    cell.write_text(cell.read_text().replace("[0.002, 0.0, 0.0]", "[0.002, -0.001, 0.0]", 1))
    code, out, err = call("evaluate", cell, *AT)
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    assert "uncertainty.placement_m.2" in err
