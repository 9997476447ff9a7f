"""The motion between the points of a plan: every interval halved until nothing moves far from sample to sample."""

from dataclasses import dataclass, field

import numpy as np

from nlpweld.cell import Cell, Station
from nlpweld.verify import reference as ref

JOINT_STEP_RAD = np.radians(3.0)
DEPTH = 10  # halvings; a path that still moves far over 1/1024 of an interval jumps
SAMPLES = 20_000
CLOSED = 1e-8  # [m] and [rad]; Newton ends near 1e-12 where it ends at all
ITERATIONS = 30
LONGEST_STEP_RAD = 0.3


@dataclass(frozen=True)
class Jump:
    """A place where one robot moves too far however finely one looks.

    ``step`` is that of the joint [rad], or of a body end [m] where no joint step is too long by itself.
    """

    robot: str
    joint: int
    s: float
    step: float
    limit: float
    unit: str


@dataclass(frozen=True)
class Unclosed:
    """A place between two points where no configuration near them reaches the pose the weld asks for."""

    robot: str
    s: float
    position_m: float
    rotation_rad: float


@dataclass(frozen=True, eq=False)
class Motion:
    """Configurations along the whole closed seam, in order; the last continues to the first point, one turn on.

    Attributes:
        s: seam parameter, shape (K,), from s_0 to s_0 + 1.
        q: joint angles by station name, each of shape (K, n) [rad].
        at: index of each point of the plan among the samples, shape (N,).
        point: index of the point at or before each sample, shape (K,).
        jumps: where the path is torn.
        unclosed: where the chain does not close.
    """

    s: np.ndarray
    q: dict[str, np.ndarray]
    at: np.ndarray
    point: np.ndarray
    jumps: list[Jump] = field(default_factory=list)
    unclosed: list[Unclosed] = field(default_factory=list)


def whole_motion(cell: Cell, c: np.ndarray, s: np.ndarray, paths: dict[str, np.ndarray]) -> Motion:
    """Return the motion of a plan, with enough samples between its points.

    Between two neighbouring samples no body end moves more than the cell's ``verify_step_m`` and no joint more than
    ``JOINT_STEP_RAD``, except at the jumps it lists.

    Args:
        cell: the cell.
        c: origin of C in W, shape (3,) [m].
        s: seam parameter of the points, shape (N,), increasing in [0, 1).
        paths: joint angles by station name, each of shape (N, n) [rad].
    """
    S = np.append(s, s[0] + 1)
    q = {name: np.vstack([path, _one_turn_on(path)]) for name, path in paths.items()}
    ends = _ends(cell, c, S, q)
    torn = np.zeros(len(s), dtype=bool)  # intervals that cannot be halved
    unclosed: list[Unclosed] = []
    for _ in range(DEPTH):
        split = np.flatnonzero(_too_long(cell, q, ends) & ~torn)
        if len(split) == 0 or len(S) + len(split) > max(SAMPLES, 4 * len(s)):
            break
        middle, q_middle, bad = _halve(cell, c, S, q, split)
        unclosed += bad
        good = ~np.isin(middle, [u.s for u in bad])
        torn[split[~good]] = True
        where = split[good] + 1
        q_middle = {name: x[good] for name, x in q_middle.items()}
        new_ends = _ends(cell, c, middle[good], q_middle)
        S, torn = np.insert(S, where, middle[good]), np.insert(torn, where, False)
        q = {name: np.insert(x, where, q_middle[name], axis=0) for name, x in q.items()}
        ends = {name: np.insert(x, where, new_ends[name], axis=0) for name, x in ends.items()}
    at = np.searchsorted(S, s)
    point = np.minimum(np.searchsorted(s, S, side="right") - 1, len(s) - 1)
    return Motion(S, q, at, point, _jumps(cell, S, q, ends), unclosed)


def close_chain(station: Station, T_W_E: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find joint angles near a start that reach given poses, by damped Gauss-Newton on M poses at once.

    Args:
        station: the robot at its place.
        T_W_E: desired TCP poses, shape (M, 4, 4).
        start: joint angles to start from, shape (M, n) [rad].

    Returns:
        Joint angles (M, n), and the pose errors left (M, 6).
    """
    q = np.array(start, dtype=float)
    error = np.full((len(q), 6), np.inf)
    todo = np.arange(len(q))
    for _ in range(ITERATIONS):
        T_W_L = ref.link_poses(station, q[todo])
        T_W_T = ref.tcp_pose(station, T_W_L)
        e = ref.pose_error(T_W_E[todo], T_W_T)
        error[todo] = e
        far = np.abs(e).max(axis=-1) > CLOSED * 1e-3
        todo, e = todo[far], e[far]
        if len(todo) == 0:
            break
        q[todo] += _newton_step(ref.jacobian(T_W_L[far], T_W_T[far]), e)
    return q, error


def _newton_step(J: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Return damped least-squares steps (M, n); the damping fades with the error, so the end is quadratic."""
    damping = np.clip((e * e).sum(axis=-1), 1e-12, 1e-2)
    core = J @ J.swapaxes(-1, -2) + damping[:, None, None] * np.eye(6)
    step = (J.swapaxes(-1, -2) @ np.linalg.solve(core, e[..., None]))[..., 0]
    size = np.linalg.norm(step, axis=-1, keepdims=True)
    return step * np.minimum(1.0, LONGEST_STEP_RAD / np.maximum(size, 1e-300))


def _halve(
    cell: Cell, c: np.ndarray, s: np.ndarray, q: dict[str, np.ndarray], split: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray], list[Unclosed]]:
    """Return the middles of some intervals, the configurations there, and the middles where a chain stays open."""
    middle = (s[split] + s[split + 1]) / 2
    found, bad = {}, []
    for station in cell.stations:
        path = q[station.name]
        start = (path[split] + path[split + 1]) / 2
        found[station.name], error = close_chain(station, ref.required_pose(cell, station, c, middle), start)
        position, rotation = ref.error_size(error)
        for i in np.flatnonzero(~((position <= CLOSED) & (rotation <= CLOSED))):
            bad.append(Unclosed(station.name, float(middle[i]), float(position[i]), float(rotation[i])))
    return middle, found, bad


def _one_turn_on(path: np.ndarray) -> np.ndarray:
    """Return the first row again, each joint moved by the whole turns that bring it nearest the last row."""
    return path[0] + 2 * np.pi * np.round((path[-1] - path[0]) / (2 * np.pi))


def _ends(cell: Cell, c: np.ndarray, s: np.ndarray, q: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return capsule ends in W by station name, and of the workpiece under the empty name, each (M, ends, 3) [m]."""
    ends = {"": ref.workpiece_ends(cell, ref.workpiece_pose(cell, c, s))}
    for station in cell.stations:
        T_W_L = ref.link_poses(station, q[station.name])
        ends[station.name] = ref.body_ends(station, T_W_L, ref.tcp_pose(station, T_W_L))
    return {name: x.reshape(len(s), 2 * x.shape[1], 3) for name, x in ends.items()}


def _steps_m(ends: np.ndarray) -> np.ndarray:
    """Return the longest way of any body end in each interval, shape (K - 1,) [m]."""
    return np.linalg.norm(np.diff(ends, axis=0), axis=-1).max(axis=-1, initial=0.0)


def _too_long(cell: Cell, q: dict[str, np.ndarray], ends: dict[str, np.ndarray]) -> np.ndarray:
    """Tell which intervals are to be halved, shape (K - 1,)."""
    far = [_steps_m(x) > cell.constraints.verify_step_m for x in ends.values()]
    return np.any([*far, *(np.abs(np.diff(x, axis=0)).max(axis=1) > JOINT_STEP_RAD for x in q.values())], axis=0)


def _jumps(cell: Cell, s: np.ndarray, q: dict[str, np.ndarray], ends: dict[str, np.ndarray]) -> list[Jump]:
    """Return what is still too long after all halving, in the order of the seam."""
    jumps = []
    limit_m = cell.constraints.verify_step_m
    for name, path in q.items():
        turn, way = np.abs(np.diff(path, axis=0)), _steps_m(ends[name])
        for i in np.flatnonzero((turn.max(axis=1) > JOINT_STEP_RAD) | (way > limit_m)):
            joint = int(turn[i].argmax())
            if turn[i, joint] > JOINT_STEP_RAD:
                jumps.append(Jump(name, joint, float(s[i]), float(turn[i, joint]), float(JOINT_STEP_RAD), "rad"))
            else:
                jumps.append(Jump(name, joint, float(s[i]), float(way[i]), limit_m, "m"))
    return jumps
