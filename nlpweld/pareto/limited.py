"""A problem that must also keep a level of something its cell has no level of: joint travel, time, or a toy's aim."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.derivatives import by_casadi
from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation
from nlpweld.kinematics.ik import signs
from nlpweld.pareto.aims import Aim, Meter, speeds_rad_s, turning_s

BLUNT_RAD = 0.3  # over the sharpness: below such a step |dq| is round
STEP_S = 1.0  # over the sharpness: joints whose steps take times this near to each other share the maximum

Second = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of candidates (m, d) on modes (m,), shape (m,); maximised


@dataclass(frozen=True, eq=False)
class Side:
    """A second value of a problem's candidates, to be maximised.

    Attributes:
        name: of the constraint that asks for a level of it.
        exact: its value.
        smooth: ``mode -> Relaxation`` of minus the value, which tends to the exact one as the sharpness grows.
    """

    name: str
    exact: Second
    smooth: Callable[[int], Relaxation]


def at_least(nlp: Nlp, side: Side, level: float, unit: float) -> Nlp:
    """Return a problem with one constraint more: ``side >= level``.

    Args:
        nlp: the problem; its relaxation has no equalities.
        side: the second value.
        level: what it must be at least.
        unit: a miss that counts as one.
    """

    def evaluate(X: np.ndarray) -> Evaluation:
        found = nlp.evaluate(X)
        missed, looked = np.zeros((len(X), 1)), found.feasible
        missed[looked, 0] = np.maximum(0.0, level - side.exact(np.atleast_2d(X)[looked], found.mode[looked])) / unit
        return Evaluation(found.objective, np.hstack([found.violation, missed]), found.mode)

    def relax(mode: int, whole: bool) -> Relaxation:
        assert nlp.relax is not None
        return _with_penalty(nlp.relax(mode, whole), side.smooth(mode), level, unit)

    widened = nlp.widened
    return replace(
        nlp,
        constraints=(*nlp.constraints, side.name),
        evaluate=evaluate,
        relax=relax,
        widened=widened and (lambda extra: at_least(widened(extra), side, level, unit)),
        rebuild=None,
    )


def _with_penalty(base: Relaxation, side: Relaxation, level: float, unit: float) -> Relaxation:
    """Return a relaxation plus ``softplus(s * (side + level) / unit) / s`` at sharpness s; side is minus the value."""
    x, s = ca.MX.sym("x", base.value.size1_in(0)), ca.MX.sym("sharpness")
    missed = s * (side.value(x, s) + level) / unit
    penalty = (ca.fmax(missed, 0) + ca.log1p(ca.exp(-ca.fabs(missed)))) / s
    slope = 0.5 * (1 + ca.tanh(missed / 2)) / unit
    bend = s * slope * (1 / unit - slope)
    g = ca.reshape(side.gradient(x, s), -1, 1)
    gradient = ca.reshape(base.gradient(x, s), -1, 1) + slope * g
    hessian = base.hessian(x, s) + slope * side.hessian(x, s) + bend * (g @ g.T)
    outputs = {"value": base.value(x, s) + penalty, "gradient": gradient, "hessian": hessian}
    names = ["x", "sharpness"]
    return Relaxation(*(ca.Function(name, [x, s], [out], names, [name]) for name, out in outputs.items()))


def less(batch: Batch, aim: Aim) -> Side:
    """Return minus the joint travel of a cell's reduced form, or minus the time of its quickest pass, with derivatives.

    Smoothly a step from point to point is ``sqrt(dq^2 + (blunt/s)^2)``, s being the sharpness. Travel sums these over
    stations and joints; a pass takes the log-sum-exp, in units of ``STEP_S / s``, of these over joint speeds. Both are
    never less than the exact ones.
    """
    meter, total = Meter(batch, aim), _travel if aim.name == "travel_rad" else _pass_s
    return Side(aim.name, lambda X, mode: -meter(X, mode), lambda mode: _over_seam(batch, mode, total))


Total = Callable[[Cell, list[ca.SX], ca.SX, ca.SX], ca.SX]  # cell, steps [rad], the positioner's [s], sharpness


def _travel(cell: Cell, steps: list[ca.SX], turning_s: ca.SX, s: ca.SX) -> ca.SX:
    return ca.sum1(ca.vertcat(*steps))


def _pass_s(cell: Cell, steps: list[ca.SX], turning_s: ca.SX, s: ca.SX) -> ca.SX:
    taken = [step / ca.DM(speeds_rad_s(station.robot)) for station, step in zip(cell.stations, steps, strict=True)]
    return ca.logsumexp(ca.vertcat(*taken, turning_s) * (s / STEP_S)) * (STEP_S / s)


def _over_seam(batch: Batch, mode: int, total: Total) -> Relaxation:
    """Return the sum over neighbouring seam points of a total of what joints turn between them."""
    count, points, cell = len(batch.points), batch.points, batch.cell
    x, both, s = ca.SX.sym("x", len(cell.variables)), ca.SX.sym("both", 2 * count + 1), ca.SX.sym("sharpness")
    steps = []
    for grip, branch in zip(batch.stage.grips, batch.modes[mode], strict=True):
        side = ca.DM(signs((*branch, "noflip")))
        here, there = (grip(x, point, side)[0] for point in (both[:count], both[count:-1]))
        cos = ca.sum2(here * there)
        sin = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
        steps.append(ca.sqrt(ca.atan2(sin, cos) ** 2 + (BLUNT_RAD / s) ** 2))
    value = total(cell, steps, both[-1], s)
    pairs = np.vstack([points, np.roll(points, -1, axis=1)])[:, : None if cell.seam.closed else -1]
    return by_casadi(
        ca.Function("less", [x, both, s], [value], ["x", "points", "sharpness"], ["less"], {"cse": True}),
        np.vstack([pairs, turning_s(cell).T]),
    )
