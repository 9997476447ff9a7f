"""The best height of a cycle's top, z_max, by cases (Cao et al. 2012, eq. 12 to 17).

The leg takes ``t = max(f + g, t_1 + t_3 + m)``, where f + g is the time of axis B's two moves and m that of the slowest
of A, C and D. A longer S-curve is nowhere slower, at no instant, so f + g rises with z_max, t_1 + t_3 falls or stays,
and ``t_M = f + g - t_1 - t_3`` rises. Three cases are all there are:

- ``lowest``: t_M >= m already at the lowest height allowed; f + g decides, and nothing is quicker.
- ``plateau`` or ``top``: t_M <= m at the height from where on neither z_1 nor z_2 is reached later because of braking
  (:func:`free_height`). From there on t_1 + t_3 is constant, so that it is the lowest of many heights, equally good, up
  to where t_M = m. ``top``: axis B's own limit z_a comes first.
- ``crossing``: t_M = m between the two. The only one without a closed form: t_M is a sum of two roots of polynomials of
  degree up to four. It is bracketed and monotone, and its root is found to the last bits (Chandrupatla's method).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize.elementwise import find_root

from nlpweld.motion import Limits, s_curve
from nlpweld.palletising.cycle import Legs, after

CASES = ("lowest", "plateau", "top", "crossing")
TOLERANCES = {"xatol": 1e-15, "xrtol": 1e-15, "fatol": 0.0, "frtol": 0.0}


@dataclass(frozen=True, eq=False)
class Optimum:
    """Best heights of legs, and what they are worth; arrays have the legs' shape.

    Attributes:
        z_max_m: the lowest best height [m].
        z_most_m: the highest height that is as good [m].
        time_s: how long the leg takes [s].
        case: index into ``CASES``.
    """

    z_max_m: np.ndarray
    z_most_m: np.ndarray
    time_s: np.ndarray
    case: np.ndarray


def optimum(legs: Legs, z_a_m: float) -> Optimum:
    """Return the best height of every leg.

    Args:
        legs: the ways.
        z_a_m: how high axis B can rise; not under any ``legs.lowest_m``.
    """
    z, case = best_height(legs, z_a_m)
    top = np.full_like(z, z_a_m)
    wide = (case == 1) & (after(legs, top).lift_s > legs.beside_s)
    most = np.where(case == 1, np.where(wide, _crossing(legs, z, top, wide), top), z)
    return Optimum(z, most, after(legs, z).total_s, case)


def best_height(legs: Legs, z_a_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest best height of every leg [m], and its case."""
    low, free = legs.lowest_m, free_height(legs)
    start = np.clip(free, low, z_a_m)
    lift_low, lift_start = after(legs, low).lift_s, after(legs, start).lift_s
    low, start, beside = np.broadcast_arrays(low, start, legs.beside_s + 0 * lift_low)
    case = np.select([lift_low >= beside, (lift_start <= beside) & (free <= z_a_m), lift_start <= beside], [0, 1, 2], 3)
    return np.choose(case, [low, start, start, _crossing(legs, low, start, case == 3)]), case


def free_height(legs: Legs) -> np.ndarray:
    """Return the lowest z_max from which on neither P1 nor P2 is passed later for braking towards the top [m]."""
    rise, drop = least_move(legs.z_1 - legs.z_0, legs.lift), least_move(legs.z_2 - legs.z_3, legs.lift)
    return np.maximum(legs.z_0 + rise, legs.z_3 + drop)


def least_move(passed: np.ndarray, limits: Limits) -> np.ndarray:
    """Return the shortest move from rest to rest that passes a position as early as any longer one does.

    It is the one whose acceleration begins to fall just there. While the jerk lasts that is a twelfth of the way; while
    the acceleration does, t after the start, the way is ``a t (t + a/jerk)``; beyond, the velocity limit is what makes
    acceleration fall, and it is enough that braking begins no earlier.

    Args:
        passed: distance from the start, not negative.
        limits: of the axis.
    """
    v, a, jerk = limits.velocity, limits.acceleration, limits.jerk
    ramp = np.minimum(a / jerk, np.sqrt(v / jerk))  # how long jerk lasts on the way to full speed
    rise = ramp + np.where(a / jerk <= ramp, v / a, ramp)  # how long that takes
    run_up = v * rise / 2
    first = jerk * ramp**3 / 6
    beyond = np.maximum(passed - first, 0.0)
    top, speed = jerk * ramp, jerk * ramp**2 / 2
    t = ramp + 2 * beyond / (speed + np.sqrt(speed**2 + 2 * top * beyond))
    falling = run_up - v * ramp + first  # where acceleration falls for the velocity limit
    return np.select(
        [passed <= first, passed <= falling, passed <= run_up],
        [12 * passed, top * t * (t + ramp), 2 * run_up + 0 * passed],
        passed + run_up,
    )


def unbraked_time(passed: np.ndarray, limits: Limits) -> np.ndarray:
    """Return tau, the time from rest to a position without braking [s]."""
    passed = np.asarray(passed, dtype=float)
    return s_curve(least_move(passed, limits), limits).time_at(passed)


def _crossing(legs: Legs, low: np.ndarray, high: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Return the heights between two at which t_M = m, where asked for, and the lower one elsewhere."""
    own = legs.lift
    given = (legs.z_0, legs.z_1, legs.z_2, legs.z_3, legs.beside_s, own.velocity, own.acceleration, own.jerk)
    low, high, *given_all = np.broadcast_arrays(low, high, *given)

    def missing(z: np.ndarray, *g: np.ndarray) -> np.ndarray:
        these = Legs(g[0], g[1], g[2], g[3], g[4], Limits(g[5], g[6], g[7]))
        return after(these, z).lift_s - these.beside_s

    root = np.array(low)
    if where.any():
        bracket = low[where], high[where]
        root[where] = find_root(missing, bracket, args=tuple(g[where] for g in given_all), tolerances=TOLERANCES).x
    return root
