"""The stage: one seam point of the cell as a CasADi graph. Every solver, population or gradient, sees this physics.

It comes in parts. For each station a *grip* graph goes from placement and seam point, on a given inverse kinematics
branch, to joints, manipulability and reach; a *limbs* graph goes on from the joints, and from where the base stands,
to the velocity ellipsoid and the ends of the bodies; the *arm* graph is both. The *work* graph gives the ends of the
workpiece's bodies. For every two owners of bodies, robots or workpiece, a *meeting* graph goes from two sets of body
ends to their distances, and for each a *height* graph to its distances from the floor. Parts let a population solver
stop early: most candidates fail in the grip, and most bodies are far apart.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.robot import Body
from nlpweld.cell.station import Station
from nlpweld.errors import KinematicsError
from nlpweld.formulation.coupling import (
    WeldPoint,
    base_frame,
    flange_pose,
    moving_bodies,
    placement_frame,
    weld_point,
)
from nlpweld.formulation.holder import held
from nlpweld.formulation.set_up import moved
from nlpweld.geometry.capsules import segment_distance
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.chain import Chain, Frame, constant, jacobian_of, rpy_pose
from nlpweld.kinematics.ik import SphericalArm, spherical_arm
from nlpweld.kinematics.manipulability import det_gram

GAP_SCALE_M = 0.1  # a clearance missed by this much counts as one
Owners = tuple[int, int]


@dataclass(frozen=True)
class Shape:
    """A capsule without its place: radius [m], squared length of its axis [m^2], and whether the floor concerns it."""

    name: str
    radius_m: float
    sq_length: float
    above_floor: bool = True


@dataclass(frozen=True)
class Stage:
    """The graphs of one cell. Placement x holds the free coordinates of the placement frame {P}, and of bases, in W.

    Owners of bodies are numbered: the stations in their order, then the work, which is the workpiece and the
    positioner that holds it. Ends of an owner's bodies are (3, 2b) [m] in W: start and end of one body beside the
    other. The free angles of a seam point come last in its data.

    Attributes:
        cell: the cell.
        free: names of the angles that are free at every seam point; see :mod:`~.freedom`.
        errors: whether {P} and bases may be off; a seam point's data ends as :mod:`~.set_up` says.
    """

    cell: Cell
    free: tuple[str, ...] = ()
    errors: bool = False

    @cached_property
    def grips(self) -> tuple[ca.Function, ...]:
        """One function per station: ``(x, point, branch) -> cos_sin (6, 2), w, reach``."""
        return tuple(self._grip(k) for k in range(len(self.cell.stations)))

    @cached_property
    def limbs(self) -> tuple[ca.Function, ...]:
        """One function per station: ``(x, cos_sin) -> gram, ends``, or ``(x, cos_sin, point)`` where errors are."""
        return tuple(self._limbs(k) for k in range(len(self.cell.stations)))

    @cached_property
    def arms(self) -> tuple[ca.Function, ...]:
        """One function per station: ``(x, point, branch) -> cos_sin (6, 2), w, gram, reach, ends``."""
        return tuple(self._arm(k) for k in range(len(self.cell.stations)))

    @cached_property
    def work(self) -> ca.Function:
        """``(x, point) -> ends`` of the workpiece's bodies, then of the positioner's."""
        x, point = self._x, self._point
        T_W_P = self._placed(x, point)
        T_W_C = T_W_P @ point.T_P_C
        ends = [T_W_C.point(p) for body in self.cell.workpiece.bodies for p in (body.start_m, body.end_m)]
        ends += [T_W_P.point(p) for p in self._positioner_ends(point.ends_P)]
        return _function("work", [x, point.vector], [ca.horzcat(*ends)], ["x", "point"], ["ends"])

    @cached_property
    def table(self) -> ca.Function | None:
        """``(point) -> cos_sin (2, 2), kept`` of a positioner that tilts the weld by free angles; None of any other.

        What is kept is at least 0 where its joints are within limits; see :class:`~.tilting.TiltedTable`.
        """
        point = weld_point(self.cell, self.free)
        if point.table is None:
            return None
        outputs = [ca.horzcat(point.table.cos, point.table.sin), point.table.kept]
        return _function("table", [point.vector], outputs, ["point"], ["cos_sin", "kept"])

    def _positioner_ends(self, moving_P: ca.SX) -> list[ca.SX]:
        """Return the ends of the positioner's bodies in {P}: numbers where the body is fixed, else as given."""
        if self.cell.positioner is None:
            return []
        robot, moving = self.cell.positioner.robot, moving_bodies(self.cell)
        base = constant(rpy_pose(self.cell.positioner.base_position_m, self.cell.positioner.base_rpy_deg))
        fixed = [[base.point(end.at_m) for end in (body.start, body.end)] for body in robot.bodies]
        given = ca.horzsplit(moving_P) if moving else []
        for k, i in enumerate(moving):
            fixed[i] = given[2 * k : 2 * k + 2]
        return [end for ends in fixed for end in ends]

    @property
    def _x(self) -> ca.SX:
        return ca.SX.sym("x", len(self.cell.variables))

    @property
    def _point(self) -> WeldPoint:
        return weld_point(self.cell, self.free, self.errors)

    def _placed(self, x: ca.SX, point: WeldPoint) -> Frame:
        """Return T_W_P of a placement, off as the point says."""
        T_W_P = placement_frame(self.cell, x)
        return T_W_P if point.set_up is None else moved(T_W_P, point.set_up.placement)

    def _base(self, k: int, x: ca.SX, point: WeldPoint) -> Frame:
        """Return T_W_B of station k, off as the point says."""
        T_W_B = base_frame(self.cell, k, x)
        return T_W_B if point.set_up is None else moved(T_W_B, point.set_up.bases[k])

    @cached_property
    def shapes(self) -> tuple[tuple[Shape, ...], ...]:
        """The bodies of every owner."""
        robots = [
            tuple(Shape(b.name, b.radius_m, sq_length(s, b), not stands_on_floor(b)) for b in s.bodies)
            for s in self.cell.stations
        ]
        works = [
            Shape(b.name, b.radius_m, float(np.sum(np.subtract(b.end_m, b.start_m) ** 2)))
            for b in self.cell.workpiece.bodies
        ]
        table = self.cell.positioner.robot.bodies if self.cell.positioner else ()
        moving = moving_bodies(self.cell)
        works += [Shape(b.name, b.radius_m, self._sq_lengths[i], i in moving) for i, b in enumerate(table)]
        return (*robots, tuple(works))

    @cached_property
    def _sq_lengths(self) -> list[float]:
        """Squared lengths of the positioner's bodies [m^2], which are rigid: read off at the first point."""
        ends = held(self.cell, seam_parameters(self.cell)).ends_P[0]
        return [float(length) for length in np.sum((ends[:, 1] - ends[:, 0]) ** 2, axis=-1)]

    @cached_property
    def pairs(self) -> dict[Owners, tuple[Owners, ...]]:
        """For every two owners the bodies, by index, whose distance counts."""
        owners = range(len(self.shapes))
        return {(a, b): self._pairs_of(a, b) for a, b in combinations(owners, 2)}

    def _pairs_of(self, a: int, b: int) -> tuple[Owners, ...]:
        stations = self.cell.stations
        exempt = stations[a].coupling.may_touch if b == len(stations) else ()
        return tuple(
            (i, j)
            for i, mine in enumerate(self.shapes[a])
            for j, other in enumerate(self.shapes[b])
            if f"{mine.name}/{other.name}" not in exempt
        )

    @cached_property
    def meetings(self) -> dict[Owners, ca.Function]:
        """For every two owners ``(ends_a, ends_b) -> gaps`` [m], one per pair of bodies."""
        return {owners: self._meeting(*owners) for owners in self.pairs}

    @cached_property
    def heights(self) -> tuple[ca.Function, ...]:
        """For every owner ``(ends) -> gaps`` to the floor [m], of the bodies it concerns."""
        return tuple(self._height(owner) for owner in range(len(self.shapes)))

    @cached_property
    def gap(self) -> ca.Function:
        """``(ends_a (3, 2), ends_b (3, 2), numbers) -> gap`` [m] of any two bodies.

        The numbers are the squared lengths of a and b, and the sum of their radii.
        """
        a, b, numbers = ca.SX.sym("ends_a", 3, 2), ca.SX.sym("ends_b", 3, 2), ca.SX.sym("numbers", 3)
        axes = [*ca.horzsplit(a), *ca.horzsplit(b)]
        gap = segment_distance(*axes, *ca.vertsplit(numbers[:2])) - numbers[2]
        return _function("gap", [a, b, numbers], [gap], ["ends_a", "ends_b", "numbers"], ["gap"])

    def _grip(self, k: int) -> ca.Function:
        station, x = self.cell.stations[k], self._x
        point, branch = self._point, ca.SX.sym("branch", 3)
        T_W_C, T_W_B = self._placed(x, point) @ point.T_P_C, self._base(k, x, point)
        T_B_F = flange_pose(station, T_W_C, point.targets[k], point.spins[k], T_W_B)
        found = self._inverse(station).solve(T_B_F, branch)
        outputs = [ca.horzcat(found.cos, found.sin), self._inverse(station).abs_det_jacobian(found), found.reach]
        inputs = [x, point.vector, branch]
        return _function(f"grip_{station.name}", inputs, outputs, ["x", "point", "branch"], ["cos_sin", "w", "reach"])

    def _limbs(self, k: int) -> ca.Function:
        station, x = self.cell.stations[k], self._x
        cos_sin, point = ca.SX.sym("cos_sin", len(station.robot.joints), 2), self._point
        base = self._base(k, x, point)
        links = Chain(station.robot).links(cos_sin[:, 0], cos_sin[:, 1])  # in {B}: the ellipsoid is the same anywhere
        tcp = links[-1] @ constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
        ends = ca.horzcat(*[base.point(end) for body in station.bodies for end in body_ends(body, links, tcp)])
        outputs = [det_gram(jacobian_of(links, tcp.p)[0]), ends]
        inputs, names = [x, cos_sin, point.vector], ["x", "cos_sin", "point"]
        n = 2 + self.errors
        return _function(f"limbs_{station.name}", inputs[:n], outputs, names[:n], ["gram", "ends"])

    def _arm(self, k: int) -> ca.Function:
        x, point, branch = self._x, self._point.vector, ca.SX.sym("branch", 3)
        cos_sin, w, reach = self.grips[k](x, point, branch)
        gram, ends = self.limbs[k](*[x, cos_sin, point][: 2 + self.errors])
        name, names = f"arm_{self.cell.stations[k].name}", ["cos_sin", "w", "gram", "reach", "ends"]
        return _function(name, [x, point, branch], [cos_sin, w, gram, reach, ends], ["x", "point", "branch"], names)

    def _inverse(self, station: Station) -> SphericalArm:
        try:
            return spherical_arm(station.robot)
        except KinematicsError as error:
            raise KinematicsError(f"{self.cell.name}: stations.{station.name}: {error}") from None

    def _meeting(self, a: int, b: int) -> ca.Function:
        ends = [ca.SX.sym(f"ends_{side}", 3, 2 * len(self.shapes[side])) for side in (a, b)]
        gaps = []
        for i, j in self.pairs[a, b]:
            p, q = self.shapes[a][i], self.shapes[b][j]
            axes = [*ca.horzsplit(ends[0][:, 2 * i : 2 * i + 2]), *ca.horzsplit(ends[1][:, 2 * j : 2 * j + 2])]
            lengths = [p.sq_length, q.sq_length]
            gaps.append(segment_distance(*axes, *lengths) - p.radius_m - q.radius_m)
        return _function(f"meeting_{a}_{b}", ends, [ca.vertcat(*gaps)], ["ends_a", "ends_b"], ["gaps"])

    def _height(self, owner: int) -> ca.Function:
        shapes = self.shapes[owner]
        ends = ca.SX.sym("ends", 3, 2 * len(shapes))
        gaps = [
            ca.fmin(ends[2, 2 * i], ends[2, 2 * i + 1]) - shape.radius_m
            for i, shape in enumerate(shapes)
            if shape.above_floor
        ]
        return _function(f"height_{owner}", [ends], [ca.vertcat(*gaps)], ["ends"], ["gaps"])


def body_ends(body: Body, links: list[Frame], tcp: Frame) -> tuple[ca.SX, ca.SX]:
    """Return the two ends of a body's axis, each (3, 1) [m], in the frame the links are given in."""
    start, end = ((tcp if e.frame == "tcp" else links[int(e.frame[4:])]).point(e.at_m) for e in (body.start, body.end))
    return start, end


def sq_length(station: Station, body: Body) -> float:
    """Return the squared length of a station's body [m^2].

    A body is rigid, whatever the joints do, so its length is read off at one configuration.
    """
    chain = Chain(station.robot)
    links = chain.links(*chain.cos_sin(ca.SX.zeros(chain.n)))
    tcp = links[-1] @ constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
    start, end = body_ends(body, links, tcp)
    return float(ca.DM(ca.sumsqr(end - start)))


def stands_on_floor(body: Body) -> bool:
    """Tell whether a body is part of the base, which may be as near to the floor as it is."""
    return body.start.frame == body.end.frame == "link0"


def _function(name: str, inputs: list[ca.SX], outputs: list[ca.SX], ins: list[str], outs: list[str]) -> ca.Function:
    """Return a dense function with common subexpressions shared."""
    return ca.Function(name, inputs, [ca.densify(out) for out in outputs], ins, outs, {"cse": True})
