"""Simulation on the command line."""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from nlpweld.plan import Plan

from ..sim.conftest import small_plan
from ..sim.timed import offset


@pytest.fixture(scope="module")
def plan() -> Plan:
    return small_plan("robot_positioner", "nominal", 0.1, 4.0)


@pytest.fixture
def path(plan: Plan, tmp_path: Path) -> Path:
    return plan.save(tmp_path / "timed.json")


def test_a_timed_plan_is_simulated_and_kept_where_nothing_is_in_the_way(call, path: Path, tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")
    before = tmp_path / "sim" / "report.json"
    before.parent.mkdir()
    before.write_text("{}")
    words = ("sim", path, "--from", "1", "--to", "1.2", "--hz", "100", "--out", before.parent, "--json")
    code, out, err = call(*words)
    assert (code, out) == (2, "")
    assert "exists; add --force" in err
    assert before.read_text() == "{}"
    code, out, _ = call(*words, "--force")
    found = json.loads(out)
    assert code == 0
    assert found["holds"]
    assert (found["from_s"], found["until_s"]) == pytest.approx((1.0, 1.2))
    assert all(Path(file).stat().st_size > 0 for file in found["files"])
    assert {Path(file).name for file in found["files"]} >= {
        "report.json", "series.parquet", "cell.xml", "sim_errors.png", "sim_servos.pdf",
    }  # fmt: skip
    assert len(pd.read_parquet(before.with_name("series.parquet"))) == 21
    assert json.loads(before.read_text())["holds"]


def test_a_report_fits_a_terminal_and_a_failure_is_the_exit_status(call, plan: Plan, tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")
    moved = offset(plan, "robot_1", np.array([0.01, 0, 0, 0, 0, 0])).save(tmp_path / "off.json")
    code, out, _ = call("sim", moved, "--to", "0.1")
    assert code == 1
    assert "robot_positioner, 0.000 to 0.100 s" in out
    assert "torch off its weld point: robot_1" in out
    assert max(len(line) for line in out.splitlines()) <= 79


def test_an_untimed_plan_is_told_how_to_be_timed(call, plan: Plan, tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")
    untimed = plan.timed(None).save(tmp_path / "plan.json")
    code, out, err = call("sim", untimed)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err == f"nlpweld: {untimed}: timeline: missing; time it first with 'nlpweld time PLAN --out FILE'\n"


def test_a_missing_extra_is_told_by_its_command(call, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    code, out, err = call("sim", path)
    assert (code, out) == (2, "")
    assert err == "nlpweld: MuJoCo is not installed; bring it with: pip install 'nlpweld[sim]'\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--from", "5"), "from 5 to 4 s is not within the plan's 0 to 4 s"),
        (("--step-ms", "0"), "--step-ms 0 is not above 0"),
        (("--step-ms", "1e-9"), "4000 ms are 4e+12 steps of 1e-09 ms; a simulation takes 1 to 2,000,000"),
        (("--to", "0.0004"), "0.4 ms are 0.4 steps of 1 ms; a simulation takes 1 to 2,000,000"),
        (("--hz", "5000"), "--hz 5000 is not above 0 and at most one per step, 1000"),
    ],
)
def test_options_that_no_simulation_can_have(call, path: Path, words: tuple[str, ...], said: str) -> None:
    pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")
    code, out, err = call("sim", path, *words)
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1


def test_a_plan_of_another_version_is_refused(call, path: Path) -> None:
    path.write_text(path.read_text().replace('"version": 1', '"version": 99', 1))
    code, out, err = call("sim", path)
    assert (code, out) == (2, "")
    assert "version: 99" in err
