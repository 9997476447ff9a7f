"""Single parts of the stage as graphs of their own, so that each can be timed alone."""

from itertools import product

import casadi as ca
import numpy as np

from nlpweld.cell import Cell, Station
from nlpweld.formulation.coupling import base_pose
from nlpweld.geometry.capsules import segment_distance
from nlpweld.kinematics.chain import Chain, Frame, constant, jacobian_of, rpy_pose
from nlpweld.kinematics.ik import Solution, spherical_arm
from nlpweld.verify.bodies import body_table


def jacobian_graph(station: Station) -> ca.Function:
    """Return ``cos_sin (12) -> T_W_E (12), J (36), w``: TCP pose, geometric Jacobian, closed-form |det J|."""
    cos, sin = ca.SX.sym("cos", 6), ca.SX.sym("sin", 6)
    links = Chain(station.robot).links(cos, sin, base_pose(station))
    tcp = links[-1] @ constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
    arm = spherical_arm(station.robot)
    elbow = arm.d4 * cos[2] + arm.a3 * sin[2]
    s23, c23 = sin[1] * cos[2] + cos[1] * sin[2], cos[1] * cos[2] - sin[1] * sin[2]
    radius = arm.a1 + arm.a2 * cos[1] + arm.a3 * c23 - arm.d4 * s23
    w = arm.abs_det_jacobian(Solution(cos, sin, ca.SX(0), elbow, radius))
    outputs = ca.vertcat(ca.vec(tcp.R), tcp.p, *(ca.vec(half) for half in jacobian_of(links, tcp.p)), w)
    return _dense("fk_jacobian_det", ca.vertcat(cos, sin), outputs)


def inverse_graph(station: Station) -> ca.Function:
    """Return ``T_B_F (12) -> `` cosines, sines (12) and reach of the four arm branches.

    The other wrist of each is a change of signs, so this is all eight branches.
    """
    T = ca.SX.sym("T", 12)
    pose = Frame(ca.reshape(T[:9], 3, 3), T[9:])
    arm, found = spherical_arm(station.robot), []
    for shoulder, elbow in product((1, -1), repeat=2):
        s = arm.solve(pose, ca.DM([shoulder, elbow, 1]))
        found += [s.cos, s.sin, s.reach]
    return _dense("inverse", T, ca.vertcat(*found))


def clearance_graphs(cell: Cell, lengths_m: list[float]) -> list[tuple[ca.Function, list[int]]]:
    """Return graphs from body ends to the least distance, one per two owners and one for the floor.

    Args:
        cell: the cell.
        lengths_m: length of every body's axis, in the order of the body table.

    Returns:
        ``ends (6 n) -> gap`` with the n bodies it takes, start before end.
    """
    table = body_table(cell)
    groups: dict[tuple[str, str], list[tuple[int, int]]] = {}
    for a, b in table.pairs.tolist():
        groups.setdefault((table.owner[a], table.owner[b]), []).append((a, b))
    graphs = [_least_of("_".join(owners), pairs, table.radius_m, lengths_m) for owners, pairs in groups.items()]
    above = table.above_floor.tolist()
    ends, of = _ends(above)
    heights = [ca.fmin(of[b][0][2], of[b][1][2]) - table.radius_m[b] for b in above]
    return [*graphs, (_dense("floor", ends, ca.mmin(ca.vertcat(*heights))), above)]


def clearance_sources(ends: np.ndarray, bodies: list[int]) -> np.ndarray:
    """Return the inputs (6 n, lanes) of a clearance graph from all ends (lanes, B, 2, 3)."""
    return ends[:, bodies].reshape(len(ends), -1).T


def _least_of(name: str, pairs: list[tuple[int, int]], radius: np.ndarray, length: list[float]) -> tuple:
    bodies = sorted({b for pair in pairs for b in pair})
    ends, of = _ends(bodies)
    gaps = [
        segment_distance(*of[a], *of[b], length[a] ** 2, length[b] ** 2) - float(radius[a] + radius[b])
        for a, b in pairs
    ]
    return _dense(name, ends, ca.mmin(ca.vertcat(*gaps))), bodies


def _ends(bodies: list[int]) -> tuple[ca.SX, dict[int, tuple[ca.SX, ca.SX]]]:
    ends = ca.SX.sym("ends", 6 * len(bodies))
    return ends, {b: (ends[6 * i : 6 * i + 3], ends[6 * i + 3 : 6 * i + 6]) for i, b in enumerate(bodies)}


def _dense(name: str, x: ca.SX, y: ca.SX) -> ca.Function:
    return ca.Function(name, [x], [ca.densify(y)], ["x"], ["y"], {"cse": True})
