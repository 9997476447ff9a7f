"""Palletising on the command line: totals, tables, JSON, and bad input in one line."""

import json
from pathlib import Path

import pandas as pd
import pytest

from nlpweld.cell.files import LIBRARY

SOUND = (LIBRARY / "palletising" / "cao_25_boxes.toml").read_text(encoding="utf-8")


@pytest.fixture
def low(tmp_path: Path) -> Path:
    """A task of one layer."""
    path = tmp_path / "low.toml"
    path.write_text(SOUND.replace("layers = 5", "layers = 1"), encoding="utf-8")
    return path


def test_totals_and_boxes_are_printed_beside_the_closed_form(call) -> None:
    code, out, _ = call("palletize", "--solver", "slsqp")
    assert code == 0
    assert "before 107.859 s, after 91.856 s: 14.84 % less" in out
    assert "stated as planned 107.854 s and 91.850 s" in out
    rows = [line.split() for line in out.splitlines() if "plateau" in line or "crossing" in line]
    assert len(rows) == 25
    assert rows[0][:5] == ["1", "1", "0.40", "4.622", "3.981"]


def test_json_and_tables_hold_the_same_numbers(call, low: Path, tmp_path: Path) -> None:
    code, out, err = call("palletize", low, "--json", "--out", tmp_path / "out", "--seed", 3)
    found = json.loads(out)
    assert (code, err) == (0, "")
    assert (found["task"], found["solver"], found["seed"]) == ("low", "ipopt", 3)
    assert found["before_s"] == pytest.approx(sum(box["before_s"] for box in found["boxes"]))
    assert found["worst_regret_s"] < 1e-8
    boxes = pd.read_csv(tmp_path / "out" / "boxes.csv")
    assert boxes.after_s.tolist() == pytest.approx([box["after_s"] for box in found["boxes"]])
    assert pd.read_csv(tmp_path / "out" / "layers.csv").after_s.sum() == pytest.approx(found["after_s"])


def test_a_solver_that_misses_the_optimum_is_a_no(call, low: Path) -> None:
    quick = low.read_text().replace("speed_deg_s = 120.0", "speed_deg_s = 400.0")
    low.write_text(quick.replace("acceleration_deg_s2 = 500.0", "acceleration_deg_s2 = 5000.0"))
    code, out, _ = call("palletize", low, "--solver", "random_search", "--json")
    found = json.loads(out)
    assert code == 1
    assert found["worst_regret_s"] > 1e-6
    assert {"crossing", "lowest"} & {box["case"] for box in found["boxes"]}


def test_a_lower_mast_takes_longer(call, low: Path) -> None:
    found = [json.loads(call("palletize", low, "--z-a", z, "--solver", "slsqp", "--json")[1]) for z in (1.0, 2.0)]
    assert found[0]["after_s"] > found[1]["after_s"] + 1e-3
    assert {box["z_max_m"] for box in found[0]["boxes"]} == {1.0}


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--z-a", "1.2"], "--z-a: cycle.z_a_m 1.2 is under the 1.4 m"),
        (["--z-a", "nan"], "--z-a: input should be a finite number"),
        (["--z-a", "1.4"], "no room above 1.4 m"),
        (["--solver", "ipot"], "did you mean 'ipopt'"),
        (["--solver", "ipopt:no"], "preset 'no' is unknown"),
        (["nothing"], "there are cao_25_boxes"),
        (["--seed", "-1"], "--seed"),
    ],
)
def test_bad_input_is_one_line_and_status_two(call, arguments: list[str], told: str) -> None:
    code, out, err = call("palletize", *arguments)
    assert (code, out) == (2, "")
    assert told in err
    assert len([line for line in err.splitlines() if line.startswith("nlpweld:")]) == 1


def test_an_out_that_is_a_file_is_refused_before_any_work(call, low: Path) -> None:
    code, _, err = call("palletize", low, "--out", low)
    assert code == 2
    assert "is a file" in err
    assert "z_max" not in err  # the bar of a solver at work
