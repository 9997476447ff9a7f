"""Everything there is to see along a timeline, computed from its joints alone."""

from dataclasses import dataclass, field

import numpy as np

from nlpweld.cell import Cell, Grasp, Station
from nlpweld.geometry.seam import weld_frames
from nlpweld.plan import Plan
from nlpweld.timeline import Timeline
from nlpweld.verify import reference as ref
from nlpweld.verify.freedom import Offsets

BETWEEN = 10  # samples for every interval of the timeline
STEP_S = 1e-6  # of the seam parameter, by which its tangent is measured
SETTLED = 12  # steps towards the nearest point of a seam


@dataclass(frozen=True, eq=False)
class Moving:
    """A timeline at M instants.

    Attributes:
        plan: the timed plan.
        timeline: its time axis.
        t_s: instants, shape (M,).
        phase: index of each instant's phase among the timeline's, shape (M,).
        q: angles and their derivatives up to the third by name, each of shape (4, M, n).
        links: link poses by name, each of shape (M, n + 1, 4, 4).
        tcps: T_W_E by station, each of shape (M, 4, 4).
        T_W_C: poses of the workpiece, shape (M, 4, 4), by the positioner, or by the first robot that carries it.
        twist: of a frame fixed to the workpiece at its origin, linear then angular, in W, shape (M, 6).
    """

    plan: Plan
    timeline: Timeline
    t_s: np.ndarray
    phase: np.ndarray
    q: dict[str, np.ndarray]
    links: dict[str, np.ndarray] = field(repr=False)
    tcps: dict[str, np.ndarray] = field(repr=False)
    T_W_C: np.ndarray = field(repr=False)
    twist: np.ndarray = field(repr=False)

    @property
    def cell(self) -> Cell:
        """The cell."""
        return self.plan.cell

    def named(self, sample: int) -> tuple[float, str]:
        """Return instant and phase of a sample."""
        return float(self.t_s[sample]), self.timeline.phases[int(self.phase[sample])][0]

    def during(self, name: str) -> np.ndarray:
        """Return the samples of a phase, its ends included, shape (K,); none where the timeline has no such phase."""
        begin, end = self.timeline.span_s(name)
        return np.flatnonzero((self.t_s >= begin) & (self.t_s <= end)) if end > begin else np.empty(0, dtype=int)


def between_instants(t_s: np.ndarray, count: int = BETWEEN) -> np.ndarray:
    """Return every instant and what divides the way to the next into so many parts."""
    shares = np.arange(count) / count
    return np.append((t_s[:-1, None] + np.diff(t_s)[:, None] * shares).reshape(-1), t_s[-1])


def moving(plan: Plan, timeline: Timeline, t_s: np.ndarray) -> Moving:
    """Return a timeline at instants (M,), M > 0."""
    cell = plan.cell
    derivatives = [timeline.at(t_s, k) for k in range(4)]
    q = {name: np.stack([d[name] for d in derivatives]) for name in timeline.tracks}
    links = {st.name: ref.link_poses(st, q[st.name][0]) for st in cell.stations}
    tcps = {st.name: ref.tcp_pose(st, links[st.name]) for st in cell.stations}
    ends = np.array([until for _, until in timeline.phases])
    phase = np.minimum(np.searchsorted(ends, t_s), len(ends) - 1)
    if cell.positioner is not None:
        name = cell.positioner.name
        links[name] = ref.positioner_links(cell, plan.placement, q[name][0])
        T_W_C = ref.workpiece_pose(cell, plan.placement, t_s, q[name][0])
        twist = twist_at(links[name], links[name][:, -1], q[name][1], T_W_C[:, :3, 3])
    else:
        holder = next(st for st in cell.stations if isinstance(st.coupling, Grasp))
        assert isinstance(holder.coupling, Grasp)
        T_W_C = tcps[holder.name] @ np.linalg.inv(holder.coupling.T_C_E)
        twist = twist_at(links[holder.name], tcps[holder.name], q[holder.name][1], T_W_C[:, :3, 3])
    return Moving(plan, timeline, t_s, phase, q, links, tcps, T_W_C, twist)


def twist_at(links: np.ndarray, T_W_E: np.ndarray, rate: np.ndarray, p_W: np.ndarray) -> np.ndarray:
    """Return the twist, linear then angular in W, of a point p_W (M, 3) that moves with a chain's end, shape (M, 6)."""
    v, omega = np.split((ref.jacobian(links, T_W_E) @ rate[..., None])[..., 0], 2, axis=-1)
    return np.concatenate([v + np.cross(omega, p_W - T_W_E[:, :3, 3]), omega], axis=-1)


@dataclass(frozen=True, eq=False)
class OnSeam:
    """Where a torch's weld point is while it welds, at K samples.

    Attributes:
        at: the samples, shape (K,).
        s: parameter of the seam's nearest point, shape (K,); a closed seam ends at 1.
        off_m: how far that is, shape (K,).
        speed_m_s: speed of the weld point as the workpiece sees it, shape (K,).
        off_rad: angle of the torch off what the plan asks there, shape (K,).
    """

    at: np.ndarray
    s: np.ndarray
    off_m: np.ndarray
    speed_m_s: np.ndarray
    off_rad: np.ndarray


def on_seam(seen: Moving, station: Station, free: Offsets | None) -> OnSeam:
    """Return how a torch follows its seam."""
    at = seen.during("weld")
    cell, torch = seen.cell, station.coupling
    assert not isinstance(torch, Grasp)
    T_W_E, T_W_C = seen.tcps[station.name][at], seen.T_W_C[at]
    ahead = T_W_E[:, :3, 2] * (torch.angles.stand_off_m if torch.angles else 0.0)
    p_W = T_W_E[:, :3, 3] + ahead
    p_C = np.einsum("mji,mj->mi", T_W_C[:, :3, :3], p_W - T_W_C[:, :3, 3])
    s, off = _nearest(cell, torch.seam, p_C, seen.timeline.s_at(seen.t_s[at]))
    own = twist_at(seen.links[station.name][at], T_W_E, seen.q[station.name][1][at], p_W)[:, :3]
    work = seen.twist[at]
    apart = own - work[:, :3] - np.cross(work[:, 3:], p_W - T_W_C[:, :3, 3])
    table = seen.q[cell.positioner.name][0][at] if cell.positioner else None
    asked = ref.required_pose(cell, station, seen.plan.placement, np.clip(s, 0.0, 1.0), table, free)
    off_rad = ref.error_size(ref.pose_error(asked, T_W_E))[1]
    return OnSeam(at, s, off, np.linalg.norm(apart, axis=-1), off_rad)


def _nearest(cell: Cell, seam: str, p_C: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return parameter and distance of the seam's nearest points to others, shapes (M,), from parameters near them."""
    for _ in range(SETTLED):
        frames = weld_frames(cell, s, seam)
        low, high = np.maximum(s - STEP_S, 0.0), np.minimum(s + STEP_S, 1.0)
        chord = weld_frames(cell, high, seam).p_C - weld_frames(cell, low, seam).p_C
        rate = np.linalg.norm(chord, axis=-1) / (high - low)
        step = ((p_C - frames.p_C) * frames.tangent_C).sum(axis=-1) / rate
        s = np.clip(s + step, 0.0, 1.0)
        if np.abs(step).max(initial=0.0) < 1e-13:
            break
    return s, np.linalg.norm(p_C - weld_frames(cell, s, seam).p_C, axis=-1)
