"""One seam point in the full space: placement, every joint and any free angles are given, and no robot is inverted."""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from nlpweld.cell.cell import Cell
from nlpweld.cell.levels import Objective
from nlpweld.cell.robot import Robot
from nlpweld.formulation.coupling import (
    Names,
    WeldPoint,
    base_frame,
    placement_frame,
    tcp_pose,
    tilts,
    weld_point,
)
from nlpweld.formulation.over_seam import LEAST
from nlpweld.formulation.smooth import Gaps, chosen_gaps, softened
from nlpweld.formulation.stage import GAP_SCALE_M, Stage
from nlpweld.kinematics.chain import Chain, Frame, constant, rpy_pose
from nlpweld.kinematics.ik import Solution, SphericalArm, spherical_arm
from nlpweld.kinematics.manipulability import magnitude, mmr

LEVEL_WEIGHT = 2.0  # of a point's value below the level: twice the greatest multiplier there can be
LEVER_M = 1.0  # a position error this long counts as much as a turn of one radian: about the arms' own length


def moved(cell: Cell, free: Names = ()) -> dict[str, Robot]:
    """Return by name whose joints are variables: every station's robot, then a positioner that tilts the weld."""
    tilting = cell.positioner if tilts(free) else None
    return {s.name: s.robot for s in cell.stations} | ({tilting.name: tilting.robot} if tilting else {})


@dataclass(frozen=True)
class SeamPoint:
    """Expressions of one seam point in its variables y: placement, then all joints, then free angles.

    Joints are those of all stations and, where it tilts the weld by free angles, those of the positioner.

    Between them comes a level of MMR, where the objective over the seam is another than the mean (:func:`full_term`).

    Attributes:
        stage: the cell's graphs; its free angles are this point's.
    """

    stage: Stage

    @cached_property
    def moved(self) -> dict[str, Robot]:
        """What has joints here, by name."""
        return moved(self.stage.cell, self.stage.free)

    @property
    def joints(self) -> int:
        """Number of joints."""
        return sum(len(robot.joints) for robot in self.moved.values())

    @property
    def own(self) -> int:
        """Number of the point's own variables: joints and free angles."""
        return self.joints + len(self.stage.free)

    @property
    def levels(self) -> int:
        """Number of levels: one or none."""
        return int(self.stage.cell.objective.over_seam != "mean")

    @cached_property
    def weld(self) -> WeldPoint:
        """What is known of the point, and its free angles."""
        return weld_point(self.stage.cell, self.stage.free)

    @cached_property
    def _x(self) -> ca.SX:
        return ca.SX.sym("x", len(self.stage.cell.variables))

    @cached_property
    def _q(self) -> list[ca.SX]:
        return [ca.SX.sym(f"q_{name}", len(robot.joints)) for name, robot in self.moved.items()]

    @cached_property
    def level(self) -> ca.SX:
        """The level of MMR that all points share, of order one, shape (levels, 1)."""
        return ca.SX.sym("level", self.levels)

    @property
    def inputs(self) -> list[ca.SX]:
        """What every graph here takes: variables y (d + levels + own, 1) [m; rad], and what is known of the point."""
        return [ca.vertcat(self._x, self.level, *self._q, self.weld.free), self.weld.data]

    @cached_property
    def cos_sin(self) -> list[tuple[ca.SX, ca.SX]]:
        """Cosines and sines of every station's DH angles, shapes (6, 1)."""
        stations = self.stage.cell.stations
        return [Chain(s.robot).cos_sin(q) for s, q in zip(stations, self._q[: len(stations)], strict=True)]

    @cached_property
    def errors(self) -> list[tuple[ca.SX, ca.SX]]:
        """For every station how far its TCP is from where its coupling wants it: in W (3, 1) [m], and R_d^T R (3, 3).

        R is the TCP's rotation and R_d the one asked for.
        """
        cell, found = self.stage.cell, []
        T_W_C = placement_frame(cell, self._x) @ self.weld.T_P_C
        couplings = zip(cell.stations, self.weld.targets, self.weld.spins, self.cos_sin, strict=True)
        for k, (station, target, spin, (cos, sin)) in enumerate(couplings):
            flange = Chain(station.robot).links(cos, sin, base_frame(cell, k, self._x))[-1]
            is_ = flange @ constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
            asked: Frame = tcp_pose(station.coupling, T_W_C, target, spin)
            found.append((is_.p - asked.p, asked.R.T @ is_.R))
        return found

    @cached_property
    def off_table(self) -> tuple[ca.SX, ca.SX]:
        """Sines and cosines of how far the positioner's joints are from where slope and rotation ask for them, (n, 1).

        There are none where it does not tilt the weld.
        """
        table, positioner = self.weld.table, self.stage.cell.positioner
        if table is None or positioner is None:
            return ca.SX(0, 1), ca.SX(0, 1)
        cos, sin = Chain(positioner.robot).cos_sin(self._q[-1])
        return sin * table.cos - cos * table.sin, cos * table.cos + sin * table.sin

    @cached_property
    def factors(self) -> list[ca.SX]:
        """For every station the signed factors of its manipulability: radius [m], elbow [m], sin(theta_5); (3, 1).

        Their signs are shoulder, elbow and wrist of the branch (:mod:`~nlpweld.kinematics.ik`).
        """
        pairs = zip(self.stage.cell.stations, self.cos_sin, strict=True)
        return [_factors(spherical_arm(station.robot), *cos_sin) for station, cos_sin in pairs]

    @cached_property
    def w(self) -> list[ca.SX]:
        """Manipulability of every station [m^3]; its closed form in the joints."""
        found = []
        for station, (cos, sin), factors in zip(self.stage.cell.stations, self.cos_sin, self.factors, strict=True):
            solution = Solution(cos, sin, ca.SX(1), factors[1], factors[0])
            found.append(spherical_arm(station.robot).abs_det_jacobian(solution))
        return found

    @cached_property
    def _limbs(self) -> list[tuple[ca.SX, ca.SX]]:
        return [limbs(self._x, ca.horzcat(*cs)) for limbs, cs in zip(self.stage.limbs, self.cos_sin, strict=True)]

    @property
    def mmr(self) -> ca.SX:
        """Multi-robot manipulability in the reading's unit."""
        cell = self.stage.cell
        return mmr(cell.objective.reading, self.w, [gram for gram, _ in self._limbs], cell.tight)

    def gaps(self, which: Gaps) -> ca.SX:
        """Return chosen distances between bodies and from the floor, one below the other [m]."""
        ends = [*(ends for _, ends in self._limbs), self.stage.work(self._x, self.weld.vector)]
        return chosen_gaps(self.stage, which, ends)


def closure_function(point: SeamPoint) -> ca.Function:
    """Return ``(y, point) ->`` closure errors, one below the other: six of every station, all zero when it closes.

    Three are the position error over :data:`LEVER_M`. Three are the axis of the remaining turn times the sine of its
    angle, half of what R_d^T R differs from its transpose by: a polynomial in cosines and sines of the joints, regular
    for turns below 90 degrees, but zero also at 180 degrees, which only the exact model tells apart. So is the sine of
    how far each joint of a positioner that tilts the weld is off, which comes last.
    """
    rows = [ca.vertcat(offset / LEVER_M, sine_axis(turn)) for offset, turn in point.errors]
    return ca.Function("closure", point.inputs, [ca.densify(ca.vertcat(*rows, point.off_table[0]))], {"cse": True})


def sine_axis(R: ca.SX) -> ca.SX:
    """Return the axis of a rotation (3, 3) times the sine of its angle, shape (3, 1)."""
    return ca.vertcat(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]) / 2


def full_term(point: SeamPoint, gaps: Gaps, n: int) -> ca.Function:
    """Return ``(y, point, sharpness) ->`` what one of n seam points adds to the objective.

    As in the reduced form (:func:`~.smooth.relaxation`), less the penalties for reach, which closure makes needless,
    and for joint limits, which are bounds of variables.

    Another objective over the seam than the mean would couple all points, and the Hessian were dense. A level t that
    all points share keeps the sum: over t, the greatest of ``t - 2 sum_j softplus(s (t - m_j)) / s`` tends to the
    minimum of the m_j as the sharpness s grows, and ``t - t/p (1/N sum_j (t/m_j)^p - 1)`` is greatest where t is
    their power mean with exponent -p, and is that power mean there.
    """
    cell, sharpness = point.stage.cell, ca.SX.sym("sharpness")
    floor, level = cell.constraints.floor_at_points_m3, cell.constraints.clearance_at_points_m
    kept = [w / (floor or 1.0) - float(floor > 0) for w in point.w]
    penalty = softened([*kept, (point.gaps(gaps) - level) / GAP_SCALE_M], sharpness)
    value = point.mmr / magnitude(cell.objective.reading, cell.tight)
    if cell.objective.over_seam == "mean":
        term = penalty - value / n
    else:
        term = penalty - point.level / n + _below(cell.objective, value, point.level, sharpness, n)
    return ca.Function("term", [*point.inputs, sharpness], [term], {"cse": True})


def _below(objective: Objective, value: ca.SX, level: ca.SX, sharpness: ca.SX, n: int) -> ca.SX:
    """Return what one of n points takes off the level by its value."""
    if objective.exponent is None:
        return LEVEL_WEIGHT * softened([value - level], sharpness)
    p = objective.exponent
    return level / (p * n) * ((level / ca.fmax(value, LEAST)) ** p - 1)


def facts_function(point: SeamPoint, gaps: Gaps) -> ca.Function:
    """Return ``(y, point) -> offset (S), turn (S + t), factors (3, S), w (S), mmr, gap`` as the exact model judges.

    That is distance [m] and angle [rad] by which each of S chains is open, and the angle by which each of t joints of
    a positioner that tilts the weld is off; the factors and value of each chain's manipulability, the team's, and the
    least distance [m].
    """
    offset = [ca.norm_2(p) for p, _ in point.errors]
    turn = [ca.atan2(ca.norm_2(sine_axis(R)), (ca.trace(R) - 1) / 2) for _, R in point.errors]
    turn.append(ca.fabs(ca.atan2(*point.off_table)))
    outputs = [ca.vertcat(*offset), ca.vertcat(*turn), ca.horzcat(*point.factors), ca.vertcat(*point.w), point.mmr]
    outputs.append(ca.mmin(point.gaps(gaps)))
    return ca.Function("facts", point.inputs, [ca.densify(out) for out in outputs], {"cse": True})


def _factors(arm: SphericalArm, cos: ca.SX, sin: ca.SX) -> ca.SX:
    """Return radius and elbow [m] and sin(theta_5), signed, from cosines and sines (6, 1), shape (3, 1)."""
    s23, c23 = sin[1] * cos[2] + cos[1] * sin[2], cos[1] * cos[2] - sin[1] * sin[2]
    radius = arm.a1 + arm.a2 * cos[1] + arm.a3 * c23 - arm.d4 * s23
    return ca.vertcat(radius, arm.d4 * cos[2] + arm.a3 * sin[2], sin[4])
