"""Everything there is to see at every sample of a motion, computed once."""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell import Cell
from nlpweld.verify import reference as ref
from nlpweld.verify.between import Motion
from nlpweld.verify.bodies import BodyTable, all_ends, body_table, floor_distances
from nlpweld.verify.exact import pair_distances, shared


@dataclass(frozen=True, eq=False)
class Scene:
    """What a motion of K samples through N points looks like; dictionaries are by station name.

    Attributes:
        motion: the samples.
        links: T_W_L, each of shape (K, n + 1, 4, 4).
        J: geometric Jacobian at the TCP, each of shape (K, 6, n).
        w: manipulability, each of shape (K,) [m^3].
        closure: position error [m] and rotation error [rad] at the N points, each of shape (2, N).
        joint_margin: distance of every joint from its lower and its upper limit, each of shape (K, n, 2) [rad].
        table: bodies and pairs.
        clearance_m: distance of every pair, then of every body above the floor, shape (K, P + F).
    """

    motion: Motion
    links: dict[str, np.ndarray]
    J: dict[str, np.ndarray]
    w: dict[str, np.ndarray]
    closure: dict[str, np.ndarray]
    joint_margin: dict[str, np.ndarray]
    table: BodyTable
    clearance_m: np.ndarray


def look(cell: Cell, c: np.ndarray, motion: Motion) -> Scene:
    """Return everything about a motion.

    Args:
        cell: the cell.
        c: origin of C in W, shape (3,) [m].
        motion: the samples.

    Raises:
        VerifierError: the geometry process hung or died twice.
    """
    links = {st.name: ref.link_poses(st, motion.q[st.name]) for st in cell.stations}
    tcps = {st.name: ref.tcp_pose(st, links[st.name]) for st in cell.stations}
    J = {name: ref.jacobian(links[name], tcps[name]) for name in links}
    w = {name: ref.manipulability(jacobian) for name, jacobian in J.items()}
    closure = {}
    for st in cell.stations:
        wanted = ref.required_pose(cell, st, c, motion.s[motion.at])
        closure[st.name] = np.stack(ref.error_size(ref.pose_error(wanted, tcps[st.name][motion.at])))
    margin = {}
    for st in cell.stations:
        lower, upper = st.robot.limits_rad.T
        margin[st.name] = np.stack([motion.q[st.name] - lower, upper - motion.q[st.name]], axis=-1)
    table = body_table(cell)
    ends = all_ends(cell, ref.workpiece_pose(cell, c, motion.s), links, tcps)
    pairs = pair_distances(shared(), ends, table.radius_m, table.pairs)
    clearance = np.concatenate([pairs, floor_distances(table, ends)], axis=1)
    return Scene(motion, links, J, w, closure, margin, table, clearance)
