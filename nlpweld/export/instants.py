"""Which instants of a motion are written, and how far straight lines in joint space between them are from it."""

from itertools import pairwise

import numpy as np

from nlpweld.errors import OptionError
from nlpweld.timeline import Timeline

DEVIATION_RAD = float(np.radians(0.01))  # asked for where no step is: 0.3 mm at 1.6 m, for the joint that is worst
TICK_S = 1e-6  # instants are whole microseconds, so that times in text are exact
SHORTEST_S = 1e-3  # steps are not halved below this: controllers interpolate every few milliseconds
MOST = 100_000
DENSITY = 32  # places between two instants at which a deviation is looked at: a parabola is met to a thousandth


def chosen(timeline: Timeline, s: np.ndarray, every_s: float | None = None) -> np.ndarray:
    """Return the instants to be written, shape (K,) [s]: the ends of phases, and what is needed between them.

    Args:
        timeline: the motion.
        s: seam parameter of the plan's points, which are written too unless a step is given, shape (N,).
        every_s: the longest step between two instants, equal within a phase [s]; by default, as few of the timeline's
            own instants as keep every joint within ``DEVIATION_RAD`` of a straight line from one to the next, and
            middles where its own are too far apart for that.

    Raises:
        OptionError: the step is not above 0, or makes too many instants.
    """
    ends = _ticks(np.array([0.0, *(until for _, until in timeline.phases), timeline.duration_s]))
    if every_s is None:
        held = _ticks(np.concatenate([ends, _apart(_passing(timeline, s), ends)]))
        return _few_enough(_thinned(timeline, _refined(timeline, held), held))
    if not (np.isfinite(every_s) and every_s > 0):
        raise OptionError(f"--every {every_s:g} is no step above 0; give one in seconds, e.g. 0.05")
    counts = np.maximum(np.ceil(np.diff(ends) / every_s - 1e-9), 1)
    if counts.sum() > MOST:
        raise _too_many(int(counts.sum()))
    pieces = [np.linspace(*span, int(n), endpoint=False) for span, n in zip(pairwise(ends), counts, strict=True)]
    return _ticks(np.concatenate([*pieces, ends[-1:]]))


def deviation_rad(timeline: Timeline, t_s: np.ndarray) -> float:
    """Return how far any joint is, anywhere, from straight lines in joint space between instants (K,) [rad]."""
    between = np.union1d(t_s, timeline.t_s)
    fine = np.interp(np.arange(DENSITY * (len(between) - 1) + 1) / DENSITY, np.arange(len(between)), between)
    paths = (timeline.at(fine), timeline.at(t_s))
    return max(_off_chords(fine, paths[0][name], t_s, paths[1][name]).max() for name in timeline.tracks)


def _off_chords(fine: np.ndarray, q: np.ndarray, t_s: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return how far joints (F, n) are from straight lines between corners (K, n), the worst joint, shape (F,)."""
    chords = np.column_stack([np.interp(fine, t_s, corner) for corner in corners.T])
    return np.asarray(np.abs(q - chords).max(axis=1))


def _ticks(t_s: np.ndarray) -> np.ndarray:
    return np.unique(np.round(t_s / TICK_S)) * TICK_S


def _passing(timeline: Timeline, s: np.ndarray) -> np.ndarray:
    """Return when the torches pass points of the seam (N,), those that they pass while they weld [s]."""
    begin, end = timeline.span_s("weld")
    inside = (timeline.t_s >= begin) & (timeline.t_s <= end)
    moved = np.append(np.diff(timeline.s[inside]) > 0, True)  # of a rest, its last instant
    along, t_s = timeline.s[inside][moved], timeline.t_s[inside][moved]
    passed = (s >= along[0]) & (s <= along[-1]) if len(along) > 1 else np.zeros(len(s), dtype=bool)
    return np.interp(s[passed], along, t_s)


def _apart(t_s: np.ndarray, from_s: np.ndarray) -> np.ndarray:
    """Return those instants that are ``SHORTEST_S`` and more from others."""
    return t_s[np.abs(t_s[:, None] - from_s).min(axis=1) >= SHORTEST_S]


def _refined(timeline: Timeline, held: np.ndarray) -> np.ndarray:
    """Return the instants that are held and those of the timeline, with middles where a straight line is too far off.

    Half of what is allowed is for these, the other half for what :func:`_thinned` leaves out.
    """
    t_s = _ticks(np.concatenate([_apart(timeline.t_s, held), held]))
    while len(t_s) <= MOST:
        middle = (t_s[:-1] + t_s[1:]) / 2
        off = np.zeros(len(middle))
        for share in (0.25, 0.5, 0.75):
            at = t_s[:-1] + share * np.diff(t_s)
            q, corners = timeline.at(at), timeline.at(t_s)
            for name in timeline.tracks:
                off = np.maximum(off, _off_chords(at, q[name], t_s, corners[name]))
        split = (off > DEVIATION_RAD / 2) & (np.diff(t_s) > 2 * SHORTEST_S)
        if not split.any():
            break
        t_s = _ticks(np.concatenate([t_s, middle[split]]))
    return t_s


def _thinned(timeline: Timeline, t_s: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Return as few of some instants as will do: from one that is held to the next, split where a line is farthest off.

    That is the rule of Ramer (1972), and Douglas and Peucker (1973), with distances along the joint axes.
    """
    q = np.hstack(list(timeline.at(t_s).values()))
    keep = np.isin(t_s, held)
    todo = list(pairwise(np.flatnonzero(keep)))
    while todo:
        a, b = todo.pop()
        off = _off_chords(t_s[a : b + 1], q[a : b + 1], t_s[[a, b]], q[[a, b]])
        worst = a + int(off.argmax())
        if off.max() > DEVIATION_RAD / 2:
            keep[worst] = True
            todo += [(a, worst), (worst, b)]
    return t_s[keep]


def _few_enough(t_s: np.ndarray) -> np.ndarray:
    if len(t_s) > MOST:
        raise _too_many(len(t_s))
    return t_s


def _too_many(count: int) -> OptionError:
    return OptionError(f"--every: {count:,} instants; no more than {MOST:,} are written, give a longer step")
