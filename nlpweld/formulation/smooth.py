"""The smooth side of the stage: MMR with soft penalties for collision, joint limits, singularity and reach."""

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.robot import Robot
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.nlp import Relaxation
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import signs
from nlpweld.kinematics.manipulability import mmr

GAP_SCALE_M = 0.1
Branch = tuple[str, str]


def relaxation(stage: Stage, mode: tuple[Branch, ...]) -> Relaxation:
    """Return the penalised problem of a cell on fixed arm branches.

    Minimise  -mean_j MMR_j + sum_j sum_c softplus(-sharpness * g_jc) / sharpness  over the placement x, where
    g_jc >= 0 are the constraints of seam point j, each scaled to order one. Once the weight, one, exceeds twice
    a constraint's multiplier, the minimiser lies on the feasible side, the nearer the sharper.

    Args:
        stage: the cell's graphs.
        mode: (shoulder, elbow) of every station.
    """
    data = ca.DM(point_data(stage.cell, seam_parameters(stage.cell)))
    x, point, sharpness = ca.SX.sym("x", 3), ca.SX.sym("point", 12), ca.SX.sym("sharpness")
    term = _term(stage, mode, x, point, sharpness, data.shape[1])
    hessian, gradient = ca.hessian(term, x)
    outputs = {"value": term, "gradient": gradient, "hessian": ca.densify(hessian)}
    return Relaxation(*(_summed(name, [x, point, sharpness], out, data) for name, out in outputs.items()))


def _summed(name: str, inputs: list[ca.SX], output: ca.SX, data: ca.DM) -> ca.Function:
    """Return ``(x, sharpness) -> sum over the seam points`` of one point's output."""
    n = data.shape[1]
    one = ca.Function(name, inputs, [output], {"cse": True})
    x, sharpness = ca.MX.sym("x", 3), ca.MX.sym("sharpness")
    columns = one.map(n)(ca.repmat(x, 1, n), data, ca.repmat(sharpness, 1, n))
    width = output.shape[1]
    total = ca.horzcat(*[ca.sum2(columns[:, k::width]) for k in range(width)])
    return ca.Function(name, [x, sharpness], [total], ["x", "sharpness"], [name])


def _term(stage: Stage, mode: tuple[Branch, ...], x: ca.SX, point: ca.SX, sharpness: ca.SX, n: int) -> ca.SX:
    """Return what one seam point adds to the objective."""
    cell = stage.cell
    arms = [arm(x, point, ca.DM(signs((*b, "noflip")))) for arm, b in zip(stage.arms, mode, strict=True)]
    constraints = [g for k in range(len(arms)) for g in _robot_constraints(cell, k, arms[k])]
    gaps = [arm[5] for arm in arms]
    gaps += [meeting(arms[k][4], arms[l][4]) for (k, l), meeting in stage.meetings.items()]
    level = cell.constraints.clearance_m + cell.constraints.clearance_margin_m
    constraints.append((ca.vertcat(*gaps, stage.workpiece_height(x, point)) - level) / GAP_SCALE_M)
    tight = [s.coupling.kind == "tight" for s in cell.stations]
    value = mmr(cell.objective.reading, [a[1] for a in arms], [a[2] for a in arms], tight)
    return -value / n + ca.sum1(_softplus(-sharpness * ca.vertcat(*constraints))) / sharpness


def _robot_constraints(cell: Cell, k: int, arm: tuple[ca.SX, ...]) -> list[ca.SX]:
    limits = cell.constraints
    floor = limits.singularity_floor_m3 + limits.singularity_margin_m3
    cos_sin, w, _, reach = arm[:4]
    joints = joint_constraints(
        cell.stations[k].robot, cos_sin[:, 0], cos_sin[:, 1], np.radians(limits.joint_margin_deg)
    )
    return [reach, w / (floor or 1.0) - float(floor > 0), *joints]


def joint_constraints(robot: Robot, cos: ca.SX, sin: ca.SX, margin: float) -> list[ca.SX]:
    """Return ``cos(q - middle) - cos(half range - margin)`` for every joint that turns no more than once.

    Joints that turn farther are limited only by their unwrapped path, which the exact model looks at.
    """
    constraints = []
    for i, (lower, upper) in enumerate(robot.limits_rad):
        half = (upper - lower) / 2 - margin
        if half < np.pi:
            middle = (upper + lower) / 2 + robot.dh[i, 3]
            constraints.append(cos[i] * np.cos(middle) + sin[i] * np.sin(middle) - np.cos(half))
    return constraints


def _softplus(z: ca.SX) -> ca.SX:
    return ca.fmax(z, 0) + ca.log1p(ca.exp(-ca.fabs(z)))
