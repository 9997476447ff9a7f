"""The loop that solvers on derivatives share: when a descent is followed by another."""

from dataclasses import replace

import numpy as np
import pytest

from nlpweld.solvers import Budget, make_solver
from nlpweld.solvers.sqpmethod import QP
from tests.solvers.toys import disc, lying, optimum

AWAY = np.array([-0.6, -0.5])


@pytest.mark.parametrize("name", ["ipopt", "sqpmethod", "slsqp"])
def test_descents_that_end_below_the_best_scout_are_followed_by_others(name):
    honest = make_solver(name).solve(disc(), seed=0, budget=Budget())
    outcome = make_solver(name).solve(lying(disc(), disc(peak=AWAY)), seed=0, budget=Budget())
    assert "; 1 descents" in honest.message
    assert "; 10 descents" in outcome.message
    assert outcome.status == "SOLVED"
    assert np.linalg.norm(outcome.x - optimum(0.5)) < 0.2  # the scout's


def test_a_descent_that_fails_after_a_feasible_scout_is_followed_by_others():
    outcome = make_solver("ipopt").solve(lying(disc(), disc(centre=(5.0, 5.0))), seed=0, budget=Budget())
    assert "; 10 descents" in outcome.message


def test_a_spent_budget_begins_no_descent():
    def relax(mode, whole):
        raise AssertionError("built in vain")

    outcome = make_solver("ipopt").solve(replace(disc(), relax=relax), seed=0, budget=Budget(evaluations=100))
    assert outcome.message == "evaluation limit before the first descent"
    assert outcome.evaluations == 100


def test_every_solve_leaves_its_price():
    outcome = make_solver("slsqp").solve(disc(0.4), seed=0, budget=Budget())
    sharpness = [step["sharpness"] for step in outcome.sharpening]
    assert np.allclose(np.diff(np.log10(sharpness)), 1.0)
    assert abs(outcome.sharpening[-1]["smooth"] - outcome.sharpening[-1]["exact"]) < 1e-3


@pytest.mark.parametrize("qp", QP)
def test_every_qp_plugin_leads_to_the_optimum_in_silence(qp, capfd):
    solver = make_solver("sqpmethod", qp=qp)
    reason = solver.unsuitable(disc())
    if reason:
        pytest.skip(reason)
    outcome = solver.solve(disc(0.4), seed=0, budget=Budget())
    assert np.linalg.norm(outcome.x - optimum(0.4)) < 1e-3
    assert capfd.readouterr().out == ""


def test_a_missing_qp_plugin_is_a_reason_that_lists_those_there_are():
    reason = make_solver("sqpmethod", qp="gurobi").unsuitable(disc())
    assert "no QP plugin 'gurobi'" in reason
    assert "qrqp" in reason


def test_a_missing_package_is_a_reason(monkeypatch):
    monkeypatch.setattr("nlpweld.solvers.cmaes.find_spec", lambda name: None)
    assert make_solver("cmaes").unsuitable(disc()) == "package 'cma' is not installed"
