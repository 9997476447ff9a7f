"""Two aims that both are distances in a plane: every best compromise lies on the straight line between two points."""

from functools import partial

import casadi as ca
import numpy as np

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.pareto.limited import Side, at_least
from tests.solvers.toys import PEAK, disc

OTHER = np.array([-0.5, 0.4])
APART = float(np.linalg.norm(PEAK - OTHER))


def hill() -> Nlp:
    """Maximise -|x - peak|^2 in a box, by a disc that does not matter."""
    return disc(3.0)


def nearer_to_other(X: np.ndarray, mode: np.ndarray) -> np.ndarray:
    """The second value: -|x - other|^2."""
    return -((X - OTHER) ** 2).sum(axis=1)


def other_side() -> Side:
    """The second value with derivatives."""
    x, s = ca.SX.sym("x", 2), ca.SX.sym("s")
    value = ca.sumsqr(x - OTHER)
    hessian, gradient = ca.hessian(value, x)
    parts = [ca.Function(n, [x, s], [e]) for n, e in (("v", value), ("g", gradient), ("h", ca.densify(hessian)))]
    return Side("other", nearer_to_other, lambda mode: Relaxation(*parts))


def keeping(level: float, unit: float = 0.02) -> Nlp:
    """The hill where the second value is at least a level."""
    return at_least(hill(), other_side(), level, unit)


levels = partial(np.linspace, -(0.9**2) * APART**2, -(0.1**2) * APART**2)


def off_front(values: np.ndarray) -> np.ndarray:
    """How far points (m, 2) of the two values are from the front: both distances together less what they must be."""
    return np.sqrt(np.maximum(0.0, -values)).sum(axis=1) - APART
