"""Solvers on derivatives under equalities of a relaxation, on a problem with a known answer."""

import numpy as np
import pytest

from nlpweld.solvers import Budget, make_solver
from tests.solvers.toys import PEAK, on_parabola

TAKEN = [("ipopt", "default"), ("ipopt", "full"), ("sqpmethod", "default"), ("sqpmethod", "full")]


@pytest.mark.parametrize(("name", "preset"), [*TAKEN, ("slsqp", "default"), ("trust_constr", "default")])
def test_answer_is_the_nearest_point_of_the_curve(name: str, preset: str) -> None:
    outcome = make_solver(name, preset).solve(on_parabola(), seed=0, budget=Budget())
    t = np.linspace(-1, 1, 200_001)
    nearest = t[np.argmin((t - PEAK[0]) ** 2 + (t**2 - PEAK[1]) ** 2)]
    last = outcome.trace[-1].x
    assert last[1] == pytest.approx(last[0] ** 2, abs=1e-6 if name == "trust_constr" else 1e-8)
    assert last[0] == pytest.approx(nearest, abs=1e-4)
