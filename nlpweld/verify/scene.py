"""Everything there is to see at every sample of a motion, computed once."""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell import Cell
from nlpweld.plan import TILTS, Plan
from nlpweld.verify import reference as ref
from nlpweld.verify.between import Motion
from nlpweld.verify.bodies import BodyTable, all_ends, body_table, floor_distances
from nlpweld.verify.exact import pair_distances, shared
from nlpweld.verify.upright import off_upright, tilt


@dataclass(frozen=True, eq=False)
class Scene:
    """What a motion of K samples through N points looks like; dictionaries are by station name.

    Attributes:
        motion: the samples.
        links: T_W_L, the positioner's too, each of shape (K, n + 1, 4, 4).
        J: geometric Jacobian at the TCP, each of shape (K, 6, n).
        w: manipulability, each of shape (K,) [m^3].
        closure: position error [m] and rotation error [rad] at the N points, each of shape (2, N).
        off_upright: how far the positioner is from holding the weld upright, or tilted as the offsets say, shape (K,)
            [rad]; zero without one.
        tilt: slope and rotation off the position at which the positioner's joints hold the weld, each of shape (K,)
            [rad]; empty without one.
        joint_margin: distance of every joint from its lower and its upper limit, the positioner's too, each of shape
            (K, n, 2) [rad].
        table: bodies and pairs.
        clearance_m: distance of every pair, then of every body above the floor, shape (K, P + F).
    """

    motion: Motion
    links: dict[str, np.ndarray]
    J: dict[str, np.ndarray]
    w: dict[str, np.ndarray]
    closure: dict[str, np.ndarray]
    off_upright: np.ndarray
    tilt: dict[str, np.ndarray]
    joint_margin: dict[str, np.ndarray]
    table: BodyTable
    clearance_m: np.ndarray


def look(cell: Cell, placement: np.ndarray, motion: Motion) -> Scene:
    """Return everything about a motion.

    Args:
        cell: the cell.
        placement: of {P} in W, shape (3,) or (4,) [m; rad].
        motion: the samples.

    Raises:
        VerifierError: the geometry process hung or died twice.
    """
    links = {st.name: ref.link_poses(st, motion.q[st.name]) for st in cell.stations}
    tcps = {st.name: ref.tcp_pose(st, links[st.name]) for st in cell.stations}
    J = {name: ref.jacobian(links[name], tcps[name]) for name in links}
    w = {name: ref.manipulability(jacobian) for name, jacobian in J.items()}
    turned, off, tilted = None, np.zeros(len(motion.s)), {}
    if cell.positioner is not None:
        turned = motion.q[cell.positioner.name]
        links[cell.positioner.name] = ref.positioner_links(cell, placement, turned)
    T_W_C = ref.workpiece_pose(cell, placement, motion.s, turned, motion.free)
    if cell.positioner is not None:
        off, tilted = off_upright(cell, T_W_C, motion.s, motion.free), tilt(cell, T_W_C, motion.s)
    table = body_table(cell)
    ends = all_ends(cell, T_W_C, links, tcps)
    pairs = pair_distances(shared(), ends, table.radius_m, table.pairs)
    clearance = np.concatenate([pairs, floor_distances(table, ends)], axis=1)
    closure = _closure(cell, placement, motion, tcps)
    return Scene(motion, links, J, w, closure, off, tilted, joint_margins(cell, motion.q), table, clearance)


def limits_rad(cell: Cell) -> dict[str, np.ndarray]:
    """Return the joint limits of every station and of the positioner, by name, each of shape (n, 2) [rad]."""
    limits = {station.name: station.robot.limits_rad for station in cell.stations}
    return limits | ({cell.positioner.name: cell.positioner.robot.limits_rad} if cell.positioner else {})


def joint_margins(cell: Cell, q: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return by name how far joints (K, n) are from their lower and upper limits, each of shape (K, n, 2) [rad]."""
    limits = limits_rad(cell)
    return {name: np.stack([q[name] - rows[:, 0], rows[:, 1] - q[name]], axis=-1) for name, rows in limits.items()}


def joint_steps(plan: Plan) -> dict[str, np.ndarray]:
    """Return how far joints turn from each point to the next, by name, each of shape (N or N - 1, n) [rad].

    Those of the stations, and of the positioner where the plan tilts the weld. The last row of a closed seam is the way
    back to the first point, less whole turns.
    """
    cell, steps = plan.cell, {}
    movers = [station.name for station in cell.stations]
    if cell.positioner and any(name in (plan.freedom or {}) for name in TILTS):
        movers.append(cell.positioner.name)
    for name in movers:
        q = np.asarray(plan.paths[name], dtype=float)
        steps[name] = np.abs(np.diff(q, axis=0))
        if cell.seam.closed:
            back = q[0] - q[-1]
            back -= 2 * np.pi * np.round(back / (2 * np.pi))
            steps[name] = np.vstack([steps[name], np.abs(back)])
    return steps


def _closure(cell: Cell, placement: np.ndarray, motion: Motion, tcps: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return position and rotation errors at the points, by station name, each of shape (2, N)."""
    at, closure = motion.at, {}
    turned = motion.q[cell.positioner.name][at] if cell.positioner else None
    for st in cell.stations:
        wanted = ref.required_pose(cell, st, placement, motion.s[at], turned, motion.free)
        closure[st.name] = np.stack(ref.error_size(ref.pose_error(wanted, tcps[st.name][at])))
    return closure
