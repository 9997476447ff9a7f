"""Cells with a positioner on the command line: answers, and bad input told in one line that names the place."""

import json
from pathlib import Path

import pytest

from nlpweld.cell.files import LIBRARY

DUAL = (LIBRARY / "cells" / "dual_welder_positioner.toml").read_text(encoding="utf-8")
B = ["--at", "0", "-1.2", "0.5"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("to_m = [0.0, 0.15, 0.5] }", "to_m = [0.3, 0.15, 0.5] }", ["seam", "piece 1", "zero length"]),
        ("side = [0.0, 0.0, 1.0]", "side = [1.0, 0.0, 0.0]", ["seam", "parallel to the tangent of piece 1"]),
        ("angle_deg = 180.0", "angle_deg = -180.0", ["seam", "piece 2", "turns back"]),
        ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 0.0, 0.0]", ["seam", "piece 2", "axis is zero"]),
        ("travel_deg = 85.0, work_deg = -90.0", "travel_deg = 30.0, work_deg = -30.0", ["travel_deg 30", "above 1"]),
        ("mount_rpy_deg = [0.0, 0.0, 180.0]", "mount_rpy_deg = [0.0, 90.0, 0.0]", ["rt_head", "point", "deg"]),
        ('seam = "second"', 'seam = "secnd"', ["robot_2", "did you mean 'second'"]),
        ("points = 72", "points = 71", ["other_seams.second", "run together"]),
        ('rule = "upright"', 'rule = "flat"', ["posture.rule", "upright"]),
        ('reading = "product"', 'reading = "paper"', ["no handlers", "product"]),
        ('robot = "rt_head"', 'robot = "rt_had"', ["rt_had", "rt_head"]),
        ("upper_m = [1.0, -0.8, 0.5]", "upper_m = [-1.0, -1.8, 0.5]", ["search", "every coordinate is held"]),
        ("slope_deg = [-5.0, 5.0]", "slope_deg = [5.0, -5.0]", ["freedom", "slope_deg", "reversed"]),
    ],
)
def test_bad_cell_is_one_line_that_names_the_place(call, tmp_path: Path, old: str, new: str, told: list[str]) -> None:
    assert old in DUAL
    path = tmp_path / "cell.toml"
    path.write_text(DUAL.replace(old, new, 1), encoding="utf-8")
    code, out, err = call("evaluate", str(path), *B)
    assert (code, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    for part in told:
        assert part in err


def test_published_position_is_evaluated_by_name(call) -> None:
    code, out, _ = call("evaluate", "dual_welder_positioner", "--placement", "B", "--json")
    found = json.loads(out)
    assert code == 0
    assert found["mmr_mean"] == pytest.approx(0.212600, abs=6e-7)
    assert found["m_tight_mean"] is None
    assert max(found["closure_m"], found["closure_rad"], found["posture_rad"]) < 1e-9


def test_held_height_cannot_be_asked_for_elsewhere(call) -> None:
    code, out, err = call("evaluate", "dual_welder_positioner", "--at", "0", "-1.2", "0.6")
    assert (code, out) == (2, "")
    assert "z_m is held at 0.5" in err


def test_solve_keeps_a_plan_with_the_positioner_that_verifies(call, tmp_path: Path) -> None:
    command = ["solve", "robot_positioner", "--solver", "ipopt", "--out", str(tmp_path), "--json"]
    code, out, _ = call(*command)
    assert code == 0
    assert json.loads(out)["placement"][2] == 0.5
    plan = json.loads((tmp_path / "plan.json").read_text())
    assert len(plan["paths_rad"]["positioner"][0]) == 2
    assert call("verify", str(tmp_path / "plan.json"))[0] == 0


THREE = (LIBRARY / "cells" / "three_er16.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("formulation", ["reduced", "redundant_spin"])
@pytest.mark.parametrize(
    ("old", "new", "missed"),
    [
        ("singularity_floor_m3 = 0.12", "singularity_floor_m3 = 0.9", "singularity"),
        ("upper_m = [0.6, 0.6, 1.2]", "upper_m = [6.0, 6.0, 6.2]", "reach"),
    ],
    ids=["floor above what the robots give", "out of reach"],
)
def test_infeasible_cell_ends_with_the_nearest_miss_and_no_plan(
    call, tmp_path: Path, old: str, new: str, missed: str, formulation: str
) -> None:
    text = THREE.replace(old, new, 1)
    if missed == "reach":
        text = text.replace("lower_m = [-0.6, -1.0, 0.1]", "lower_m = [5.0, 5.0, 5.1]")
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    command = ["solve", str(tmp_path / "cell.toml"), "--formulation", formulation, "--out", str(tmp_path / "out")]
    code, out, _ = call(*command, "--json")
    found = json.loads(out)
    assert code == 1
    assert (found["status"], found["verified"], found["plan"]) == ("INFEASIBLE", False, None)
    assert missed in {violation["constraint"] for violation in found["violations"]}
    assert not (tmp_path / "out" / "plan.json").exists()


def test_time_limit_ends_with_the_best_so_far_and_the_verifiers_word(call) -> None:
    command = ["solve", "three_er16", "--formulation", "redundant", "--time-limit", "0.1", "--json"]
    found = json.loads(call(*command)[1])
    assert found["status"] == "TIMEOUT"
    assert len(found["placement"]) == 3
    assert found["verified"] is found["feasible"]
