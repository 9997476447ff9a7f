"""The exact model as one number: its order, and its stop."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.formulation.nlp import Evaluation
from nlpweld.solvers import Budget, make_solver
from nlpweld.solvers.base import Incumbent
from nlpweld.solvers.scalar import Scalar, Spent, costs
from tests.solvers.toys import disc


def evaluation(objective, total):
    return Evaluation(np.array(objective), np.array(total)[:, None], np.zeros(len(total), dtype=int))


def test_feasible_first_then_by_objective_then_by_violation():
    found = evaluation([0.2, 0.3, 9.0, -np.inf, 5.0], [0.0, 0.0, 0.1, 2.0, 0.5])
    assert np.argsort(costs(found)).tolist() == [1, 0, 2, 4, 3]


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=6, unique=True))
def test_no_objective_is_so_low_that_an_infeasible_candidate_comes_before_it(objectives):
    found = evaluation([*objectives, 0.0], [*([0.0] * len(objectives)), 1e-12])
    cost = costs(found)
    assert np.argmax(cost) == len(objectives)
    assert (np.diff(cost[np.argsort(objectives)]) <= 0.0).all()


def test_a_weighted_violation_is_a_continuous_price():
    found = evaluation([0.3, 0.3, 0.3, -np.inf], [0.0, 1e-9, 0.1, 1e-9])
    cost = costs(found, weight=1.0)
    assert cost[1] == pytest.approx(cost[0], abs=1e-8)
    assert cost[0] < cost[1] < cost[2] < cost[3]


def test_a_generation_that_would_exceed_the_budget_is_not_judged():
    search = Incumbent(disc())
    cost = Scalar(search, Budget(evaluations=10))
    cost.costs(np.zeros((6, 2)))
    with pytest.raises(Spent, match="evaluation limit"):
        cost.costs(np.zeros((5, 2)))
    assert search.evaluations == 6


def test_direct_begins_in_the_middle_with_seed_zero_and_elsewhere_with_another():
    first = [make_solver("direct").solve(disc(), seed=s, budget=Budget(evaluations=50)).trace[0].x for s in (0, 1)]
    assert np.allclose(first[0], 0.0)
    assert not np.allclose(first[1], 0.0)


@pytest.mark.parametrize("name", ["shgo", "cmaes", "slsqp"])
def test_too_many_variables_are_declined_with_the_option_that_says_so(name):
    assert "'largest' is 1" in make_solver(name, largest=1).unsuitable(disc())
