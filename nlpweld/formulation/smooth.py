"""The smooth side of the stage: MMR with soft penalties for collision, joint limits, singularity and reach."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.robot import Robot
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.derivatives import by_casadi, by_jets
from nlpweld.formulation.nlp import Relaxation
from nlpweld.formulation.stage import GAP_SCALE_M, Stage
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import signs
from nlpweld.kinematics.manipulability import magnitude, mmr

Branch = tuple[str, str]
Mode = tuple[Branch, ...]


@dataclass(frozen=True)
class Gaps:
    """Which distances a relaxation looks at, as indices into the stage's graphs.

    Attributes:
        solo: for each station, of its limbs graph's gaps.
        meetings: for each pair of stations, of its meeting graph's gaps.
    """

    solo: tuple[tuple[int, ...], ...]
    meetings: dict[tuple[int, int], tuple[int, ...]]


def all_gaps(stage: Stage) -> Gaps:
    """Return every distance there is."""
    solo = tuple(tuple(range(limbs.numel_out("gaps"))) for limbs in stage.limbs)
    return Gaps(solo, {pair: tuple(range(meeting.numel_out(0))) for pair, meeting in stage.meetings.items()})


def near_gaps(stage: Stage, mode: Mode, X: np.ndarray, within_m: float) -> Gaps:
    """Return the distances that fall below a bound somewhere on the seam at any of some placements X (m, 3) [m]."""
    points = point_data(stage.cell, seam_parameters(stage.cell))
    m, n = len(X), points.shape[1]
    x, point = np.repeat(X, n, axis=0).T, np.tile(points, m)
    arms = [arm.map(m * n)(x, point, _branch(b, m * n)) for arm, b in zip(stage.arms, mode, strict=True)]
    solo = tuple(_below(arm[5], within_m) for arm in arms)
    meetings = {
        pair: _below(meeting.map(m * n)(arms[pair[0]][4], arms[pair[1]][4]), within_m)
        for pair, meeting in stage.meetings.items()
    }
    return Gaps(solo, meetings)


def relaxation(stage: Stage, mode: Mode, gaps: Gaps | None = None, jets: bool = False) -> Relaxation:
    """Return the penalised problem of a cell on fixed arm branches.

    Minimise  -mean_j MMR_j + sum_j sum_c softplus(-sharpness * g_jc) / sharpness  over the placement x, where
    g_jc >= 0 are the constraints of seam point j, each scaled to order one. Once the weight, one, exceeds twice
    a constraint's multiplier, the minimiser lies on the feasible side, the nearer the sharper. MMR counts in a unit
    that keeps it of order one, whatever the reading.

    Args:
        stage: the cell's graphs.
        mode: (shoulder, elbow) of every station.
        gaps: the distances to look at; all by default.
        jets: differentiate by jets on Numba instead of by CasADi.
    """
    points = point_data(stage.cell, seam_parameters(stage.cell))
    term = term_function(stage, mode, gaps or all_gaps(stage), points.shape[1])
    return (by_jets if jets else by_casadi)(term, points)


def term_function(stage: Stage, mode: Mode, gaps: Gaps, n: int) -> ca.Function:
    """Return ``(x, point, sharpness) ->`` what one of n seam points adds to the objective."""
    x, point, sharpness = ca.SX.sym("x", 3), ca.SX.sym("point", 12), ca.SX.sym("sharpness")
    cell = stage.cell
    arms = [arm(x, point, _branch(b)) for arm, b in zip(stage.arms, mode, strict=True)]
    constraints = [g for k in range(len(arms)) for g in _robot_constraints(cell, k, arms[k])]
    seen = [arm[5][list(which)] for arm, which in zip(arms, gaps.solo, strict=True)]
    seen += [stage.meetings[k, l](arms[k][4], arms[l][4])[list(which)] for (k, l), which in gaps.meetings.items()]
    level = cell.constraints.clearance_at_points_m
    constraints.append((ca.vertcat(*seen, stage.workpiece_height(x, point)) - level) / GAP_SCALE_M)
    tight, reading = cell.tight, cell.objective.reading
    value = mmr(reading, [a[1] for a in arms], [a[2] for a in arms], tight) / magnitude(reading, tight)
    term = -value / n + ca.sum1(_softplus(-sharpness * ca.vertcat(*constraints))) / sharpness
    return ca.Function("term", [x, point, sharpness], [term], {"cse": True})


def _branch(branch: Branch, n: int = 1) -> ca.DM:
    return ca.repmat(ca.DM(signs((*branch, "noflip"))), 1, n)


def _below(gaps: ca.DM, bound: float) -> tuple[int, ...]:
    """Return the rows of gaps that fall below a bound in any column."""
    return tuple(int(i) for i in np.flatnonzero((np.array(gaps) < bound).any(axis=1)))


def _robot_constraints(cell: Cell, k: int, arm: tuple[ca.SX, ...]) -> list[ca.SX]:
    limits = cell.constraints
    floor = limits.floor_at_points_m3
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
