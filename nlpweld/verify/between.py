"""The motion between the points of a plan: every interval halved until nothing moves far from sample to sample."""

from dataclasses import dataclass, field

import numpy as np

from nlpweld.cell import Cell, Station
from nlpweld.geometry.seam import breaks
from nlpweld.verify import reference as ref
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.upright import posture_limit, turn_upright

JOINT_STEP_RAD = np.radians(3.0)
DEPTH = 10  # halvings; a path that still moves far over 1/1024 of an interval jumps
SAMPLES = 20_000
CLOSED = 1e-8  # [m] and [rad]; Newton ends near 1e-12 where it ends at all
ITERATIONS = 30
LONGEST_STEP_RAD = 0.3
SAME_S = 1e-9


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
    """A place between two points where no configuration near them reaches the pose the weld asks for.

    Of the positioner, ``rotation_rad`` is how far from upright, or from the tilt asked, it leaves the weld.
    """

    robot: str
    s: float
    position_m: float
    rotation_rad: float


@dataclass(frozen=True, eq=False)
class Motion:
    """Configurations along the whole seam, in order; a closed one's last continues to the first point, one turn on.

    Attributes:
        s: seam parameter, shape (K,), from s_0 to s_0 + 1, or to the last point of an open seam.
        q: joint angles by name of station or positioner, each of shape (K, n) [rad].
        at: index of each point of the plan among the samples, shape (N,).
        point: index of the point at or before each sample, shape (K,).
        jumps: where the path is torn.
        unclosed: where the chain does not close.
        free: offsets of free angles along it, if any.
    """

    s: np.ndarray
    q: dict[str, np.ndarray]
    at: np.ndarray
    point: np.ndarray
    jumps: list[Jump] = field(default_factory=list)
    unclosed: list[Unclosed] = field(default_factory=list)
    free: Offsets | None = None


def whole_motion(
    cell: Cell,
    placement: np.ndarray,
    s: np.ndarray,
    paths: dict[str, np.ndarray],
    free: Offsets | None = None,
) -> Motion:
    """Return the motion of a plan, with enough samples between its points.

    Between two neighbouring samples no body end moves more than the cell's ``verify_step_m`` and no joint more than
    ``JOINT_STEP_RAD``, except at the jumps it lists. Where pieces of the seam join there is a sample.

    Args:
        cell: the cell.
        placement: of {P} in W, shape (3,) or (4,) [m; rad].
        s: seam parameter of the points, shape (N,), increasing in [0, 1), or in [0, 1] where the seam is open.
        paths: joint angles by name of station or positioner, each of shape (N, n) [rad].
        free: offsets of free angles, if any.
    """
    samples = _Samples(cell, placement, s, paths, free)
    samples.insert(*_joints_of_pieces(cell, samples.s))
    for _ in range(DEPTH):
        split = np.flatnonzero(samples.too_long() & ~samples.torn)
        if len(split) == 0 or len(samples.s) + len(split) > max(SAMPLES, 4 * len(s)):
            break
        samples.insert(split, (samples.s[split] + samples.s[split + 1]) / 2, np.full(len(split), 0.5))
    S = samples.s
    at = np.searchsorted(S, s)
    point = np.minimum(np.searchsorted(s, S, side="right") - 1, len(s) - 1)
    return Motion(S, samples.q, at, point, samples.jumps(), samples.unclosed, free)


class _Samples:
    """Samples of a motion, to be made denser; ``torn`` marks the intervals that nothing could be put into."""

    def __init__(
        self, cell: Cell, placement: np.ndarray, s: np.ndarray, paths: dict[str, np.ndarray], free: Offsets | None
    ) -> None:
        self.cell, self.placement, self.free = cell, placement, free
        self.s, self.q = s, dict(paths)
        if cell.seam.closed:
            self.s = np.append(s, s[0] + 1)
            self.q = {name: np.vstack([path, _one_turn_on(path)]) for name, path in paths.items()}
        self.ends = _ends(cell, placement, self.s, self.q, free)
        self.torn = np.zeros(len(self.s) - 1, dtype=bool)
        self.unclosed: list[Unclosed] = []

    def insert(self, after: np.ndarray, s: np.ndarray, share: np.ndarray) -> None:
        """Put new samples after some, in order, each found from the configuration a share of the way to the next."""
        start = {name: (1 - x) * q[after] + x * q[after + 1] for name, q in self.q.items() for x in [share[:, None]]}
        q, bad = closed_near(self.cell, self.placement, s, start, self.free)
        good = ~np.isin(s, [u.s for u in bad])
        self.unclosed += bad
        self.torn[after[~good]] = True
        where, s, q = after[good] + 1, s[good], {name: x[good] for name, x in q.items()}
        ends = _ends(self.cell, self.placement, s, q, self.free)
        self.s, self.torn = np.insert(self.s, where, s), np.insert(self.torn, where, False)
        self.q = {name: np.insert(x, where, q[name], axis=0) for name, x in self.q.items()}
        self.ends = {name: np.insert(x, where, ends[name], axis=0) for name, x in self.ends.items()}

    def too_long(self) -> np.ndarray:
        """Tell which intervals are to be halved, shape (K - 1,)."""
        far = [_steps_m(x) > self.cell.constraints.verify_step_m for x in self.ends.values()]
        turned = (np.abs(np.diff(x, axis=0)).max(axis=1) > JOINT_STEP_RAD for x in self.q.values())
        return np.any([*far, *turned], axis=0)

    def jumps(self) -> list[Jump]:
        """Return what is still too long, in the order of the seam."""
        jumps = []
        limit_m = self.cell.constraints.verify_step_m
        for name, path in self.q.items():
            turn, way = np.abs(np.diff(path, axis=0)), _steps_m(self.ends[name])
            for i in np.flatnonzero((turn.max(axis=1) > JOINT_STEP_RAD) | (way > limit_m)):
                joint = int(turn[i].argmax())
                step, limit, unit = float(turn[i, joint]), float(JOINT_STEP_RAD), "rad"
                if step <= limit:
                    step, limit, unit = float(way[i]), limit_m, "m"
                jumps.append(Jump(name, joint, float(self.s[i]), step, limit, unit))
        return jumps


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


def closed_near(
    cell: Cell, placement: np.ndarray, s: np.ndarray, start: dict[str, np.ndarray], free: Offsets | None
) -> tuple[dict[str, np.ndarray], list[Unclosed]]:
    """Return configurations near others: the positioner's, then the robots' that follow it; and what stays open.

    Args:
        cell: the cell.
        placement: of {P} in W, shape (3,) or (4,) [m; rad].
        s: seam parameter, shape (M,).
        start: joint angles to start from by name of station or positioner, each of shape (M, n) [rad].
        free: offsets of free angles, if any.
    """
    found, bad, table = {}, [], None
    if cell.positioner is not None:
        name = cell.positioner.name
        table, off = turn_upright(cell, placement, s, start[name], free)
        found[name] = table
        bad += [Unclosed(name, float(s[i]), 0.0, float(off[i])) for i in np.flatnonzero(~(off <= posture_limit(cell)))]
    for station in cell.stations:
        wanted = ref.required_pose(cell, station, placement, s, table, free)
        found[station.name], error = close_chain(station, wanted, start[station.name])
        position, rotation = ref.error_size(error)
        for i in np.flatnonzero(~((position <= CLOSED) & (rotation <= CLOSED))):
            bad.append(Unclosed(station.name, float(s[i]), float(position[i]), float(rotation[i])))
    return found, bad


def _joints_of_pieces(cell: Cell, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where pieces of the seam join between samples: after which, at which parameter, at what share."""
    at = breaks(cell)
    if cell.seam.closed:
        at = np.sort(s[0] + (at - s[0]) % 1.0)
    after = np.searchsorted(s, at, side="right") - 1
    inside = (after >= 0) & (after < len(s) - 1)
    after, at = after[inside], at[inside]
    before, beyond = at - s[after], s[after + 1] - at
    new = (before > SAME_S) & (beyond > SAME_S)
    return after[new], at[new], (before / (before + beyond))[new]


def _one_turn_on(path: np.ndarray) -> np.ndarray:
    """Return the first row again, each joint moved by the whole turns that bring it nearest the last row."""
    return path[0] + 2 * np.pi * np.round((path[-1] - path[0]) / (2 * np.pi))


def _ends(
    cell: Cell, placement: np.ndarray, s: np.ndarray, q: dict[str, np.ndarray], free: Offsets | None = None
) -> dict[str, np.ndarray]:
    """Return capsule ends in W by name, each (M, ends, 3) [m]; the workpiece's with the positioner's, or under ''."""
    ends = {}
    for station in cell.stations:
        T_W_L = ref.link_poses(station, q[station.name])
        ends[station.name] = ref.body_ends(station, T_W_L, ref.tcp_pose(station, T_W_L))
    if cell.positioner is None:
        ends[""] = ref.workpiece_ends(cell, ref.workpiece_pose(cell, placement, s, free=free))
    else:
        table = q[cell.positioner.name]
        own = ref.positioner_ends(cell, ref.positioner_links(cell, placement, table))
        carried = ref.workpiece_ends(cell, ref.workpiece_pose(cell, placement, s, table))
        ends[cell.positioner.name] = np.concatenate([own, carried], axis=1)
    return {name: x.reshape(len(s), 2 * x.shape[1], 3) for name, x in ends.items()}


def _steps_m(ends: np.ndarray) -> np.ndarray:
    """Return the longest way of any body end in each interval, shape (K - 1,) [m]."""
    return np.linalg.norm(np.diff(ends, axis=0), axis=-1).max(axis=-1, initial=0.0)
