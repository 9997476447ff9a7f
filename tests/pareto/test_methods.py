"""Both methods on a toy whose front is known: a straight line between two points."""

import numpy as np

from nlpweld.formulation.nlp import Nlp
from nlpweld.pareto.front import non_dominated
from nlpweld.pareto.nsga import nsga
from nlpweld.pareto.sweep import Found, farthest, sweep, unverified
from tests.pareto import toys
from tests.solvers.toys import disc


def values(X: np.ndarray) -> np.ndarray:
    return np.column_stack([toys.hill().evaluate(X).objective, toys.nearer_to_other(X, np.zeros(len(X)))])


def test_sweep_finds_the_known_front() -> None:
    levels = toys.levels(7)
    found = sweep(toys.keeping, levels, unverified)
    X = np.array([one.x for one in found])
    assert np.abs(toys.off_front(values(X))).max() < 1e-3
    assert np.abs(values(X)[:, 1] - levels).max() < 2e-3
    assert (values(X)[:, 1] >= levels).all()


def test_sweep_is_monotone_and_not_dominated() -> None:
    told = []
    found = sweep(toys.keeping, toys.levels(7), unverified, lambda: told.append(1))
    assert np.diff([one.objective for one in found]).max() < 0.0
    assert len(non_dominated(values(np.array([one.x for one in found])))) == len(told) == 7


def test_sweep_goes_on_where_a_level_cannot_be_kept() -> None:
    found = sweep(toys.keeping, [-0.2, 0.5, -0.1], unverified)
    assert [one is None for one in found] == [False, True, False]


def test_sweep_keeps_the_better_of_two_starts() -> None:
    worth, asked = [1.0, 0.5, 0.7, 0.2, 0.6], []

    def solve(nlp: Nlp) -> Found:
        asked.append(nlp.sample is not None)
        return Found(np.zeros(2), 0, worth[len(asked) - 1])

    found = sweep(toys.keeping, [-0.5, -0.3, -0.1], solve)
    assert asked == [False, False, True, False, True]  # from the second level on from the last answer, too
    assert [one.objective for one in found] == [1.0, 0.7, 0.6]


def test_nsga_finds_the_known_front() -> None:
    X = nsga(toys.hill(), toys.nearer_to_other, population=40, generations=60)
    assert len(X) == 40
    off = toys.off_front(values(X))
    assert (off > -1e-12).all()
    assert np.median(off) < 0.01
    assert off.max() < 0.05
    assert len(non_dominated(values(X))) == len(X)
    assert np.abs(X[values(X)[:, 0].argmax()] - toys.PEAK).max() < 0.02  # the ends are the single optima
    assert np.abs(X[values(X)[:, 1].argmax()] - toys.OTHER).max() < 0.02


def test_nsga_is_the_same_for_a_seed() -> None:
    first, again, other = (nsga(toys.hill(), toys.nearer_to_other, 8, 5, seed) for seed in (3, 3, 4))
    assert (first == again).all()
    assert first.shape != other.shape or (first != other).any()


def test_nsga_keeps_constraints_and_asks_no_second_value_of_infeasible_candidates() -> None:
    narrow = disc(0.3)

    def second(X: np.ndarray, mode: np.ndarray) -> np.ndarray:
        assert narrow.evaluate(X).feasible.all()
        return toys.nearer_to_other(X, mode)

    X = nsga(narrow, second, 16, 15)
    assert len(X)
    assert narrow.evaluate(X).feasible.all()


def test_nsga_of_what_cannot_be_is_empty() -> None:
    assert nsga(disc(-1.0), toys.nearer_to_other, 8, 3).shape == (0, 2)


def test_farthest_is_the_second_values_own_optimum() -> None:
    assert np.abs(farthest(toys.hill(), toys.nearer_to_other) - toys.OTHER).max() < 1e-3
    assert farthest(disc(-1.0), toys.nearer_to_other) is None
