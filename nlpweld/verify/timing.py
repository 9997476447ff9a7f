"""``verify_timing``: a timed plan in, a report out, from its timeline and its cell alone."""

from itertools import pairwise

import numpy as np

from nlpweld.cell import Cell, Grasp, Station
from nlpweld.cell.robot import DRIVES
from nlpweld.errors import MotionError, PlanError
from nlpweld.plan import Plan, joint_counts
from nlpweld.timeline import Timeline
from nlpweld.verify import time_rules as rules
from nlpweld.verify.apart_in_time import Apart, apart
from nlpweld.verify.check import LARGEST
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.in_time import BETWEEN, Moving, OnSeam, between_instants, moving, on_seam
from nlpweld.verify.timing_report import KINDS, Failure, Nearest, Slowed, TimingReport, Use


def verify_timing(plan: Plan) -> TimingReport:
    """Compute everything about a plan's time axis again and hold it against its cell.

    Instants looked at are those of the timeline and nine between any two of them. Joints follow the timeline's
    quintics, so what is checked is the motion as it is defined, and not a claim about it.

    Args:
        plan: a timed plan.

    Raises:
        PlanError: the plan is not timed, or its timeline holds what is no number.
        MotionError: the cell has no [timing] table, or a robot does not state its drives.
        VerifierError: the geometry process hung or died twice.
    """
    timeline, cell = plan.timeline, plan.cell
    if timeline is None:
        raise PlanError("the plan has no timeline; time it with 'nlpweld time'")
    if cell.timing is None:
        raise MotionError(f"{cell.name}: has no [timing] table to hold a timeline against; add one")
    limits = drive_limits(cell)
    _refuse_no_numbers(timeline, cell)
    seen = moving(plan, timeline, between_instants(timeline.t_s, BETWEEN))
    near = apart(plan, timeline)
    found = [*rules.phases(seen)]
    if any(one.phase == "weld" for one in found):
        raise PlanError("the timeline has no weld; time the plan again")
    free = None if plan.freedom is None else Offsets(np.asarray(plan.s), cell.seam.closed, plan.freedom)
    torches = {st.name: on_seam(seen, st, free) for st in cell.stations if not isinstance(st.coupling, Grasp)}
    main = _main(cell)
    posture, loose = (
        rules.posture_off(seen, torches[main.name], free),
        rules.allowance(seen, torches[main.name], cell.timing),
    )
    rigid = rules.rigid(seen)
    found += [
        *rules.joints(seen),
        *rules.drives(seen, limits),
        *rules.closure(seen, rigid),
        *rules.carried(seen, cell.timing),
        *rules.seam(seen, torches),
        *rules.directions(seen, torches, (torches[main.name], posture), loose),
        *rules.speed(seen, torches[main.name], main, cell.timing.torch.speed_m_s),
        *rules.points(seen, torches[main.name], loose),
        *rules.home(seen, cell.timing),
        *rules.rest(seen),
        *rules.axis(seen, torches),
        *rules.clearance(seen, near),
    ]
    uses = Uses(seen, limits)
    strict = loose < rules.SPLINE_RAD
    offs = [*(torch.off_rad for torch in torches.values()), posture]
    return TimingReport(
        cell=cell.name,
        cycle_s=timeline.duration_s,
        arc_on_s=timeline.arc_on_s,
        phases=tuple((name, *timeline.span_s(name)) for name, _ in timeline.phases),
        speed_m_s=cell.timing.torch.speed_m_s,
        fastest_m_s=float(torches[main.name].speed_m_s.max()),
        slowed=tuple(slowed(seen, torches[main.name], uses)),
        most=uses.most(),
        nearest_limit=uses.intervals(),
        windings=windings(timeline, *timeline.span_s("weld")) if cell.seam.closed else {},
        left=windings(timeline, 0.0, timeline.duration_s),
        closure_m=max((float(off.max()) for off, _ in rigid.values()), default=0.0),
        closure_rad=max((float(off.max()) for _, off in rigid.values()), default=0.0),
        seam_m=max(float(torch.off_m.max()) for torch in torches.values()),
        torch_rad=max(_greatest(torch.off_rad, strict) for torch in torches.values()),
        posture_rad=_greatest(posture, strict),
        blended_rad=max(_greatest(off, ~strict) for off in offs),
        clearance=nearest(timeline, near),
        samples=len(seen.t_s),
        failures=tuple(found),
        torch_speed=np.stack([seen.t_s[torches[main.name].at], torches[main.name].speed_m_s]),
    )


def drive_limits(cell: Cell) -> dict[str, np.ndarray]:
    """Return the greatest rate, acceleration and jerk of all joints by name, each of shape (3, n) [rad/s and so on].

    Raises:
        MotionError: a robot or positioner does not state one of them.
    """
    robots = {station.name: station.robot for station in cell.stations}
    robots |= {cell.positioner.name: cell.positioner.robot} if cell.positioner else {}
    for robot in robots.values():
        for name, row in zip(DRIVES, robot.drive_limits, strict=True):
            if np.isnan(row).any():
                raise MotionError(f"robot '{robot.name}': drives.{name} is not stated; add it to time a plan")
    return {name: robot.drive_limits for name, robot in robots.items()}


class Uses:
    """How much of every limit is used at every sample."""

    def __init__(self, seen: Moving, limits: dict[str, np.ndarray]) -> None:
        """Divide by the limits, by name, each of shape (3, n)."""
        self.seen = seen
        self.who = [(name, j, kind) for name, row in limits.items() for kind in KINDS for j in range(row.shape[1])]
        shares = [np.abs(seen.q[name][1:]) / row[:, None] for name, row in limits.items()]
        self.used = np.concatenate([share.transpose(0, 2, 1).reshape(-1, len(seen.t_s)) for share in shares])

    def use(self, samples: np.ndarray) -> Use:
        """Return the greatest use in a while."""
        row = int(self.used[:, samples].max(axis=1).argmax())
        name, joint, kind = self.who[row]
        t = self.seen.t_s[samples]
        return Use(float(t[0]), float(t[-1]), name, f"J{joint + 1}", kind, float(self.used[row, samples].max()))

    def most(self) -> tuple[Use, ...]:
        """Return the greatest use of each kind, at its instant."""
        found = []
        for kind in KINDS:
            rows = np.array([k for k, (_, _, own) in enumerate(self.who) if own == kind])
            row, sample = np.unravel_index(self.used[rows].argmax(), self.used[rows].shape)
            name, joint, _ = self.who[rows[row]]
            at = float(self.seen.t_s[sample])
            found.append(Use(at, at, name, f"J{joint + 1}", kind, float(self.used[rows[row], sample])))
        return tuple(found)

    def intervals(self) -> tuple[Use, ...]:
        """Return, one after the other, the whiles in which the same joint is nearest the same limit."""
        first = self.used.argmax(axis=0)
        starts = np.concatenate([[0], np.flatnonzero(np.diff(first)) + 1, [len(first)]])
        found = []
        for a, b in pairwise(starts.tolist()):
            name, joint, kind = self.who[int(first[a])]
            end = float(self.seen.t_s[min(b, len(first) - 1)])
            most = float(self.used[first[a], a:b].max())
            found.append(Use(float(self.seen.t_s[a]), end, name, f"J{joint + 1}", kind, most))
        return tuple(found)


def slowed(seen: Moving, torch: OnSeam, uses: Uses) -> list[Slowed]:
    """Return where a torch is slower than asked between its ramps."""
    assert seen.cell.timing is not None
    v, asked = torch.speed_m_s, seen.cell.timing.torch.speed_m_s
    begin, end = _ramp(v, rules.SPEED * asked), len(v) - _ramp(v[::-1], rules.SPEED * asked)
    slow = v < asked * (1 - rules.SPEED)
    slow[:begin] = slow[end:] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], slow.astype(int), [0]])))
    found = []
    for a, b in edges.reshape(-1, 2):
        t = seen.t_s[torch.at[[a, b - 1]]]
        where = float(torch.s[a]), float(torch.s[b - 1])
        found.append(Slowed(float(t[0]), float(t[1]), where, float(v[a:b].min()), uses.use(torch.at[a:b])))
    return found


def _ramp(v: np.ndarray, noise: float) -> int:
    """Return how many speeds (K,) a first rise takes until it ends, differences up to the noise not counted."""
    falls = np.flatnonzero(v < np.maximum.accumulate(v) - noise)
    top = v[: falls[0] if len(falls) else len(v)].max(initial=0.0)
    return int(np.argmax(v >= top - noise)) if len(v) else 0


def windings(timeline: Timeline, begin_s: float, end_s: float) -> dict[str, tuple[int, ...]]:
    """Return by name how many whole turns every joint is on between two instants."""
    q = timeline.at(np.array([begin_s, end_s]))
    turns = {name: np.round((x[1] - x[0]) / (2 * np.pi)).astype(int) for name, x in q.items()}
    return {name: tuple(row.tolist()) for name, row in turns.items()}


def nearest(timeline: Timeline, near: Apart) -> tuple[Nearest, ...]:
    """Return the nearest bodies of each phase."""
    spans = ((name, timeline.span_s(name)) for name, _ in timeline.phases)
    return tuple(Nearest(name, *near.nearest(*span)) for name, span in spans)


def _main(cell: Cell) -> Station:
    """Return the first torch of the main seam, or the first of any."""
    torches = [st for st in cell.stations if not isinstance(st.coupling, Grasp)]
    return next((st for st in torches if getattr(st.coupling, "seam", "") == "main"), torches[0])


def _greatest(values: np.ndarray, where: np.ndarray) -> float:
    return float(values[where].max(initial=0.0))


def _refuse_no_numbers(timeline: Timeline, cell: Cell) -> None:
    counts = joint_counts(cell)
    if set(timeline.tracks) != set(counts):
        raise PlanError(
            f"timeline.tracks: for {sorted(timeline.tracks)}, but the cell has {sorted(counts)}; time it again"
        )
    for name, track in timeline.tracks.items():
        for rows in (track.q, track.rate, track.acceleration):
            if rows.shape != (len(timeline.t_s), counts[name]) or not (np.abs(rows) < LARGEST).all():
                raise PlanError(
                    f"timeline.tracks.{name}: not one finite row of {counts[name]} for each instant; time it again"
                )


__all__ = ["Failure", "TimingReport", "drive_limits", "verify_timing"]
