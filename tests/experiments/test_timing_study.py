"""The study of cycle times: plans kept, speeds asked, and what the verifier says of each."""

import sys
from argparse import Namespace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import timing
from timing import Case, at_speed, draw, study

from nlpweld.bench.answer import evaluate_plan
from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.reduced import reduced


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> Cell:
    """A small cell that the study takes for its own."""
    small = load_cell("three_er16").with_(seam={"points": 18}, constraints={"verify_step_m": 0.02})
    monkeypatch.setattr(timing, "load_cell", lambda name: small)
    monkeypatch.setattr(timing, "PLANS", [("three_er16", "paper")])
    return small


def test_a_plan_is_timed_at_every_speed_and_verified(cell: Cell, tmp_path: Path) -> None:
    chosen = Namespace(out=tmp_path, cells=["three_er16"], speeds=2, no_figures=True)
    text = study(chosen, Console(quiet=True))
    table = pd.read_csv(tmp_path / "tables" / "timing.csv")
    assert table.torch_mm_s.tolist() == [8.0, 30.0]
    assert table.verified.all()
    assert (table.cycle_s - table.arc_on_s - table.off_seam_s).abs().max() < 1e-3
    assert (table.arc_on_s > table.quickest_s).all()
    assert table.arc_on_s[0] / table.arc_on_s[1] == pytest.approx(30 / 8, rel=0.02)
    assert text.count("\n") == 4


def test_a_plan_is_found_once_and_again_for_another_cell(cell: Cell, tmp_path: Path) -> None:
    case, found = Case("three_er16", "paper"), []
    own = timing.evaluate_plan
    timing.evaluate_plan = lambda *args: found.append(1) or own(*args)
    try:
        plans = [case.plan(tmp_path) for _ in range(2)]
        timing.load_cell = lambda name: cell.with_(constraints={"verify_step_m": 0.03})
        case.plan(tmp_path)
    finally:
        timing.evaluate_plan = own
    assert len(found) == 2
    assert np.array_equal(plans[0].paths["welder"], plans[1].paths["welder"])


def test_a_faster_torch_is_at_its_speed_as_soon_as_before(cell: Cell) -> None:
    plan, _ = evaluate_plan(reduced(cell, "numpy"), np.array([0.023, -0.266, 0.404]))
    own, fast = (one.cell.timing.torch for one in (plan, at_speed(plan, 0.08)))
    assert fast.speed_m_s == pytest.approx(0.08)
    assert fast.speed_m_s / fast.acceleration_m_s2 == pytest.approx(own.speed_m_s / own.acceleration_m_s2)
    assert fast.acceleration_m_s2 / fast.jerk_m_s3 == pytest.approx(own.acceleration_m_s2 / own.jerk_m_s3)


def test_figure_has_a_line_for_every_plan_and_one_for_none_bound() -> None:
    rows = [
        {"cell": cell, "plan": plan, "torch_mm_s": speed, "arc_on_s": 1 / speed}
        for cell in ("a", "b")
        for plan in ("paper", "optimum")
        for speed in (8.0, 80.0)
    ]
    fig = draw(pd.DataFrame(rows))
    assert [len(axes.lines) for axes in fig.axes] == [3, 3]
    assert {text.get_text() for text in fig.axes[0].get_legend().texts} == {"paper", "optimum", "if nothing bound"}
