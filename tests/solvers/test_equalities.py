"""Ipopt under equalities of a relaxation, on a problem with a known answer."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nlpweld.formulation.nlp import Equalities, Nlp, Relaxation
from nlpweld.solvers import Budget, make_solver
from tests.solvers.toys import PEAK, disc


def on_parabola() -> Nlp:
    """The disc of the toys, wide enough not to matter, on the curve y = x^2."""
    free = disc(2.0)

    def relax(mode: int, whole: bool) -> Relaxation:
        relaxed = free.relax(mode, whole)
        x, p, lam_f, lam_g = ca.MX.sym("x", 2), ca.MX.sym("p"), ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 1)
        g = x[1] - x[0] ** 2
        upper = ca.triu(lam_f * relaxed.hessian(x, p) + lam_g * ca.hessian(g, x)[0])
        equalities = Equalities(
            ca.Function("g", [x], [g]),
            ca.Function("j", [x], [ca.jacobian(g, x)]),
            ca.Function("h", [x, p, lam_f, lam_g], [upper]),
        )
        return replace(relaxed, equalities=equalities)

    return replace(free, relax=relax)


@pytest.mark.parametrize("preset", ["default", "full"])
def test_answer_is_the_nearest_point_of_the_curve(preset: str) -> None:
    outcome = make_solver("ipopt", preset).solve(on_parabola(), seed=0, budget=Budget())
    t = np.linspace(-1, 1, 200_001)
    nearest = t[np.argmin((t - PEAK[0]) ** 2 + (t**2 - PEAK[1]) ** 2)]
    last = outcome.trace[-1].x
    assert last[1] == pytest.approx(last[0] ** 2, abs=1e-8)
    assert last[0] == pytest.approx(nearest, abs=1e-4)
