"""Small problems with known answers, as solvers see them."""

import casadi as ca
import numpy as np

from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation

PEAK = np.array([0.3, -0.2])


def disc(radius: float = 0.5, peak: np.ndarray = PEAK, centre: tuple[float, float] = (-0.2, -0.2)) -> Nlp:
    """Maximise -|x - peak|^2 within a disc; with radius < 0 nothing is feasible."""
    middle = np.array(centre)

    def evaluate(X: np.ndarray) -> Evaluation:
        outside = np.maximum(0.0, np.linalg.norm(X - middle, axis=1) - radius)
        objective = -((X - peak) ** 2).sum(axis=1)
        return Evaluation(objective, outside[:, None], np.zeros(len(X), dtype=int))

    def relax(mode: int, whole: bool) -> Relaxation:
        x, sharpness = ca.SX.sym("x", 2), ca.SX.sym("sharpness")
        miss = sharpness * (ca.sqrt(ca.sumsqr(x - middle) + 1e-12) - radius)
        value = ca.sumsqr(x - peak) + 3 * (ca.fmax(miss, 0) + ca.log1p(ca.exp(-ca.fabs(miss)))) / sharpness
        hessian, gradient = ca.hessian(value, x)
        functions = [
            ca.Function(name, [x, sharpness], [out])
            for name, out in zip("vgh", [value, gradient, hessian], strict=True)
        ]
        return Relaxation(*functions)

    box = np.ones(2)
    return Nlp("disc", "toy", ("x", "y"), -box, box, ("disc",), evaluate, relax=relax)


def optimum(nlp_radius: float, peak: np.ndarray = PEAK, centre: tuple[float, float] = (-0.2, -0.2)) -> np.ndarray:
    """The point of the disc nearest to the peak."""
    step = peak - np.array(centre)
    return np.array(centre) + step * min(1.0, nlp_radius / np.linalg.norm(step))
