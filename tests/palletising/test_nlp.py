"""The height of a cycle as solvers see it: the same times, exact slopes, and answers beside the closed form."""

import pickle

import casadi as ca
import numpy as np
import pytest

from nlpweld.errors import OptionError
from nlpweld.palletising import load_pallet_task, palletize
from nlpweld.palletising.cycle import after
from nlpweld.palletising.nlp import height_nlp, time_graph
from nlpweld.palletising.totals import solved
from nlpweld.solvers import Budget, make_solver, solver_names
from tests.palletising.helpers import random_legs

PLATEAU, CROSSING = 0, 15
ON_SLOPES = ("hybrid", "ipopt", "slsqp", "sqpmethod", "trust_constr")
NEAR_S = dict.fromkeys(ON_SLOPES, 1e-8) | {"cmaes": 1e-6, "differential_evolution": 1e-5}
POOR_S = 1e-3  # what is left to those that stop early or know no slopes


@pytest.fixture(scope="module")
def task():
    return load_pallet_task()


@pytest.fixture(scope="module")
def best(task):
    return palletize(task).boxes


def test_graphs_take_the_same_times_and_have_their_slopes() -> None:
    rng, z = np.random.default_rng(5), ca.SX.sym("z")
    legs = random_legs(rng, 40)
    for box in range(40):
        leg = legs.of(box)
        limits = type(leg.lift)(*(bound[box] for bound in (leg.lift.velocity, leg.lift.acceleration, leg.lift.jerk)))
        leg = type(leg)(leg.z_0, leg.z_1, leg.z_2, leg.z_3, leg.beside_s, limits)
        outs = time_graph(leg, z)
        f = ca.Function("f", [z], [*outs, *(ca.gradient(out, z) for out in outs)])
        at = leg.lowest_m + rng.uniform(1e-3, 1.3, 40) ** 2
        lift, wait, lift_slope, wait_slope = (np.array(v).ravel() for v in f(at[None]))
        stages, h = after(leg, at), 1e-6
        np.testing.assert_allclose(lift, stages.up_s + stages.lift_s + stages.down_s, rtol=1e-12)
        np.testing.assert_allclose(wait, stages.up_s + stages.down_s + leg.beside_s, rtol=1e-12)
        for k, slope in ((0, lift_slope), (1, wait_slope)):
            differences = (np.array(f(at[None] + h)[k]) - np.array(f(at[None] - h)[k])).ravel() / (2 * h)
            good = np.abs(differences - slope) < 1e-3 * (1 + np.abs(slope))
            assert good.mean() > 0.94  # all but those beside a kink


@pytest.mark.parametrize("name", [name for name in solver_names() if name != "multistart"])
def test_every_solver_takes_both_cases_through_the_same_door(task, best, name: str) -> None:
    for box in (PLATEAU, CROSSING):
        found = solved(task, box, make_solver(name), 0, Budget(evaluations=400))
        regret = found["solver_s"] - best.after_s[box]
        assert -1e-12 < regret < NEAR_S.get(name, POOR_S)
        again = task.legs * after_at(task, box, found["solver_z_m"])
        assert found["solver_s"] == pytest.approx(again, rel=1e-15)


def after_at(task, box: int, z: float) -> float:
    from nlpweld.palletising.cycle import legs

    return float(after(legs(task).of(box), np.array([z])).total_s[0])


def test_the_lowest_of_equal_heights_is_found_by_what_height_costs(task, best) -> None:
    made = make_solver("differential_evolution")
    outcome = made.solve(height_nlp(task, PLATEAU), seed=0, budget=Budget(evaluations=1500))
    assert abs(outcome.x[0] - best.z_max_m[PLATEAU]) < 1e-3
    free = made.solve(height_nlp(task, PLATEAU, low_s_per_m=0.0), seed=0, budget=Budget(evaluations=1500))
    assert best.z_max_m[PLATEAU] <= free.x[0] <= best.z_most_m[PLATEAU]


@pytest.mark.parametrize("seed", range(2))
def test_cmaes_takes_a_single_variable_of_any_spread(task, best, seed: int) -> None:
    found = solved(task, PLATEAU, make_solver("cmaes", sigma=0.6), seed, Budget(evaluations=400))
    assert found["solver_s"] - best.after_s[PLATEAU] < 1e-8


def test_other_processes_can_build_the_problem_again(task) -> None:
    nlp = height_nlp(task, CROSSING)
    again = pickle.loads(pickle.dumps(nlp.rebuild))()
    X = np.linspace(nlp.lower, nlp.upper, 5)
    assert again.evaluate(X).objective.tolist() == nlp.evaluate(X).objective.tolist()


def test_a_top_without_room_is_refused(task) -> None:
    tight = task.with_(cycle={"z_a_m": 1.4})
    assert palletize(tight).boxes.z_max_m.max() == pytest.approx(1.4)
    with pytest.raises(OptionError, match=r"no room above 1\.4 m"):
        height_nlp(tight, 24)


def test_totals_with_a_solver_stand_beside_the_closed_form(task) -> None:
    small = task.with_(stack={"layers": 1})
    heard: list[int] = []
    found = palletize(small, make_solver("slsqp"), told=heard.append)
    assert heard == list(range(5))
    assert found.totals_s["solver"] == pytest.approx(found.totals_s["after"], abs=1e-6)
    assert found.layers.before_s.sum() == pytest.approx(found.totals_s["before"])
    assert found.boxes.regret_s.abs().max() < 1e-6
