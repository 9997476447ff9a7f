"""Bases that may move on the command line: what is shown, solved and evaluated, and bad input in one line."""

import json
from pathlib import Path

import pytest

from nlpweld.cell.files import LIBRARY
from nlpweld.engine import choice
from nlpweld.plan import load_plan

SOUND = (LIBRARY / "cells" / "robot_positioner.toml").read_text(encoding="utf-8")
COUPLING = "[stations.coupling]"
LAYOUT = '[stations.layout]\nx_m = [-0.4, 0.5]\nyaw_deg = [-100.0, -80.0]\nsource = "chosen: a rail"\n'


@pytest.fixture(autouse=True)
def no_compiling(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take NumPy, which is ready sooner than a new cell is compiled."""
    monkeypatch.setattr(choice, "find_spec", lambda name: None)


@pytest.fixture
def rail(tmp_path: Path) -> Path:
    """A cell file whose robot stands on a rail."""
    path = tmp_path / "rail.toml"
    assert SOUND.count(COUPLING) == 1
    path.write_text(SOUND.replace(COUPLING, LAYOUT + COUPLING), encoding="utf-8")
    return path


def test_show_lists_the_bounds_and_their_source(call, rail: Path) -> None:
    code, out, _ = call("show", rail)
    told = "".join(out.split())
    assert code == 0
    assert "(-0.4,0.5)chosen:arail" in told
    assert "(-100,-80)" in told


def test_solve_tells_where_the_base_stands_and_keeps_a_plan_that_verifies(call, rail: Path, tmp_path: Path) -> None:
    budget = ["--points", 18, "--solver", "ga", "--evaluations", 1000]
    code, out, err = call("solve", rail, *budget, "--out", tmp_path, "--json")
    found = json.loads(out)
    assert (code, found["verified"]) == (0, True)
    assert "note: bases and placement may move together along x_m" in err
    assert list(found["layout"]) == ["robot_1"]
    plan = load_plan(found["plan"])
    assert plan.cell.stations[0].base.tolist() == pytest.approx(list(found["layout"]["robot_1"].values()))
    assert plan.cell.stations[0].base[0] != 0.0
    assert call("verify", found["plan"])[0] == 0


def test_evaluate_means_the_base_as_the_file_has_it(call, rail: Path) -> None:
    at = ["--at", "0", "-1.0", "0.5", "--points", 18, "--json"]
    free, held = (json.loads(call("evaluate", cell, *at)[1]) for cell in (rail, "robot_positioner"))
    assert free["mmr_mean"] == pytest.approx(held["mmr_mean"], rel=1e-13)


def test_solve_tells_nothing_of_bases_that_are_held(call) -> None:
    ask = ["solve", "robot_positioner", "--points", 18, "--solver", "random_search", "--evaluations", 200, "--json"]
    _, out, err = call(*ask)
    assert json.loads(out)["layout"] == {}
    assert err == ""


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[-0.4, 0.5]", "[0.5, -0.4]", "reversed"),
        ("[-0.4, 0.5]", "[nan, 0.5]", "finite"),
        ("[-0.4, 0.5]", "[3.0, 4.0]", "leaves out the base"),
        ("x_m", "z_m", "no axis 'z_m'"),
    ],
)
def test_bad_layout_is_one_line_and_status_two(call, rail: Path, old: str, new: str, told: str) -> None:
    text = rail.read_text(encoding="utf-8")
    rail.write_text(text.replace(LAYOUT, LAYOUT.replace(old, new, 1)), encoding="utf-8")
    code, out, err = call("solve", rail)
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    for part in ("rail.toml: stations.", "layout", told):
        assert part in err
