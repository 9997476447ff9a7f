"""Fronts of a cell by both methods: verified, not dominated, monotone, from one single optimum to the other."""

from dataclasses import replace

import numpy as np
import pytest

from nlpweld.bench.answer import evaluate_plan, solve
from nlpweld.cell import load_cell
from nlpweld.pareto import cells, sweep
from nlpweld.pareto.aims import AIMS
from nlpweld.pareto.cells import Front, Trade, by_nsga, by_sweep
from nlpweld.pareto.front import dominated, hypervolumes, non_dominated

TRADING = ("manipulability_m3", "travel_rad")  # against the objective; clearance is the same everywhere


@pytest.fixture(scope="module")
def trades() -> dict[str, Trade]:
    cell = load_cell("robot_positioner").with_(seam={"points": 24})
    return {name: Trade(cell, aim) for name, aim in AIMS.items()}


@pytest.fixture(scope="module")
def swept(trades: dict[str, Trade]) -> dict[str, Front]:
    return {name: by_sweep(trade, 3) for name, trade in trades.items()}


@pytest.fixture(scope="module")
def evolved(trades: dict[str, Trade]) -> dict[str, Front]:
    return {name: by_nsga(trades[name], 16, 20) for name in TRADING}


@pytest.mark.parametrize("name", TRADING)
def test_sweep_is_monotone_keeps_its_levels_and_is_verified(name: str, swept: dict, trades: dict) -> None:
    front, sense = swept[name], AIMS[name].sense
    assert len(front.points) == 4
    assert front.refused == front.behind == 0
    assert np.diff([point.objective for point in front.points]).max() < 0.0
    assert np.diff(front.values[:, 1]).min() > 0.0
    for point in front.points[1:3]:
        assert sense * point.value >= point.level - trades[name].margin
        assert evaluate_plan(trades[name].nlp, np.array(point.x))[1].feasible


@pytest.mark.parametrize("name", TRADING)
def test_single_optimum_is_the_end_of_both_fronts(name: str, swept: dict, evolved: dict, trades: dict) -> None:
    best = solve(trades[name].nlp, "ipopt").report.objective
    assert swept[name].points[0].objective == pytest.approx(best, rel=1e-9)
    assert evolved[name].points[0].objective == pytest.approx(best, rel=1e-3)


@pytest.mark.parametrize("name", TRADING)
def test_both_fronts_are_not_dominated_and_close(name: str, swept: dict, evolved: dict) -> None:
    for front in (swept[name], evolved[name]):
        assert len(non_dominated(front.values)) == len(front.points) > 0
    both = np.vstack([swept[name].values, evolved[name].values])
    by_both, by_evolution = hypervolumes([both, evolved[name].values])
    assert by_evolution > 0.95 * by_both
    assert not dominated(swept[name].values, by=evolved[name].values).any()


def test_front_is_one_point_where_the_optimum_is_best_in_both(swept: dict) -> None:
    assert len(swept["clearance_m"].points) == 1  # the torch keeps its distance from the work wherever it stands
    assert len(swept["quickest_s"].points) == 1  # and the rotator is slower than any joint of the robot


def test_same_seed_same_front(trades: dict) -> None:
    first, again = (by_nsga(trades["travel_rad"], 6, 4, seed=2) for _ in range(2))
    assert first.points == again.points


def test_what_the_verifier_refuses_is_dropped_and_counted(trades: dict, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def strict(nlp, x):
        plan, report = evaluate_plan(nlp, x)
        seen.append(x)
        return plan, replace(report, feasible=len(seen) % 2 == 0)

    monkeypatch.setattr(cells, "evaluate_plan", strict)
    front = by_nsga(trades["travel_rad"], 8, 4)
    assert front.refused == (len(seen) + 1) // 2
    assert len(front.points) + front.behind == len(seen) // 2


def test_answer_that_misses_a_level_the_cell_has_none_of_does_not_count(
    trades: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = solve(trades["clearance_m"].nlp, "random_search", candidates=100)
    told = [answer, replace(answer, outcome=replace(answer.outcome, status="INFEASIBLE"))]
    assert all(one.verified for one in told)  # the verifier knows nothing of that level
    monkeypatch.setattr(sweep, "solve_verified", lambda *_, **__: told.pop(0))
    assert sweep.verified(trades["clearance_m"].nlp) is not None
    assert sweep.verified(trades["clearance_m"].nlp) is None
