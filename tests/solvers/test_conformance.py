"""Laws that every discovered solver keeps, on problems with known answers."""

import time
from dataclasses import replace

import numpy as np
import pytest

from nlpweld.solvers import Budget, make_solver, presets, solver_names
from tests.solvers.toys import disc, optimum

EVERY = [(name, preset) for name in solver_names() for preset in presets(name)]
PARTLY = 0.4  # radius of the disc: its rim, not the peak, is the answer


def solve(name, preset, nlp, seed=0, budget=None):
    return make_solver(name, preset).solve(nlp, seed=seed, budget=budget or Budget())


def test_the_paper_s_solvers_are_there():
    assert {"ga", "ipopt", "random_search"} <= set(solver_names())


@pytest.mark.parametrize(("name", "preset"), EVERY)
@pytest.mark.parametrize("radius", [PARTLY, 0.9])
def test_finds_the_known_optimum(name, preset, radius):
    outcome = solve(name, preset, disc(radius))
    assert outcome.status == "SOLVED"
    near = 0.05 if name == "random_search" else 0.01
    assert np.linalg.norm(outcome.x - optimum(radius)) < near


@pytest.mark.parametrize(("name", "preset"), EVERY)
def test_the_claimed_objective_is_the_exact_one(name, preset):
    nlp = disc(PARTLY)
    outcome = solve(name, preset, nlp)
    found = nlp.evaluate(outcome.x[None])
    assert outcome.objective == found.objective[0]
    assert found.feasible[0]


@pytest.mark.parametrize(("name", "preset"), EVERY)
def test_says_infeasible_when_nothing_is_feasible(name, preset):
    outcome = solve(name, preset, disc(-0.5))
    assert outcome.status == "INFEASIBLE"


@pytest.mark.parametrize(("name", "preset"), EVERY)
def test_same_seed_same_answer_and_other_seed_another_course(name, preset):
    nlp = disc(PARTLY)
    first, again, other = (solve(name, preset, nlp, seed) for seed in (3, 3, 4))
    assert np.array_equal(first.x, again.x)
    assert first.evaluations == again.evaluations
    assert not np.array_equal(first.trace[0].x, other.trace[0].x)


@pytest.mark.parametrize(("name", "preset"), EVERY)
def test_stays_in_the_box_and_counts_every_candidate(name, preset):
    seen = []
    nlp = disc(0.9, peak=np.array([2.0, 2.0]), centre=(1.0, 1.0))  # the pull is out of the box

    def recording(X):
        seen.extend(X)
        return nlp.evaluate(X)

    outcome = solve(name, preset, replace(nlp, evaluate=recording))
    assert (np.abs(seen) <= 1.0).all()
    assert np.allclose(outcome.x, 1.0, atol=0.05)
    assert outcome.evaluations >= len(seen)


@pytest.mark.parametrize(("name", "preset"), EVERY)
@pytest.mark.parametrize("limit", [120, 280])
def test_a_budget_of_evaluations_is_kept(name, preset, limit):
    outcome = solve(name, preset, disc(PARTLY), budget=Budget(evaluations=limit))
    least = 1 if name == "ipopt" else limit - 50
    assert least <= outcome.evaluations <= limit + 2  # Ipopt has its first and last iterate judged, too
    assert outcome.status == "SOLVED"


def test_ipopt_stopped_by_its_budget_says_so():
    outcome = solve("ipopt", "plain", disc(PARTLY), budget=Budget(evaluations=6))
    assert "evaluation limit" in outcome.message
    assert outcome.evaluations <= 8


@pytest.mark.parametrize(("name", "preset"), EVERY)
def test_a_time_limit_ends_in_timeout_with_the_best_so_far(name, preset):
    nlp = disc(PARTLY)

    def slow(X):
        time.sleep(0.06)
        return nlp.evaluate(X)

    outcome = solve(name, preset, replace(nlp, evaluate=slow), budget=Budget(time_s=0.05))
    assert outcome.status == "TIMEOUT"
    assert outcome.x is not None


@pytest.mark.parametrize(("name", "preset"), EVERY)
def test_the_trace_never_gets_worse(name, preset):
    best = [step.best for step in solve(name, preset, disc(PARTLY)).trace if np.isfinite(step.best)]
    assert len(best) >= 1
    assert (np.diff(best) >= 0).all()


def test_ipopt_declines_what_has_no_derivatives():
    assert "no derivatives" in make_solver("ipopt").unsuitable(replace(disc(), relax=None))
