"""The height of one box's cycle as a problem for the solvers: one variable, z_max."""

from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.errors import OptionError
from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation
from nlpweld.palletising.cycle import Legs, after, legs
from nlpweld.palletising.graph import move
from nlpweld.palletising.task import PalletTask

KEEN = 10.0
LOW_S_PER_M = 1e-6  # what height costs: of many best heights the lowest is meant


def height_nlp(task: PalletTask, box: int, low_s_per_m: float = LOW_S_PER_M) -> Nlp:
    """Return the problem of one box: minimise the time of its leg over z_max between eq. (12)'s bounds.

    The objective is minus ``t + low_s_per_m (z_max - its lower bound)``, so that on a plateau of equal times the lowest
    height is best; by that much a height may be preferred to the quickest one. The relaxation is a soft maximum of
    eq. (16) and (17), in milliseconds, which is off by the inverse of its sharpness where the two cross; so that takes
    ``KEEN`` times the square of the solvers' own. Height costs one over it, too. Kinks are left where an S-curve
    reaches its velocity limit.

    Args:
        task: what is palletised.
        box: which box, counted from 0 at the bottom.
        low_s_per_m: what height costs.

    Raises:
        OptionError: there is no room between the bounds, so nothing to search.
    """
    leg = legs(task).of(box)
    low, top = np.array([float(leg.lowest_m)]), np.array([task.cycle.z_a_m])
    if not low[0] < top[0]:
        raise OptionError(f"{task.name}: z_a_m {top[0]:g} leaves solvers no room above {low[0]:g} m; raise it")

    def evaluate(X: np.ndarray) -> Evaluation:
        t = after(leg, X[:, 0]).total_s + low_s_per_m * (X[:, 0] - low[0])
        return Evaluation(-t, np.zeros((len(X), 1)), np.zeros(len(X), dtype=int))

    return Nlp(
        problem=f"{task.name}-{box + 1}",
        formulation="z_max",
        names=("z_max_m",),
        lower=low,
        upper=top,
        constraints=("box",),
        evaluate=evaluate,
        relax=lambda mode, whole: _relaxation(leg),
        rebuild=partial(height_nlp, task, box, low_s_per_m),
    )


def time_graph(leg: Legs, z_max: Any) -> tuple[Any, Any]:
    """Return eq. (16) and (17) as graphs of z_max [s]; the leg takes the greater of the two."""
    up, down = move(z_max - leg.z_0, leg.lift), move(z_max - leg.z_3, leg.lift)
    ends = up.time_at(float(leg.z_1 - leg.z_0)) + down.time_at(float(leg.z_2 - leg.z_3))
    return up.duration_s + down.duration_s, ends + float(leg.beside_s)


def _relaxation(leg: Legs) -> Relaxation:
    z, sharpness = ca.SX.sym("z"), ca.SX.sym("sharpness")
    lift, wait = time_graph(leg, z)
    keen = KEEN * sharpness**2
    gap = lift - wait
    soft = ca.fmax(lift, wait) + ca.log1p(ca.exp(-keen * ca.fabs(gap))) / keen
    value = 1e3 * (soft + (z - float(leg.lowest_m)) / keen)
    hessian, gradient = ca.hessian(value, z)
    named = (("value", value), ("gradient", gradient), ("hessian", hessian))
    return Relaxation(*(ca.Function(name, [z, sharpness], [out]) for name, out in named))
