"""The smooth side of the stage: MMR with soft penalties for collision, joint limits, singularity and reach."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.robot import Robot
from nlpweld.formulation.coded import Assembly, Coding, Piece
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.derivatives import DERIVATIVES, by_functions, lanes_of
from nlpweld.formulation.nlp import Relaxation
from nlpweld.formulation.stage import GAP_SCALE_M, Owners, Stage
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import signs
from nlpweld.kinematics.manipulability import magnitude, mmr

STEP_WEIGHT = 0.1  # of a joint step too long by itself, against one for a constraint missed by as much as its level
Branch = tuple[str, str]
Mode = tuple[Branch, ...]


@dataclass(frozen=True)
class Gaps:
    """Which distances a relaxation looks at, as indices into the stage's graphs.

    Attributes:
        meetings: for every two owners, of their meeting graph's gaps.
        heights: for every owner, of its height graph's gaps.
    """

    meetings: dict[Owners, tuple[int, ...]]
    heights: tuple[tuple[int, ...], ...]


def all_gaps(stage: Stage) -> Gaps:
    """Return every distance there is."""
    meetings = {owners: tuple(range(meeting.numel_out(0))) for owners, meeting in stage.meetings.items()}
    return Gaps(meetings, tuple(tuple(range(height.numel_out(0))) for height in stage.heights))


def near_gaps(stage: Stage, mode: Mode, Z: np.ndarray, points: np.ndarray, within_m: float) -> Gaps:
    """Return the distances that fall below a bound somewhere on the seam at any of some candidates.

    Args:
        stage: the cell's graphs.
        mode: (shoulder, elbow) of every station.
        Z: placements and free angles, the same along the seam, shape (m, d + f) [m; rad].
        points: the data of every seam point, shape (k, N).
        within_m: the bound [m].
    """
    (m, d), n = (len(Z), len(stage.cell.variables)), points.shape[1]
    lanes = np.repeat(Z, n, axis=0).T
    x, point = lanes[:d], np.vstack([np.tile(points, m), lanes[d:]])
    ends = [arm.map(m * n)(x, point, _branch(b, m * n))[4] for arm, b in zip(stage.arms, mode, strict=True)]
    ends.append(stage.work.map(m * n)(x, point))
    meetings = {
        (a, b): _below(meeting.map(m * n)(ends[a], ends[b]), within_m) for (a, b), meeting in stage.meetings.items()
    }
    return Gaps(
        meetings,
        tuple(_below(height.map(m * n)(own), within_m) for height, own in zip(stage.heights, ends, strict=True)),
    )


def relaxation(stage: Stage, mode: Mode, gaps: Gaps | None = None, engine: str = "numpy") -> Relaxation:
    """Return the penalised problem of a cell on fixed arm branches.

    Minimise  -mean_j MMR_j + sum_j sum_c softplus(-sharpness * g_jc) / sharpness  over the placement x, where
    g_jc >= 0 are the constraints of seam point j, each scaled to order one. Once the weight, one, exceeds twice
    a constraint's multiplier, the minimiser lies on the feasible side, the nearer the sharper. MMR counts in a unit
    that keeps it of order one, whatever the reading. Where the cell asks for another objective over the seam than the
    mean, that stands in its place (:mod:`~.over_seam`).

    Args:
        stage: the cell's graphs, without free angles.
        mode: (shoulder, elbow) of every station.
        gaps: the distances to look at; all by default.
        engine: ``numba`` differentiates by jets, ``c`` compiles what CasADi differentiates.
    """
    points = point_data(stage.cell, seam_parameters(stage.cell))
    term = term_function(stage, mode, gaps or all_gaps(stage), points.shape[1])
    apart = value_pieces(stage, mode, points, (), engine)
    if not apart:
        return DERIVATIVES[engine](term, points)
    coding = Coding(stage.cell.box, (), np.empty((points.shape[1], 0)))
    whole = Assembly(coding, [Piece(lanes_of(term, points, engine), ()), *apart])
    return by_functions(whole.value, whole.slopes, coding.d)


def value_pieces(
    stage: Stage, mode: Mode, points: np.ndarray, bases: tuple[np.ndarray, ...], engine: str
) -> list[Piece]:
    """Return the objective over the seam as a piece, or none where it is a sum and so part of the points' terms.

    Args:
        stage: the cell's graphs.
        mode: (shoulder, elbow) of every station.
        points: the data of every seam point, shape (k, N).
        bases: of the free angles, shape (N, K), if there are any.
        engine: as of :func:`relaxation`.
    """
    objective = stage.cell.objective
    if objective.over_seam == "mean":
        return []
    z, data, x, point = _variables(stage)
    arms = [arm(x, point, _branch(b)) for arm, b in zip(stage.arms, mode, strict=True)]
    value = ca.Function("value", [z, data, ca.SX.sym("sharpness")], [_value(stage.cell, arms)], {"cse": True})
    return [Piece(lanes_of(value, points, engine), bases, objective)]


def term_function(stage: Stage, mode: Mode, gaps: Gaps, n: int) -> ca.Function:
    """Return ``(x, point, sharpness) ->`` what one of n seam points adds to what is minimised.

    That is its penalties and, where the objective is the mean over the seam, its share of it. The free angles of the
    point, if the stage has any, follow the placement's coordinates in x.
    """
    inputs, loss, penalty = _terms(stage, mode, gaps, n)
    term = loss + penalty if stage.cell.objective.over_seam == "mean" else penalty
    return ca.Function("term", inputs, [term], {"cse": True})


def loss_and_penalty(stage: Stage, mode: Mode, gaps: Gaps, n: int) -> tuple[ca.Function, ca.Function]:
    """Return the two parts of :func:`term_function`: what the objective brings, and what is missed, softly."""
    inputs, loss, penalty = _terms(stage, mode, gaps, n)
    return ca.Function("loss", inputs, [loss], {"cse": True}), ca.Function("penalty", inputs, [penalty], {"cse": True})


def _terms(stage: Stage, mode: Mode, gaps: Gaps, n: int) -> tuple[list[ca.SX], ca.SX, ca.SX]:
    """Return inputs (x, point, sharpness), loss and penalty of one of n seam points."""
    cell, sharpness = stage.cell, ca.SX.sym("sharpness")
    z, data, x, point = _variables(stage)
    arms = [arm(x, point, _branch(b)) for arm, b in zip(stage.arms, mode, strict=True)]
    constraints = [g for k in range(len(arms)) for g in _robot_constraints(cell, k, arms[k])]
    if stage.table:
        constraints.append(stage.table(point)[1])
    ends = [*(arm[4] for arm in arms), stage.work(x, point)]
    constraints.append((chosen_gaps(stage, gaps, ends) - cell.constraints.clearance_at_points_m) / GAP_SCALE_M)
    return [z, data, sharpness], -_value(cell, arms) / n, softened(constraints, sharpness)


def step_function(stage: Stage, mode: Mode, bound: float) -> ca.Function:
    """Return ``(x, points, sharpness) ->`` the penalty on joints that turn too far from one seam point to the next.

    Placement, free angles of the point and of the next one make up x; the data of both points follow each other.

    Args:
        stage: the cell's graphs, with free angles.
        mode: (shoulder, elbow) of every station.
        bound: how far a joint may turn, below half a turn [rad].
    """
    z, data, x, point = _variables(stage)
    u, following, sharpness = (
        ca.SX.sym("u", len(stage.free)),
        ca.SX.sym("following", data.shape),
        ca.SX.sym("sharpness"),
    )
    both, pairs = (point, ca.vertcat(following, u)), []
    for grip, branch in zip(stage.grips, mode, strict=True):
        pairs.append([grip(x, p, _branch(branch))[0] for p in both])
    if stage.table:
        pairs.append([stage.table(p)[0] for p in both])
    penalty = step_penalty([ca.sum2(here * there) for here, there in pairs], bound, sharpness)
    inputs = [ca.vertcat(z, u), ca.vertcat(data, following), sharpness]
    return ca.Function("step", inputs, [penalty], {"cse": True})


def step_penalty(cosines: Iterable[ca.SX], bound: float, sharpness: ca.SX) -> ca.SX:
    """Return the penalty on joints that turn by more than a bound [rad], from the cosines of what they turn by."""
    gaps = [(cosine - np.cos(bound)) / (1 - np.cos(bound)) for cosine in cosines]
    return STEP_WEIGHT * softened(gaps, sharpness)


def _value(cell: Cell, arms: Sequence[tuple[ca.SX, ...]]) -> ca.SX:
    """Return the MMR of one seam point in a unit that keeps it of order one."""
    tight, reading = cell.tight, cell.objective.reading
    return mmr(reading, [a[1] for a in arms], [a[2] for a in arms], tight) / magnitude(reading, tight)


def _variables(stage: Stage) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return symbols for placement with free angles, and point data, and what the stage's graphs take of them."""
    d, f = len(stage.cell.variables), len(stage.free)
    z, data = ca.SX.sym("x", d + f), ca.SX.sym("point", stage.arms[0].nnz_in(1) - f)
    return z, data, z[:d], ca.vertcat(data, z[d:])


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


def chosen_gaps(stage: Stage, gaps: Gaps, ends: Sequence[ca.SX]) -> ca.SX:
    """Return chosen distances between bodies and from the floor, one below the other [m], from all owners' ends."""
    met = [stage.meetings[a, b](ends[a], ends[b])[list(which)] for (a, b), which in gaps.meetings.items()]
    over = [height(own)[list(which)] for height, own, which in zip(stage.heights, ends, gaps.heights, strict=True)]
    return ca.vertcat(*met, *over)


def softened(constraints: Iterable[ca.SX], sharpness: ca.SX) -> ca.SX:
    """Return ``sum softplus(-sharpness * g) / sharpness`` over constraints g >= 0."""
    missed = -sharpness * ca.vertcat(*constraints)
    return ca.sum1(ca.fmax(missed, 0) + ca.log1p(ca.exp(-ca.fabs(missed)))) / sharpness
