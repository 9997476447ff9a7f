"""The simulation study: chains opened smoothly, and rows of reports."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

from simulation import markdown, numbers, opened

from nlpweld.sim.simulate import simulate
from tests.sim.conftest import QUICK, small_plan
from tests.sim.timed import timed


def test_a_chain_is_opened_smoothly_and_stays_open() -> None:
    plan = timed(small_plan("robot_positioner", "nominal", 0.1, 4.0), 20.0, 21)
    moved, t = opened(plan, "robot_1", 1e-3), np.array([8.0, 10.0, 12.0])
    assert plan.timeline is not None
    assert moved.timeline is not None
    off = [moved.timeline.at(t, k)["robot_1"] - plan.timeline.at(t, k)["robot_1"] for k in range(3)]
    assert off[0][:, 0] == pytest.approx([0, 0.5e-3, 1e-3])
    assert off[1][:, 0] == pytest.approx([0, 0.9375e-3, 0], abs=1e-12)
    assert np.abs(off[0][:, 1:]).max() == 0
    assert moved.timeline.at(t)["positioner"] == pytest.approx(plan.timeline.at(t)["positioner"])


def test_a_row_tells_what_a_report_does() -> None:
    pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")
    report = simulate(small_plan("robot_positioner", "nominal", 0.1, 4.0), QUICK, (0.0, 0.1)).report
    row = numbers(report)
    assert row["holds"] is True
    assert row["torch_mm"] == 1e3 * report.torches["robot_1"].seam_m.value
    assert np.isnan(row["drift_um"])
    text = markdown(pd.DataFrame([row])).splitlines()
    assert len(text) == 3
    assert text[2].split("|")[3].strip() == ""
