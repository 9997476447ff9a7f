"""Jets give what CasADi's derivatives give: value, gradient and Hessian of every operation and of the whole term."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.engine.jets import summed_jet
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.derivatives import by_casadi, by_jets
from nlpweld.formulation.smooth import all_gaps, relaxation, term_function
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.seam import seam_parameters

FRONT = (("front", "up"),) * 3
POINTS = np.array([[0.3, 1.2, 0.7], [-0.4, 0.5, 2.0]])

x, point, s = ca.SX.sym("x", 3), ca.SX.sym("point", 2), ca.SX.sym("s")
inner = x[0] * x[1] + x[2] ** 2 + point[0]  # positive at the test's x
EXPRESSIONS = {
    "sum and difference": inner + x[0] * point[1] - (point[0] - x[1]),
    "number first": point[0] - inner + (2 + x[1]),
    "product": inner * (x[1] + point[1]),
    "product with data": point[1] * inner + x[0] * point[0],
    "quotient": inner / (1 + x[0] ** 2 * point[0]),
    "quotient of data": point[1] / inner,
    "quotient by data": inner / point[0],
    "reciprocal": 1 / inner,
    "negative and twice": -(inner + inner),
    "square": inner**2,
    "square root": ca.sqrt(inner),
    "power": inner ** (-0.5),
    "exponential": ca.exp(-inner),
    "sine": ca.sin(inner * x[1]),
    "cosine": ca.cos(inner - x[2]),
    "logarithm": ca.log1p(inner**2),
    "least": ca.fmin(inner, point[1] + x[0] * x[2]),
    "greatest": ca.fmax(inner * x[0], point[0]),
    "absolute": ca.fabs(x[0] * x[1] - point[0]),
    "choice": ca.if_else(x[0] < point[0], inner, x[1] * x[2]),
    "other choice": ca.if_else(x[0] <= x[1], inner, 0),
    "sharpness": ca.log1p(ca.exp(-s * inner)) / s,
    "data alone": point[0] * point[1] + ca.sqrt(point[0]),
}


def agreed(term: ca.Function, points: np.ndarray, at: np.ndarray, sharpness: float) -> float:
    """Return the largest difference between the two ways, relative to the largest number of each part."""
    ours, theirs, worst = by_jets(term, points), by_casadi(term, points), 0.0
    for part in ("value", "gradient", "hessian"):
        a, b = (np.array(getattr(way, part)(at, sharpness)) for way in (ours, theirs))
        assert np.isfinite(b).all()
        worst = max(worst, float(np.abs(a - b).max() / max(1.0, np.abs(b).max())))
    return worst


@pytest.mark.parametrize("name", EXPRESSIONS)
@pytest.mark.parametrize("at", [np.array([0.8, 0.5, 0.9]), np.array([0.2, 1.4, 0.3])])
def test_every_operation_is_differentiated_twice_as_casadi_does(name: str, at: np.ndarray) -> None:
    term = ca.Function("term", [x, point, s], [EXPRESSIONS[name]])
    assert agreed(term, POINTS, at, 1.7) < 1e-13


@pytest.mark.parametrize("sharpness", [3.0, 100.0, 1e4])
def test_the_stage_s_term_is_differentiated_as_casadi_does_near_and_far(cell: Cell, sharpness: float) -> None:
    stage = Stage(cell)
    term = term_function(stage, FRONT, all_gaps(stage), 72)
    points = point_data(cell, seam_parameters(cell))
    for at in ([0.023, -0.266, 0.404], [0.1, -0.5, 0.2], [0.4, 0.3, 1.0]):
        assert agreed(term, points, np.array(at), sharpness) < 1e-9


def test_the_value_alone_is_the_value_of_the_jet() -> None:
    jet = summed_jet(ca.Function("term", [x, point, s], [EXPRESSIONS["product"]]), POINTS)
    at = np.array([0.8, 0.5, 0.9])
    assert jet(at, 1.0, False)[0] == jet(at, 1.0, True)[0]
    assert (jet(at, 1.0, False)[1:] == 0.0).all()


def test_an_operation_without_jet_is_refused_by_number() -> None:
    with pytest.raises(ValueError, match=f"CasADi operation {ca.OP_TAN} has no jet"):
        summed_jet(ca.Function("f", [x, point, s], [ca.tan(x[0])]), POINTS)


def test_more_than_one_output_is_refused() -> None:
    with pytest.raises(ValueError, match="one scalar output"):
        summed_jet(ca.Function("f", [x, point, s], [x]), POINTS)


def test_relaxation_by_either_way_is_the_same_problem(cell: Cell) -> None:
    ours, theirs = relaxation(Stage(cell), FRONT, engine="numba"), relaxation(Stage(cell), FRONT)
    at = [0.01, -0.2, 0.38]
    assert float(ours.value(at, 50.0)) == pytest.approx(float(theirs.value(at, 50.0)), rel=1e-12)
