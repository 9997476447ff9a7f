"""S-curves: the quickest moves from rest to rest under limits of velocity, acceleration and jerk (Cao et al. 2012).

Cao et al. tell three cases apart: a move that cruises at the velocity limit (eq. 7 to 9), one that reaches the
acceleration limit but not that velocity (eq. 10), and one that reaches neither (eq. 11). They leave out a velocity
limit below acceleration^2 / jerk, where a cruise follows jerk alone, and a move of no length. All five have the same
seven pieces, some of length zero: jerk up, none, down; cruise; and the first three mirrored.
"""

from dataclasses import dataclass

import numpy as np

from nlpweld.errors import MotionError
from nlpweld.motion.limits import Limits, finite

BLOCK = 8192  # moves planned at a time: what that takes stays within a core's cache


@dataclass(frozen=True, eq=False)
class SCurve:
    """Moves from rest to rest; every array has the shape of the moves.

    A move speeds up in ``rise_s``, of which the first and the last ``jerk_s`` are at the greatest jerk used, goes on at
    its peak for ``cruise_s``, and slows down as it sped up.

    Attributes:
        displacement: from start to end, signed.
        jerk: magnitude of the jerk used.
        jerk_s: how long a jerk lasts [s].
        rise_s: how long the move speeds up [s].
        cruise_s: how long it stays at its peak velocity [s].
    """

    displacement: np.ndarray
    jerk: np.ndarray
    jerk_s: np.ndarray
    rise_s: np.ndarray
    cruise_s: np.ndarray

    @property
    def duration_s(self) -> np.ndarray:
        """How long the moves take [s]."""
        return 2 * self.rise_s + self.cruise_s

    @property
    def peak_velocity(self) -> np.ndarray:
        """Greatest speed of the moves."""
        return self.jerk * self.jerk_s * (self.rise_s - self.jerk_s)

    @property
    def peak_acceleration(self) -> np.ndarray:
        """Greatest acceleration of the moves."""
        return self.jerk * self.jerk_s

    def at(self, t_s: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Return position from the start, or a derivative of it, at instants; they broadcast against the moves.

        Before its start a move rests there, and after its end at its end, exactly.

        Args:
            t_s: instants from the start of the moves [s].
            derivative: 0 for position, 1 for velocity, 2 for acceleration, 3 for jerk, which jumps between pieces.
        """
        outside = (t_s < 0) | (t_s > self.duration_s)
        t_s = np.clip(t_s, 0.0, self.duration_s)
        late = t_s > self.duration_s / 2
        # the second half is the first one seen from the end, so that the end is met to the last bit
        value = self._first_half(np.where(late, self.duration_s - t_s, t_s), derivative)
        if derivative == 0:
            value = np.where(late, np.abs(self.displacement) - value, value)
        elif derivative == 2:
            value = np.where(late, -value, value)
        elif derivative == 3:
            value = np.where(outside, 0.0, value)
        return np.sign(self.displacement) * value

    def time_at(self, position: np.ndarray) -> np.ndarray:
        """Return when the moves pass positions between start and end, counted from the start with its sign [s].

        These are the one-sided pieces of Cao et al.'s cycle: f(z_0, z_1, z_max) is when a move of z_max - z_0 passes
        z_1 - z_0, and g(z_2, z_3, z_max) is what a move of z_3 - z_max takes beyond passing z_2 - z_max.

        Raises:
            MotionError: a position is not between start and end.
        """
        along = finite(position, "position") * np.sign(self.displacement)
        length = np.abs(self.displacement)
        if ((along < 0) | (along > length)).any() or ((self.displacement == 0) & (np.asarray(position) != 0)).any():
            raise MotionError("position: not between start and end of the move; give one the move passes")
        late = along > length / 2
        passed = self._passing(np.where(late, length - along, along))
        return np.where(late, self.duration_s - passed, passed)

    def stretched(self, duration_s: np.ndarray) -> "SCurve":
        """Return the same moves slowed to a longer duration [s]: what they used of every limit only shrinks.

        A move of no length stays at rest and takes no time.

        Raises:
            MotionError: a duration is shorter than the quickest.
        """
        own = self.duration_s
        if (duration_s < own * (1 - 1e-12)).any():
            raise MotionError("duration_s: shorter than the quickest move; give at least that")
        ratio = np.where(own > 0, duration_s / np.where(own > 0, own, 1.0), 1.0)
        times = (self.jerk_s * ratio, self.rise_s * ratio, self.cruise_s * ratio)
        return SCurve(self.displacement + 0 * ratio, self.jerk / ratio**3, *times)

    def _first_half(self, u: np.ndarray, derivative: int) -> np.ndarray:
        """Return the unsigned value at u [s] from the start, up to half the move."""
        back = np.maximum(self.rise_s - u, 0.0)  # what is left of the rise: its second half mirrors its first
        early = u < back
        value = _onset(self.jerk, self.jerk_s, np.where(early, u, back), derivative)
        if derivative == 0:
            return np.where(early, value, self.peak_velocity * (u - self.rise_s / 2) + value)
        if derivative == 1:
            return np.where(early, value, self.peak_velocity - value)
        if derivative == 2:
            return value
        return np.where(early, value, np.where(u < self.rise_s, -value, 0.0))

    def _passing(self, x: np.ndarray) -> np.ndarray:
        """Return when unsigned positions x up to half the way are passed [s]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            top, half_way = self.peak_velocity, self.peak_velocity * self.rise_s / 2
            middle = _onset(self.jerk, self.jerk_s, self.rise_s / 2, 0)
            first = _onset_time(self.jerk, self.jerk_s, np.minimum(x, middle))
            # from the rise's middle to its end, position is top (u - rise/2) + onset(rise - u)
            flat = _flat_time(top, self.jerk, self.jerk_s, self.rise_s, x)
            cruise = self.rise_s + (x - half_way) / top
            u = np.where(x <= middle, first, np.where(x < half_way, flat, cruise))
        return np.where(self.displacement == 0, 0.0, u)


def s_curve(displacement: np.ndarray, limits: Limits) -> SCurve:
    """Plan the quickest moves from rest to rest.

    Args:
        displacement: signed lengths of the moves, any shape that broadcasts with the limits.
        limits: in the same unit of length.

    Raises:
        MotionError: a displacement is no finite number, or it and the limits are so far apart in scale that a time
            overflows or vanishes.
    """
    given = finite(displacement, "displacement"), limits.velocity, limits.acceleration, limits.jerk
    length, *bounds = (array.copy() for array in np.broadcast_arrays(*given))  # contiguous, and ours
    times = np.empty((3, length.size))
    flat = [array.reshape(-1) for array in (np.abs(length), *bounds)]
    for begin in range(0, length.size, BLOCK):
        own = slice(begin, begin + BLOCK)
        times[:, own] = _times(*(array[own] for array in flat))
    _check_scale(length, times)
    return SCurve(length, bounds[2], *times.reshape(3, *length.shape))


def synchronised(displacement: np.ndarray, limits: Limits) -> SCurve:
    """Plan moves of several axes that start and end together, as quickly as the slowest axis can.

    Every other axis is stretched to the slowest one's time, so that it keeps its limits with room to spare.

    Args:
        displacement: signed lengths of the moves, axes last, shape (..., n).
        limits: of every axis, shape (n,) or (..., n).

    Raises:
        MotionError: as :func:`s_curve`.
    """
    quickest = s_curve(displacement, limits)
    return quickest.stretched(quickest.duration_s.max(axis=-1, keepdims=True))


def _times(L: np.ndarray, V: np.ndarray, a: np.ndarray, J: np.ndarray) -> np.ndarray:
    """Return how long jerk, rise and cruise last for lengths L >= 0, shape (3, m)."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        full = a / J  # what it takes to reach the acceleration limit
        ramp = np.minimum(full, np.sqrt(V / J))  # the velocity limit may come first
        rise = ramp + np.where(ramp < full, ramp, V / a)
        cruise = L / V - rise
        short = ~(cruise >= 0)  # the velocity limit is not reached
        onset = np.minimum(full, np.cbrt(L / (2 * J)))  # nor, in the shortest, that of acceleration
        hill = np.where(onset < full, 2 * onset, full / 2 + np.sqrt(full * full / 4 + L / a))
    return np.stack([np.where(short, onset, ramp), np.where(short, hill, rise), np.where(short, 0.0, cruise)])


def _check_scale(displacement: np.ndarray, times: np.ndarray) -> None:
    """Refuse moves whose times overflow, and moves of some length that take no time."""
    moves = displacement.reshape(-1) != 0
    lost = ~np.isfinite(times).all(axis=0) | (moves & ~(times[0] > 0))
    if lost.any():
        worst = displacement.reshape(-1)[lost][0]
        raise MotionError(f"displacement {worst:g} and its limits are too far apart in scale; use other units")


def _onset(jerk: np.ndarray, jerk_s: np.ndarray, u: np.ndarray, derivative: int) -> np.ndarray:
    """Return the value at u [s] of a start from rest: constant jerk for ``jerk_s``, then none."""
    w = np.minimum(u, jerk_s)
    rest = u - w
    if derivative == 0:
        return jerk * w * (w * w / 6 + rest * (w + rest) / 2)
    if derivative == 1:
        return jerk * w * (w / 2 + rest)
    if derivative == 2:
        return jerk * w
    return np.where(u < jerk_s, jerk, 0.0)


def _onset_time(jerk: np.ndarray, jerk_s: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return when a start from rest (:func:`_onset`) has come as far as x [s]."""
    beyond = x - jerk * jerk_s**3 / 6
    v, a = jerk * jerk_s**2 / 2, jerk * jerk_s
    later = jerk_s + 2 * beyond / (v + np.sqrt(np.maximum(v * v + 2 * a * beyond, 0.0)))
    return np.where(beyond <= 0, np.cbrt(6 * x / jerk), later)


def _flat_time(top: np.ndarray, jerk: np.ndarray, jerk_s: np.ndarray, rise_s: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return when the second half of a rise passes x [s]: with r before its end, top (rise/2 - r) + onset(r) = x."""
    left = top * rise_s / 2 - x
    # while the acceleration falls: jerk r^3 / 6 - top r + left = 0, whose least root is that of sin(3 angle)
    third = 2 * top / jerk
    angle = np.arcsin(np.clip(3 * left / (jerk * third**1.5), -1.0, 1.0)) / 3
    falling = 2 * np.sqrt(third) * np.sin(angle)
    # while it is constant: onset(r) = jerk_s jerk (jerk_s^2 / 6 - jerk_s r / 2 + r^2 / 2), from the quadratic
    a = jerk * jerk_s
    b, c = top + a * jerk_s / 2, left + a * jerk_s**2 / 6
    constant = 2 * c / (b + np.sqrt(np.maximum(b * b - 2 * a * c, 0.0)))
    return rise_s - np.where(falling <= jerk_s, falling, constant)
