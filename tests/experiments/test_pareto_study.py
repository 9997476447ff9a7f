"""The study of fronts: its table from fronts made up, and a small study from end to end."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

import pareto
from pareto import Effort, Pair, front_table, markdown, study

from nlpweld.cell import load_cell
from nlpweld.pareto.aims import AIMS
from nlpweld.pareto.cells import Front, Point

CELL = load_cell("robot_positioner")


def front(*values: tuple[float, float], refused: int = 0) -> Front:
    points = tuple(Point(objective, value, (0.0, -1.0), np.nan, "a - b") for objective, value in values)
    return Front(AIMS["travel_rad"], points, refused)


def made(sweep: Front, nsga2: Front) -> Pair:
    return Pair(CELL, sweep.aim, {"sweep": sweep, "nsga2": nsga2}, {"sweep": 2.0, "nsga2": 1.0})


def test_table_tells_ends_worth_and_who_is_dominated() -> None:
    table = front_table([made(front((2.0, 9.0), (1.0, 5.0)), front((1.8, 9.0), (0.9, 4.0), refused=3))])
    first, second = (row for _, row in table.iterrows())
    assert (first.objective_best, first.objective_best_at, first.aim_best, first.aim_best_at) == (2.0, 9.0, 5.0, 1.0)
    assert (first.regret_percent, second.regret_percent) == pytest.approx((0.0, 10.0))
    assert (first.dominated_percent, second.dominated_percent) == (0.0, 50.0)  # less travel is better
    assert first.hypervolume > second.hypervolume > 0.0
    assert second.refused == 3


def test_table_has_no_area_of_single_points_and_lives_with_an_empty_front() -> None:
    alone = front_table([made(front((2.0, 9.0)), front((1.0, 9.0)))])
    assert alone.hypervolume.isna().all()
    assert alone.dominated_percent.tolist() == [0.0, 100.0]
    empty = front_table([made(front((2.0, 9.0), (1.0, 5.0)), front(refused=2))])
    assert empty.hypervolume[1] == 0.0
    assert np.isnan(empty.objective_best[1])
    assert markdown(empty).count("\n") == 4


def test_study_from_end_to_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pareto, "AIMS", {"manipulability_m3": AIMS["manipulability_m3"]})
    cell = CELL.with_(seam={"points": 12})
    table = study(tmp_path, [cell], Effort(2, 6, 3), Console(quiet=True))
    points = pd.read_csv(tmp_path / "data" / "points.csv")
    assert table.points.tolist() == [(points.method == method).sum() for method in ("sweep", "nsga2")]
    assert (tmp_path / "figures" / "pareto_robot_positioner.png").stat().st_size > 10_000
    assert "NaN" not in (tmp_path / "tables" / "pareto.md").read_text()
    assert np.isfinite(points[["objective", "value", "x_m", "y_m"]]).all(axis=None)
