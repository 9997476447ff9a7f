"""The time axis of a plan: joint angles, rates and accelerations at instants, and the motion between them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import PPoly

PHASES = ("approach", "plunge", "weld", "withdraw", "retreat")
SHORTEST_S = 1e-9  # between two instants
LARGEST = 1e9  # [s], [rad] and their rates; beyond it quintics overflow


@dataclass(frozen=True, eq=False)
class Track:
    """How the joints of one robot or positioner move, in DH direction, each array of shape (M, n).

    Attributes:
        q: joint angles [rad].
        rate: their first derivative [rad/s].
        acceleration: their second derivative [rad/s^2].
    """

    q: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray

    def to_json(self) -> dict[str, Any]:
        """Return the track as plain data."""
        return {
            "q_rad": self.q.tolist(),
            "rate_rad_s": self.rate.tolist(),
            "acceleration_rad_s2": self.acceleration.tolist(),
        }


@dataclass(frozen=True, eq=False)
class Timeline:
    """When everything a plan moves is where.

    Between two instants every joint follows the quintic polynomial that meets angle, rate and acceleration at both, so
    the motion is defined, and twice continuously differentiable, at every instant.

    Attributes:
        t_s: instants, shape (M,), increasing from 0 [s].
        s: seam parameter of the torches, shape (M,): held before and after the weld, and 1 at the end of a closed seam.
        phases: names out of :data:`PHASES` in their order, and when each ends [s]; the last ends with the timeline.
        tracks: name of station or positioner to its track.
    """

    t_s: np.ndarray
    s: np.ndarray
    phases: tuple[tuple[str, float], ...]
    tracks: dict[str, Track]

    @property
    def duration_s(self) -> float:
        """The cycle time [s]."""
        return float(self.t_s[-1])

    def span_s(self, phase: str) -> tuple[float, float]:
        """Return when a phase begins and ends [s]; both the same where the timeline has none of it."""
        begin = 0.0
        for name, until in self.phases:
            if name == phase:
                return begin, until
            begin = until
        return begin, begin

    @property
    def arc_on_s(self) -> float:
        """How long the torches weld [s]."""
        begin, end = self.span_s("weld")
        return end - begin

    def at(self, t_s: np.ndarray, derivative: int = 0) -> dict[str, np.ndarray]:
        """Return by name the joints' angles, or a derivative of them, at any instants (K,), each of shape (K, n).

        Args:
            t_s: instants [s], held to the timeline's ends.
            derivative: 0 for angles [rad], 1 for rates [rad/s], and so on up to 3 for jerk [rad/s^3].
        """
        held = np.clip(t_s, 0.0, self.duration_s)
        return {name: curve(held, nu=derivative) for name, curve in self._curves.items()}

    def s_at(self, t_s: np.ndarray) -> np.ndarray:
        """Return the seam parameter at any instants (K,), linear between those of the timeline."""
        return np.interp(t_s, self.t_s, self.s)

    @cached_property
    def _curves(self) -> dict[str, PPoly]:
        return {name: quintic(self.t_s, track) for name, track in self.tracks.items()}

    def to_json(self) -> dict[str, Any]:
        """Return the timeline as plain data."""
        return {
            "t_s": self.t_s.tolist(),
            "s": self.s.tolist(),
            "phases": [{"name": name, "until_s": until} for name, until in self.phases],
            "tracks": {name: track.to_json() for name, track in self.tracks.items()},
        }


def timeline_from(data: Any, counts: Mapping[str, int]) -> Timeline:
    """Return a timeline from plain data.

    Args:
        data: what :meth:`Timeline.to_json` returned.
        counts: number of joints by name of everything the plan moves.

    Raises:
        ValueError: something is missing or contradicts the rest; says where.
    """
    if not isinstance(data, dict):
        raise ValueError("timeline: not a table")
    t_s, s = _array(data, "t_s", (-1,)), _array(data, "s", (-1,))
    if len(t_s) < 2 or t_s[0] != 0.0 or not (np.diff(t_s) > SHORTEST_S).all():
        raise ValueError("timeline.t_s: not at least two increasing instants from 0")
    if len(s) != len(t_s) or not (np.diff(s) >= 0).all() or s[0] < 0 or s[-1] > 1:
        raise ValueError("timeline.s: not one number in [0, 1] for each instant, none below the one before")
    given = data.get("tracks")
    if not isinstance(given, dict) or set(given) != set(counts):
        raise ValueError(f"timeline.tracks: not one for each of {', '.join(counts)}")
    tracks = {name: _track(given[name], f"tracks.{name}", (len(t_s), n)) for name, n in counts.items()}
    return Timeline(t_s, s, _phases(data.get("phases"), float(t_s[-1])), tracks)


def quintic(t_s: np.ndarray, track: Track) -> PPoly:
    """Return the piecewise quintic through a track, coefficients of falling powers (6, M - 1, n)."""
    h = np.diff(t_s)[:, None]
    q0, v0, a0 = track.q[:-1], track.rate[:-1], track.acceleration[:-1]
    rest = np.diff(track.q, axis=0) - h * (v0 + h * a0 / 2)  # what the cubic and higher terms bring by the end
    rate = track.rate[1:] - v0 - h * a0
    bend = track.acceleration[1:] - a0
    cubic = (10 * rest / h - 4 * rate + h * bend / 2) / h**2
    quartic = (-15 * rest / h + 7 * rate - h * bend) / h**3
    fifth = (6 * rest / h - 3 * rate + h * bend / 2) / h**4
    return PPoly(np.stack([fifth, quartic, cubic, a0 / 2, v0, q0]), t_s)


def _phases(given: Any, end_s: float) -> tuple[tuple[str, float], ...]:
    try:
        phases = tuple((str(one["name"]), float(one["until_s"])) for one in given)
    except (TypeError, KeyError, ValueError, OverflowError):
        raise ValueError("timeline.phases: not a list of name and until_s") from None
    known = [PHASES.index(name) if name in PHASES else -1 for name, _ in phases]
    ends = [0.0, *(until for _, until in phases)]
    if not known or min(known) < 0 or known != sorted(set(known)):
        raise ValueError(f"timeline.phases: not some of {', '.join(PHASES)}, in this order")
    if not all(a <= b for a, b in pairwise(ends)) or ends[-1] != end_s:
        raise ValueError("timeline.phases: until_s does not grow to the last instant")
    return phases


def _track(data: Any, where: str, shape: tuple[int, int]) -> Track:
    if not isinstance(data, dict):
        raise ValueError(f"timeline.{where}: not a table")
    return Track(*(_array(data, name, shape, where) for name in ("q_rad", "rate_rad_s", "acceleration_rad_s2")))


def _array(data: dict[str, Any], name: str, shape: tuple[int, ...], where: str = "") -> np.ndarray:
    where = f"timeline.{where}.{name}" if where else f"timeline.{name}"
    try:
        array = np.array(data.get(name), dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{where}: not an array of numbers") from None
    if not (np.abs(array) < LARGEST).all():
        raise ValueError(f"{where}: holds NaN or infinity, or nearly")
    if array.ndim != len(shape) or (shape != (-1,) and array.shape != shape):
        raise ValueError(f"{where}: not of shape {shape}" if shape != (-1,) else f"{where}: not a list of numbers")
    return array
