"""Population first, derivatives after: how the two share a budget, and what the population is for."""

from dataclasses import replace

import numpy as np

from nlpweld.solvers import Budget, make_solver
from nlpweld.solvers.population import first_population
from tests.solvers.toys import disc, optimum


def test_the_population_takes_at_most_half_of_the_budget():
    built = []
    nlp = disc(0.4)

    def relax(mode, whole):
        built.append(len(judged))
        return nlp.relax(mode, whole)

    judged = []

    def evaluate(X):
        judged.extend(X)
        return nlp.evaluate(X)

    outcome = make_solver("hybrid").solve(
        replace(nlp, relax=relax, evaluate=evaluate), seed=0, budget=Budget(evaluations=300)
    )
    assert built[0] <= 150
    assert outcome.status == "SOLVED"
    assert np.linalg.norm(outcome.x - optimum(0.4)) < 1e-3


def test_a_needle_that_no_scout_hits_is_found():
    needle = disc(0.01, centre=(0.9, 0.9))
    outcome = make_solver("hybrid").solve(needle, seed=1, budget=Budget())
    scouted = needle.evaluate(needle.starts(1, 256))
    assert not scouted.feasible.any()
    assert outcome.status == "SOLVED"
    assert np.linalg.norm(outcome.x - optimum(0.01, centre=(0.9, 0.9))) < 1e-3


def test_every_mode_is_followed_from_its_best():
    nlp, followed = disc(0.4), []

    def evaluate(X):
        found = nlp.evaluate(X)
        return replace(found, mode=(X[:, 0] > 0.0).astype(int))

    def relax(mode, whole):
        followed.append(mode)
        return nlp.relax(mode, whole)

    make_solver("hybrid").solve(replace(nlp, evaluate=evaluate, relax=relax, n_modes=2), seed=0, budget=Budget())
    assert set(followed) == {0, 1}


def test_where_a_problem_knows_starts_populations_begin_there():
    def sample(seed, count):
        return 0.5 + 1e-3 * np.random.default_rng(seed).random((count, 2))

    corner = replace(disc(), sample=sample)
    assert np.allclose(first_population(corner, 0, 4), 0.5, atol=1e-3)
    for name in ("ga", "de", "pso", "differential_evolution"):
        seen = []

        def evaluate(X, seen=seen):
            seen.extend(X)
            return corner.evaluate(X)

        make_solver(name).solve(replace(corner, evaluate=evaluate), seed=0, budget=Budget(evaluations=50))
        assert np.allclose(seen, 0.5, atol=1e-3)
