"""Which starts Ipopt follows, and when it is content."""

from dataclasses import replace

import numpy as np
import pytest

from nlpweld.solvers import Budget, make_solver
from tests.solvers.toys import strips, two_hills


def test_a_feasible_scout_whose_descent_fails_does_not_end_the_search():
    nlp = two_hills()
    scouts = nlp.evaluate(nlp.starts(0, 2))
    assert scouts.feasible.all()
    assert scouts.objective[0] > scouts.objective[1]
    outcome = make_solver("ipopt", scouts=2).solve(nlp, seed=0, budget=Budget())
    assert outcome.status == "SOLVED"
    assert outcome.objective == pytest.approx(0.97, abs=1e-4)
    assert "2 descents" in outcome.message


def followed(closed, met, **options):
    modes = []
    outcome = make_solver("ipopt", scouts=16, **options).solve(strips(closed, met, modes), seed=0, budget=Budget())
    return list(dict.fromkeys(modes)), outcome


def test_modes_a_sample_never_met_are_not_followed_where_others_are_feasible():
    modes, outcome = followed(closed=(2, 3), met=(0, 1))
    assert modes == [1, 0]
    assert outcome.status == "SOLVED"
    assert "of 4 branch combinations 2 are of branches met" in outcome.message


def test_modes_a_sample_never_met_are_brought_back_when_the_others_end_infeasible():
    modes, outcome = followed(closed=(0, 1, 2, 3), met=(0, 1))
    assert modes == [1, 0, 3, 2]
    assert outcome.status == "INFEASIBLE"


def test_a_mode_that_a_scout_keeps_is_not_in_doubt_whatever_the_sample_says():
    modes, _ = followed(closed=(0,), met=(1,), modes_tried=2)
    assert modes == [3, 2]


def test_a_mode_that_was_met_is_followed_though_no_scout_was_best_on_it():
    nlp = strips(closed=(0, 2, 3), met=(1, 2), followed=(modes := []))
    left = replace(nlp, sample=lambda seed, count: np.full((count, 2), [-0.9, 0.0]))
    outcome = make_solver("ipopt", scouts=4).solve(left, seed=0, budget=Budget())
    assert set(modes) == {1, 2}
    assert outcome.status == "SOLVED"
