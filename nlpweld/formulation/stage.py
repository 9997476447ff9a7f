"""The stage: one seam point of the cell as a CasADi graph. Every solver, population or gradient, sees this physics.

It comes in parts. For each station a *grip* graph goes from placement and seam point, on a given inverse kinematics
branch, to joints, manipulability and reach; a *limbs* graph goes on from the joints to the velocity ellipsoid, the
ends of the bodies, and the distances that concern this robot alone (workpiece, floor); the *arm* graph is both. For
each pair of stations a *meeting* graph goes from two sets of body ends to their distances. Parts let a population
solver stop early: most candidates fail in the grip.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell, Station
from nlpweld.cell.robot import Body
from nlpweld.errors import KinematicsError
from nlpweld.formulation.coupling import base_pose, flange_pose, weld_point
from nlpweld.geometry.capsules import segment_distance
from nlpweld.kinematics.chain import Chain, Frame, constant, jacobian_of, rpy_pose
from nlpweld.kinematics.ik import SphericalArm, spherical_arm
from nlpweld.kinematics.manipulability import det_gram

GAP_SCALE_M = 0.1  # a clearance missed by this much counts as one
ARM_OUTPUTS = ("cos_sin", "w", "gram", "reach", "ends", "gaps")


@dataclass(frozen=True)
class Rod:
    """A capsule in W as the graphs see it: two ends (3, 1) [m], radius [m] and squared length [m^2]."""

    name: str
    start: ca.SX
    end: ca.SX
    radius_m: float
    sq_length: float

    def gap(self, other: "Rod") -> ca.SX:
        """Return the clearance to another rod [m]."""
        distance = segment_distance(self.start, self.end, other.start, other.end, self.sq_length, other.sq_length)
        return distance - self.radius_m - other.radius_m

    def height(self) -> ca.SX:
        """Return the clearance to the floor [m]."""
        return ca.fmin(self.start[2], self.end[2]) - self.radius_m


@dataclass(frozen=True)
class Stage:
    """The graphs of one cell. Placement x is the origin of C in W, shape (3, 1) [m]."""

    cell: Cell

    @cached_property
    def grips(self) -> tuple[ca.Function, ...]:
        """One function per station: ``(x, point, branch) -> cos_sin (6, 2), w, reach``."""
        return tuple(self._grip(station) for station in self.cell.stations)

    @cached_property
    def limbs(self) -> tuple[ca.Function, ...]:
        """One function per station: ``(x, point, cos_sin) -> gram, ends (3, 2b), gaps``."""
        return tuple(self._limbs(station) for station in self.cell.stations)

    @cached_property
    def arms(self) -> tuple[ca.Function, ...]:
        """One function per station: ``(x, point, branch) -> cos_sin (6, 2), w, gram, reach, ends (3, 2b), gaps``."""
        return tuple(self._arm(k) for k in range(len(self.cell.stations)))

    @cached_property
    def meetings(self) -> dict[tuple[int, int], ca.Function]:
        """One function per pair of stations: ``(ends_a, ends_b) -> gaps`` [m], rows by body of a, then of b."""
        return {(k, l): self._meeting(k, l) for k, l in combinations(range(len(self.cell.stations)), 2)}

    @cached_property
    def gap_names(self) -> tuple[tuple[str, ...], ...]:
        """For each station the names of its arm graph's gaps."""
        return tuple(tuple(name for name, *_ in self._solo_pairs(station)) for station in self.cell.stations)

    @cached_property
    def workpiece_height(self) -> ca.Function:
        """``(x, point) -> gaps`` of the workpiece's bodies to the floor [m]."""
        x, point = ca.SX.sym("x", 3), weld_point()
        rods = workpiece_rods(self.cell, Frame(point.R_W_C, x))
        return ca.Function("workpiece_height", [x, point.vector], [ca.vertcat(*[rod.height() for rod in rods])])

    def _grip(self, station: Station) -> ca.Function:
        x, point, branch = ca.SX.sym("x", 3), weld_point(), ca.SX.sym("branch", 3)
        arm = self._inverse(station)
        found = arm.solve(flange_pose(station, Frame(point.R_W_C, x), point.p_C), branch)
        outputs = [ca.horzcat(found.cos, found.sin), arm.abs_det_jacobian(found), found.reach]
        inputs = [x, point.vector, branch]
        return _function(f"grip_{station.name}", inputs, outputs, ["x", "point", "branch"], ["cos_sin", "w", "reach"])

    def _limbs(self, station: Station) -> ca.Function:
        x, point, cos_sin = ca.SX.sym("x", 3), weld_point(), ca.SX.sym("cos_sin", len(station.robot.joints), 2)
        links = Chain(station.robot).links(cos_sin[:, 0], cos_sin[:, 1], base_pose(station))
        tcp = links[-1] @ constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
        rods = {body.name: station_rod(station, body, links, tcp) for body in station.bodies}
        works = {rod.name: rod for rod in workpiece_rods(self.cell, Frame(point.R_W_C, x))}
        gaps = [
            rods[body].gap(works[other]) if other in works else rods[body].height()
            for _, body, other in self._solo_pairs(station)
        ]
        ends = ca.horzcat(*[end for rod in rods.values() for end in (rod.start, rod.end)])
        outputs = [det_gram(jacobian_of(links, tcp.p)[0]), ends, ca.vertcat(*gaps)]
        inputs = [x, point.vector, cos_sin]
        return _function(f"limbs_{station.name}", inputs, outputs, ["x", "point", "cos_sin"], ["gram", "ends", "gaps"])

    def _arm(self, k: int) -> ca.Function:
        x, point, branch = ca.SX.sym("x", 3), weld_point().vector, ca.SX.sym("branch", 3)
        cos_sin, w, reach = self.grips[k](x, point, branch)
        gram, ends, gaps = self.limbs[k](x, point, cos_sin)
        outputs = [cos_sin, w, gram, reach, ends, gaps]
        name = f"arm_{self.cell.stations[k].name}"
        return _function(name, [x, point, branch], outputs, ["x", "point", "branch"], list(ARM_OUTPUTS))

    def _inverse(self, station: Station) -> SphericalArm:
        try:
            return spherical_arm(station.robot)
        except KinematicsError as error:
            raise KinematicsError(f"{self.cell.name}: stations.{station.name}: {error}") from None

    def _solo_pairs(self, station: Station) -> list[tuple[str, str, str]]:
        """Return (name, body, other) of every distance that concerns one robot alone."""
        works = [body.name for body in self.cell.workpiece.bodies]
        pairs = [(body.name, work) for body in station.bodies for work in works]
        pairs = [p for p in pairs if "/".join(p) not in station.coupling.may_touch]
        pairs += [(body.name, "floor") for body in station.bodies if not stands_on_floor(body)]
        return [(f"{station.name}.{body} - {other}", body, other) for body, other in pairs]

    def _meeting(self, k: int, l: int) -> ca.Function:
        sides = [self.cell.stations[i] for i in (k, l)]
        ends = [ca.SX.sym(f"ends_{i}", 3, 2 * len(side.bodies)) for i, side in enumerate(sides)]
        rods = [
            [
                Rod(body.name, e[:, 2 * i], e[:, 2 * i + 1], body.radius_m, sq_length(side, body))
                for i, body in enumerate(side.bodies)
            ]
            for side, e in zip(sides, ends, strict=True)
        ]
        gaps = ca.vertcat(*[a.gap(b) for a in rods[0] for b in rods[1]])
        return _function(f"meeting_{k}_{l}", ends, [gaps], ["ends_a", "ends_b"], ["gaps"])


def station_rod(station: Station, body: Body, links: list[Frame], tcp: Frame) -> Rod:
    """Return a robot or tool body as a rod in the frame the links are given in."""
    start, end = body_ends(body, links, tcp)
    return Rod(body.name, start, end, body.radius_m, sq_length(station, body))


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


def workpiece_rods(cell: Cell, T_W_C: Frame) -> list[Rod]:
    """Return the workpiece's bodies as rods in W."""
    return [
        Rod(
            b.name,
            T_W_C.point(b.start_m),
            T_W_C.point(b.end_m),
            b.radius_m,
            float(np.sum(np.subtract(b.end_m, b.start_m) ** 2)),
        )
        for b in cell.workpiece.bodies
    ]


def stands_on_floor(body: Body) -> bool:
    """Tell whether a body is part of the base, which may be as near to the floor as it is."""
    return body.start.frame == body.end.frame == "link0"


def with_lowest_gap(function: ca.Function) -> ca.Function:
    """Return a stage function with its last output, the gaps, replaced by the least of them."""
    inputs = [ca.SX.sym(function.name_in(i), *function.size_in(i)) for i in range(function.n_in())]
    outputs = list(function.call(inputs))
    names = [function.name_out(i) for i in range(function.n_out() - 1)]
    return _function(
        function.name(), inputs, [*outputs[:-1], ca.mmin(outputs[-1])], function.name_in(), [*names, "low"]
    )


def _function(name: str, inputs: list[ca.SX], outputs: list[ca.SX], ins: list[str], outs: list[str]) -> ca.Function:
    """Return a dense function with common subexpressions shared."""
    return ca.Function(name, inputs, [ca.densify(out) for out in outputs], ins, outs, {"cse": True})
