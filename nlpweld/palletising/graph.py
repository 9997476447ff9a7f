"""The times of S-curves as CasADi graphs, for solvers that want derivatives; tests hold them to ``nlpweld.motion``.

Formulas are those of :class:`nlpweld.motion.SCurve`, for one axis with numbers for limits and a symbol for the length
of the move. Both sides of a case are evaluated, so every root and arcsine is kept within its domain on the wrong side.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.motion import Limits

TINY = 1e-12  # of a length [m] whose root is taken: slopes stay finite where a move ends


@dataclass(frozen=True, eq=False)
class Move:
    """A move from rest to rest; the pieces are those of :class:`nlpweld.motion.SCurve`.

    Attributes:
        length: from start to end, not negative.
        jerk: limit of the jerk, a number.
        jerk_s: how long a jerk lasts [s].
        rise_s: how long the move speeds up [s].
        cruise_s: how long it stays at its peak velocity [s].
    """

    length: Any
    jerk: float
    jerk_s: Any
    rise_s: Any
    cruise_s: Any

    @property
    def duration_s(self) -> Any:
        """How long the move takes [s]."""
        return 2 * self.rise_s + self.cruise_s

    def time_at(self, passed: Any) -> Any:
        """Return when a distance from the start is passed [s]."""
        late = passed > self.length / 2
        u = self._first_half(ca.if_else(late, self.length - passed, passed))
        return ca.if_else(late, self.duration_s - u, u)

    def _first_half(self, x: Any) -> Any:
        """Return when x is passed, which is no more than half the way [s]."""
        jerk, jerk_s, rise_s = self.jerk, self.jerk_s, self.rise_s
        top = jerk * jerk_s * (rise_s - jerk_s)
        rest = rise_s / 2 - jerk_s
        middle = jerk * jerk_s * (jerk_s**2 / 6 + rest * (jerk_s + rest) / 2)
        first = _onset_time(jerk, jerk_s, ca.fmin(x, middle))
        flat = rise_s - _before_top(top, jerk, jerk_s, ca.fmax(top * rise_s / 2 - x, 0.0))
        cruise = rise_s + (x - top * rise_s / 2) / top
        return ca.if_else(x <= middle, first, ca.if_else(x < top * rise_s / 2, flat, cruise))


def move(length: Any, limits: Limits) -> Move:
    """Return the quickest move of a length, not negative, under limits that are numbers."""
    v, a, jerk = (float(limit) for limit in (limits.velocity, limits.acceleration, limits.jerk))
    some = ca.fmax(length, TINY)
    full = a / jerk
    ramp = min(full, float(np.sqrt(v / jerk)))
    rise = ramp + (v / a if full <= ramp else ramp)
    cruise = some / v - rise
    onset = ca.fmin(full, _cbrt(some / (2 * jerk)))
    hill = ca.if_else(onset < full, 2 * onset, full / 2 + ca.sqrt(full**2 / 4 + some / a))
    short = cruise < 0
    pieces = ca.if_else(short, onset, ramp), ca.if_else(short, hill, rise), ca.if_else(short, 0.0, cruise)
    return Move(length, jerk, *pieces)


def _cbrt(x: Any) -> Any:
    return ca.fmax(x, 0.0) ** (1.0 / 3.0)


def _onset_time(jerk: float, jerk_s: Any, x: Any) -> Any:
    """Return when a start from rest has come as far as x: constant jerk for ``jerk_s``, then none [s]."""
    beyond = ca.fmax(x - jerk * jerk_s**3 / 6, 0.0)
    v, a = jerk * jerk_s**2 / 2, jerk * jerk_s
    later = jerk_s + 2 * beyond / (v + ca.sqrt(v * v + 2 * a * beyond))
    early = _cbrt(6 * ca.fmax(x, TINY) / jerk)
    return ca.if_else(beyond > 0, later, early)


def _before_top(top: Any, jerk: float, jerk_s: Any, left: Any) -> Any:
    """Return how long before the end of a rise it lags its top speed's line by ``left`` [s]."""
    third = 2 * top / jerk
    share = 3 * left / (jerk * third**1.5)
    falling = 2 * ca.sqrt(third) * ca.sin(ca.asin(ca.fmin(share, 1.0 - 1e-9)) / 3)
    a = jerk * jerk_s
    b, c = top + a * jerk_s / 2, left + a * jerk_s**2 / 6
    constant = 2 * c / (b + ca.sqrt(ca.fmax(b * b - 2 * a * c, TINY)))
    return ca.if_else(falling <= jerk_s, falling, constant)
