"""How fast a path is run: an S-curve of its own pace, slowed only where a joint's limit binds.

The pace alone makes an S-curve sigma(u) from rest to rest. The clock runs at du/dt = r(u), 0 < r <= 1:

- At every u a joint's rate, acceleration and jerk over u cap r at V/|q_u|, (A/|q_uu|)^(1/2) and (J/|q_uuu|)^(1/3).
- r is the uniform cubic B-spline each of whose coefficients is the least cap on its own support, and at most 1.
  B-splines sum to 1, so r never exceeds a cap; where none is below 1 within four knots, r is 1 and the speed that of
  the pace.
- A changing r adds ``q_u r r_u`` to accelerations, and so on; the pace itself is held to its limits as one more axis.
  Where a true value still exceeds its limit, the coefficients that bear on the place are lowered by as much as one
  of rate, square root of acceleration and cube root of jerk asks, until none does.

Where nothing binds, that is all. Else knots of half a rise of the S-curve and of 1/2, 1/4 and 1/8 of it are tried, and
the same for S-curves of lower speed or gentler ramps, for a ramp that has to be slowed takes longer than one that need
not; the run that ends first is taken. It is not the quickest there is: ``toppra``, which
knows no jerk, tells how far from that it is at most.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.interpolate import BSpline

from nlpweld.errors import MotionError
from nlpweld.motion import Limits, SCurve, s_curve
from nlpweld.timing.curve import Curve
from nlpweld.timing.sampling import MISS_RAD, refuse_endless

PER_KNOT = 16  # places between two knots at which limits are looked at
FEWEST, MOST = 8, 2000  # intervals of knots
ROUNDS = 100
PACES = (1.0, 0.7, 0.5, 0.35, 0.25)  # shares of the pace's speed that are tried,
RAMPS = (1.0, 0.75, 0.56)  # each with ramps of such shares of that,
FINER = (1, 2, 4, 8)  # and with so many knots in half a rise
KNOT_APART = 0.05  # of the way to the next knot
LOWERED = 1 - 1e-3  # beyond what a coefficient has to be lowered by
WITHIN = 1e-9  # of a limit, what rounding may exceed
JUMP = 4.5  # the quintic's jerk beside a jump of acceleration, over jump / interval: half of its 9 to either side
JUMP_MISS = 0.0087  # by how much it misses there, over jump * interval^2: half of its 0.0173


@dataclass(frozen=True, eq=False)
class Run:
    """A path run from rest to rest.

    Attributes:
        curve: what moves, over x.
        begin: x where it begins.
        pace: the S-curve of x, over u.
        clock: r as a spline of u, or None where it is 1.
        stretch: t / u besides, 1 or more.
    """

    curve: Curve
    begin: float
    pace: SCurve
    clock: BSpline | None = None
    stretch: float = 1.0

    @cached_property
    def breaks(self) -> np.ndarray:
        """The u at which a derivative jumps, shape (B,): pieces of the S-curve and of the path, and the clock's knots.

        Knots close to one of the others are left out: the clock's second derivative is continuous there.
        """
        marks = np.unique(np.concatenate([pieces(self.pace), self.inner]))
        if self.clock is None:
            return marks
        knots = self.clock.t[3:-3]
        alone = np.abs(knots[:, None] - marks).min(axis=1) > KNOT_APART * (knots[1] - knots[0])
        return np.sort(np.concatenate([marks, knots[alone]]))

    @cached_property
    def inner(self) -> np.ndarray:
        """The u at which the second or third derivative of the path jumps."""
        ends = self.curve.joins - self.begin
        inside = ends[(ends > 0) & (ends < float(self.pace.displacement))]
        return np.asarray(self.pace.time_at(inside))

    def motion(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return values and their first two derivatives by time at u (M,), each of shape (M, J)."""
        r, r_u = self.rates(u)[:2]
        d = [self.at(u, k) for k in range(3)]
        r, r_u = r[:, None], r_u[:, None]
        return d[0], d[1] * r, d[2] * r * r + d[1] * r * r_u

    def rates(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return r and its first two derivatives by u, each of shape (M,)."""
        if self.clock is None:
            return np.full(len(u), 1 / self.stretch), np.zeros(len(u)), np.zeros(len(u))
        r, r_u, r_uu = (self.clock(u, nu=k) / self.stretch for k in range(3))
        return r, r_u, r_uu

    def at(self, u: np.ndarray, derivative: int) -> np.ndarray:
        """Return what moves, or a derivative by u, shape (M, J)."""
        x, v, a, j = (self.pace.at(u, k)[:, None] for k in range(4))
        q = [self.curve.at(self.begin + x[:, 0], k) for k in range(derivative + 1)]
        if derivative == 0:
            return q[0]
        if derivative == 1:
            return q[1] * v
        if derivative == 2:
            sides = (q[2] + self.curve.at(self.begin + x[:, 0], 2, side="left")) / 2  # the mean where it jumps
            return sides * v * v + q[1] * a
        return q[3] * v**3 + 3 * q[2] * v * a + q[1] * j

    def times(self, u: np.ndarray) -> np.ndarray:
        """Return t at ascending u (M,) from 0, shape (M,) [s]."""
        if self.clock is None:
            return u * self.stretch
        nodes, weights = np.polynomial.legendre.leggauss(8)
        half = np.diff(u) / 2
        inside = u[:-1, None] + half[:, None] * (nodes + 1)
        return np.concatenate(
            [[0.0], np.cumsum(half * (weights / self.rates(inside.reshape(-1))[0].reshape(inside.shape)).sum(1))]
        )

    @property
    def duration_s(self) -> float:
        """How long it takes [s]."""
        marks = np.linspace(0, float(self.pace.duration_s), 2 if self.clock is None else 1 + 4 * len(self.clock.c))
        return float(self.times(marks)[-1])


def pieces(pace: SCurve) -> np.ndarray:
    """Return when the pieces of one S-curve begin and end, shape (8,) [s]."""
    ramp, rise, cruise = float(pace.jerk_s), float(pace.rise_s), float(pace.cruise_s)
    end = 2 * rise + cruise
    return np.array([0.0, ramp, rise - ramp, rise, rise + cruise, end - rise + ramp, end - ramp, end])


def paced(curve: Curve, pace: Limits, limits: np.ndarray, begin: float = 0.0, end: float | None = None) -> Run:
    """Return a path run at a pace, all of it slowed alike until every joint keeps its limits.

    Args:
        curve: joints over the length of the path.
        pace: of that length.
        limits: of rate, acceleration and jerk of every joint, shape (3, J).
        begin: where on the curve it begins.
        end: where it ends; with the curve by default.
    """
    run = Run(curve, begin, s_curve(np.array((curve.ends[-1] if end is None else end) - begin), pace))
    u = _places(run)
    used = np.stack([(np.abs(run.at(u, k + 1)) / limits[k]).max() ** (1 / (k + 1)) for k in range(3)])
    return Run(curve, begin, run.pace, None, max(1.0, float(used.max())))


def slowed(curve: Curve, pace: Limits, limits: np.ndarray, begin: float, end: float, step_s: float) -> Run:
    """Return a path run at a pace and slowed where a joint's limit binds, by the law above.

    Args:
        curve: joints over the length of the path.
        pace: of that length.
        limits: of rate, acceleration and jerk of every joint, shape (3, J).
        begin: where on the curve it begins.
        end: where it ends.
        step_s: greatest time between instants: over which a jump of acceleration is spread.

    Raises:
        MotionError: no slowing was found that keeps the limits, or it would take over an hour.
    """
    best, quickest_s = None, np.inf
    for share, gentler in product(PACES, RAMPS):
        ramp = share * gentler
        own = Limits(pace.velocity * share, pace.acceleration * ramp**2, pace.jerk * ramp**3)
        task = Task(Run(curve, begin, s_curve(np.array(end - begin), own)), limits, pace, step_s)
        if share == gentler == 1.0:
            refuse_endless(task.least_s, step_s)
        for finer in FINER:
            run = task.run if task.free else task.slowed(finer, quickest_s)
            if run is not None and run.duration_s < quickest_s:
                best, quickest_s = run, run.duration_s
            if task.free:
                break
        if task.free and gentler == 1.0:
            break
    if best is None:
        raise MotionError("weld: no slowing keeps the limits of the joints; ask for a lower speed")
    return best


def _places(run: Run) -> np.ndarray:
    """Return the u at which limits are looked at: even steps, and close to either side of every break."""
    total = float(run.pace.duration_s)
    count = int(np.clip(np.ceil(2 * total / max(float(run.pace.rise_s), 1e-12)), FEWEST, MOST)) * PER_KNOT
    near = 1e-9 * total
    return np.clip(
        np.unique(np.concatenate([np.linspace(0, total, count + 1), run.breaks - near, run.breaks + near])), 0, total
    )


class Task:
    """A run that may have to be slowed."""

    def __init__(self, run: Run, limits: np.ndarray, pace: Limits, step_s: float) -> None:
        """Look at what binds; the pace's own limits bind the path as one more axis."""
        self.run, self.u = run, _places(run)
        self.d = [np.hstack([run.at(self.u, k + 1), run.pace.at(self.u, k + 1)[:, None]]) for k in range(3)]
        path = np.array([[pace.velocity], [pace.acceleration], [pace.jerk]], dtype=float)
        self.bounds = np.hstack([limits, path])
        self.cap = self._cap()
        self.jumps = self._jumps(limits[2], step_s)

    @property
    def free(self) -> bool:
        """Whether nothing binds."""
        return bool(self.cap.min() >= 1 - WITHIN and self.jumps[1].min(initial=1.0) >= 1)

    @property
    def least_s(self) -> float:
        """How long it takes at least, the clock nowhere above a cap [s]."""
        return float(np.trapezoid(1 / np.minimum(self.cap, 1.0), self.u))

    def slowed(self, finer: int, quickest_s: float) -> Run | None:
        """Return the run with a clock, or None where it would take longer than the quickest yet.

        Args:
            finer: how many knots there are in half a rise of the S-curve.
            quickest_s: the quickest yet [s]; lowering coefficients only takes longer.
        """
        total = float(self.run.pace.duration_s)
        count = int(np.clip(np.ceil(2 * total / float(self.run.pace.rise_s)), FEWEST, MOST)) * finer
        knots = np.arange(-3, count + 4) * (total / count)
        reach = [slice(*np.searchsorted(self.u, (knots[i], knots[i + 4]), side="left")) for i in range(count + 3)]
        c = np.minimum(1.0, [self._least(own, knots[i], knots[i + 4]) for i, own in enumerate(reach)])
        for _ in range(ROUNDS):
            clock = BSpline(knots, c, 3)
            over = self.over([clock(self.u, nu=k) for k in range(3)])
            run = replace(self.run, clock=clock)
            if over.max() <= 1 + WITHIN:
                return run
            if run.duration_s > quickest_s:
                return None
            worst = np.array([over[own].max() for own in reach])
            c = np.where(worst > 1 + WITHIN, c / worst * LOWERED, c)
        return None

    def _cap(self) -> np.ndarray:
        """Return the least cap at every place, shape (M,)."""
        with np.errstate(divide="ignore", over="ignore"):
            caps = [(self.bounds[k] / np.abs(self.d[k])).min(axis=1) ** (1 / (k + 1)) for k in range(3)]
        return np.min(caps, axis=0)

    def _jumps(self, jerk: np.ndarray, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Return where accelerations jump, and the caps that keep what is left of a jump to half of the jerk limits.

        The timeline spreads a jump over its intervals to either side, which are ``step_s`` long, or short enough for
        its quintics to miss the motion by :data:`~.sampling.MISS_RAD`; or half as long, for intervals are halved.
        """
        u, curve = self.run.inner, self.run.curve
        x, v = self.run.begin + self.run.pace.at(u, 0), self.run.pace.at(u, 1)
        jump = np.abs(curve.at(x, 2) - curve.at(x, 2, side="left")) * (v * v)[:, None]
        share = jerk / (4 * JUMP)
        most = np.minimum(share * step_s, (share * np.sqrt(MISS_RAD / JUMP_MISS)) ** (2 / 3))
        with np.errstate(divide="ignore", invalid="ignore"):
            return u, np.sqrt(np.where(jump > 0, most / jump, np.inf).min(axis=1))

    def _least(self, own: slice, low: float, high: float) -> float:
        """Return the least cap between two u."""
        at, jump_cap = self.jumps
        return float(min(self.cap[own].min(initial=np.inf), jump_cap[(at >= low) & (at <= high)].min(initial=np.inf)))

    def over(self, r: list[np.ndarray]) -> np.ndarray:
        """Return how much of the limits is used at every place: the greatest of rate, sqrt and cbrt, shape (M,)."""
        d, (r0, r1, r2) = self.d, (x[:, None] for x in r)
        rate = d[0] * r0
        acceleration = d[1] * r0**2 + d[0] * r0 * r1
        jerk = d[2] * r0**3 + 3 * d[1] * r0**2 * r1 + d[0] * (r0**2 * r2 + r0 * r1**2)
        used = (np.abs(x / bound) for x, bound in zip((rate, acceleration, jerk), self.bounds, strict=True))
        return np.max([x.max(axis=1) ** (1 / (k + 1)) for k, x in enumerate(used)], axis=0)
