"""The smooth relaxation: its derivatives by Taylor's slope, and its limit as the penalties sharpen."""

import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.formulation.reduced import reduced
from nlpweld.formulation.smooth import joint_constraints

from .helpers import PAPER, arm_outputs

INFEASIBLE = np.array([0.05, -0.05, 0.6])
NEAR = [PAPER, INFEASIBLE, np.array([-0.1, -0.2, 0.35])]
STEPS = 10.0 ** np.arange(-2, -4.1, -0.5)


@pytest.fixture(scope="module")
def relaxation(nlp: Nlp) -> Relaxation:
    return nlp.relax(0)


def slope(errors: list[float]) -> float:
    """Return the order at which errors fall with the step."""
    return float(np.polyfit(np.log(STEPS), np.log(errors), 1)[0])


def directions() -> np.ndarray:
    """Return three random unit vectors."""
    d = np.random.default_rng(40).normal(size=(3, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def models(relaxation: Relaxation, x: np.ndarray, sharpness: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Return value, gradient (3,) and Hessian (3, 3) of the relaxation."""
    value, gradient, hessian = (getattr(relaxation, part)(x, sharpness) for part in ("value", "gradient", "hessian"))
    return float(value), np.array(gradient).ravel(), np.array(hessian)


@pytest.mark.parametrize("x", NEAR, ids=["paper", "infeasible", "elsewhere"])
def test_gradient_leaves_an_error_of_second_order(relaxation: Relaxation, x: np.ndarray) -> None:
    value, gradient, _ = models(relaxation, x, 20.0)
    for d in directions():
        errors = [abs(float(relaxation.value(x + h * d, 20.0)) - value - h * gradient @ d) for h in STEPS]
        assert slope(errors) > 1.85  # one, were the gradient wrong; more than two where a direction has no curvature


@pytest.mark.parametrize("x", NEAR, ids=["paper", "infeasible", "elsewhere"])
def test_hessian_leaves_an_error_of_third_order(relaxation: Relaxation, x: np.ndarray) -> None:
    value, gradient, hessian = models(relaxation, x, 20.0)
    for d in directions():
        model = [value + h * gradient @ d + h * h / 2 * d @ hessian @ d for h in STEPS]
        errors = [abs(float(relaxation.value(x + h * d, 20.0)) - m) for h, m in zip(STEPS, model, strict=True)]
        assert slope(errors) > 2.7  # two, were the Hessian wrong


def test_hessian_is_symmetric(relaxation: Relaxation) -> None:
    _, _, hessian = models(relaxation, PAPER, 100.0)
    assert hessian == pytest.approx(hessian.T, rel=1e-12)


def test_value_tends_to_minus_mmr_at_a_feasible_point_as_it_sharpens(relaxation: Relaxation, batch: Batch) -> None:
    mmr = batch.evaluate(PAPER).objective[0]
    errors = np.array([float(relaxation.value(PAPER, sharpness)) + mmr for sharpness in (1e2, 1e3, 1e4, 1e5)])
    assert (np.diff(errors) <= 0).all()
    assert errors[0] > 0.0
    assert abs(errors[-1]) < 1e-9


def test_penalty_of_an_infeasible_point_tends_to_what_its_constraints_lack(
    relaxation: Relaxation, batch: Batch
) -> None:
    found = batch.evaluate(INFEASIBLE)
    no_floor = {"singularity_floor_m3": 0.0, "singularity_margin_m3": 0.0}
    objective = Batch(batch.cell.with_(constraints=no_floor)).evaluate(INFEASIBLE).objective[0]
    penalty = float(relaxation.value(INFEASIBLE, 1e6)) + objective
    assert not found.feasible[0]
    assert penalty >= found.violation[0].max() - 1e-6


def test_value_stays_finite_out_of_reach_and_at_any_sharpness(relaxation: Relaxation) -> None:
    for sharpness in (1.0, 1e3, 1e8):
        value, gradient, hessian = models(relaxation, np.array([0.0, 0.0, 3.0]), sharpness)
        assert np.isfinite([value, *gradient, *hessian.ravel()]).all()


def test_penalty_out_of_reach_is_at_least_what_all_points_lack_of_it(relaxation: Relaxation, batch: Batch) -> None:
    for z in (5.0, 20.0, 80.0):
        at = np.array([0.0, 0.0, z])
        lacking = [np.maximum(0.0, -arm_outputs(batch.stage, k, at)[3]).sum() for k in range(3)]
        assert float(relaxation.value(at, 1e3)) > sum(lacking) > 1e3


def test_modes_are_relaxed_on_their_own_branches(cell: Cell, any_batch: Batch) -> None:
    everything = reduced(cell.with_(configuration={"shoulder": "any", "elbow": "any"}))
    at = np.array([0.0, -0.067, 0.349])
    found = any_batch.evaluate(at)
    assert float(everything.relax(int(found.mode[0])).value(at, 1e7)) == pytest.approx(-found.objective[0], abs=1e-6)


def test_joint_constraint_is_positive_just_where_the_joint_keeps_its_margin(cell: Cell) -> None:
    robot, margin = cell.stations[0].robot, 0.02
    lower, upper = robot.limits_rad.T
    for inside in (1, -1):
        for edge in (lower + margin + inside * 1e-6, upper - margin - inside * 1e-6):
            theta = edge + robot.dh[:, 3]
            got = joint_constraints(robot, np.cos(theta), np.sin(theta), margin)
            assert len(got) == 4  # joints 1, 2, 3 and 5: the others may turn more than once
            assert (np.sign([float(g) for g in got]) == inside).all()
