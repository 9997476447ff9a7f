"""The paper's genetic algorithm: what it does with infeasible individuals, and when it stops."""

import numpy as np
import pytest

from nlpweld.errors import OptionError
from nlpweld.solvers import Budget, make_solver
from nlpweld.solvers.ga import Ga
from tests.solvers.toys import disc


def test_stops_when_the_mean_fitness_is_still():
    still = Ga(generations=200, mean_change=1e-3).solve(disc(), seed=0, budget=Budget())
    full = Ga(generations=200).solve(disc(), seed=0, budget=Budget())
    assert still.message == "mean objective still"
    assert len(still.trace) < len(full.trace) == 200


def test_individuals_draw_together_and_the_mean_rises():
    trace = Ga().solve(disc(), seed=0, budget=Budget()).trace
    assert trace[-1].spread < 0.2 * trace[0].spread
    assert trace[-1].mean > trace[0].mean


def test_elimination_ignores_how_far_an_individual_misses():
    # a needle of a disc: ranking by violation walks to it, elimination must stumble on it
    needle = disc(0.01, centre=(0.9, 0.9))
    ranked = Ga().solve(needle, seed=1, budget=Budget())
    dropped = Ga(eliminate=True).solve(needle, seed=1, budget=Budget())
    assert ranked.status == "SOLVED"
    assert dropped.status == "INFEASIBLE"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("gaa",), "did you mean 'ga'"),
        (("ga", "papr"), "did you mean 'paper'"),
    ],
)
def test_unknown_names_list_those_there_are(arguments, told):
    with pytest.raises(OptionError, match=told):
        make_solver(*arguments)


@pytest.mark.parametrize(
    ("option", "value"), [("populaton", 5), ("population", "5"), ("population", 5.5), ("crossover", True)]
)
def test_unknown_options_and_wrong_kinds_are_refused(option, value):
    with pytest.raises(OptionError, match=option):
        make_solver("ga", **{option: value})


def test_options_replace_preset_fields():
    solver = make_solver("ga", "paper", population=20, crossover=1)
    assert (solver.population, solver.eliminate, solver.crossover) == (20, True, 1)
    assert np.isclose(make_solver("ga").crossover, 0.8)
