"""The instants of a motion: so many that quintics between them meet it, and no more."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nlpweld.errors import MotionError
from nlpweld.timeline import Track, quintic

CLOSE_S = 1e-4  # instants nearer to each other than this are one: third derivatives lose digits with the cube of it
MISS_RAD = 2e-8  # by which a quintic may miss the motion half-way between two instants
MOST = 100_000  # instants of one motion before intervals are halved: over an hour at the usual step
DEPTH = 8  # halvings of an interval
LOOKS = 11  # places in an interval at which its jerk is looked at
State = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class States:
    """Where all joints are and how they move, at instants.

    Attributes:
        t_s: instants, shape (M,) [s].
        x: joints side by side, then the seam parameter: value, first and second derivative, each (M, J + 1).
    """

    t_s: np.ndarray
    x: State


def sampled(
    motion: Callable[[np.ndarray], State],
    times: Callable[[np.ndarray], np.ndarray],
    marks: np.ndarray,
    jerk: np.ndarray,
    step_s: float,
) -> States:
    """Return the instants of a motion: its marks, steps of at most ``step_s``, and halves where quintics miss it.

    An interval is halved while its quintic misses the motion half-way by more than :data:`MISS_RAD`, or exceeds a jerk
    limit that the motion keeps.

    Args:
        motion: parameters (M,) to state.
        times: ascending parameters (M,), the first of them 0, to instants [s].
        marks: parameters at which derivatives jump, both ends among them.
        jerk: limits of the columns, shape (J + 1,), infinite for what has none.
        step_s: greatest time between instants [s].

    Raises:
        MotionError: the motion takes so long that it would have more than :data:`MOST` instants.
    """
    w = spread_out(marks, times)
    refuse_endless(float(times(w)[-1]), step_s)
    steps = np.maximum(1, np.ceil(np.diff(times(w)) / step_s - 1e-9)).astype(int)
    w = np.concatenate([w[:1], *(np.linspace(a, b, n + 1)[1:] for a, b, n in zip(w, w[1:], steps, strict=False))])
    for _ in range(DEPTH):
        both = np.empty(2 * len(w) - 1)
        both[::2], both[1::2] = w, (w[:-1] + w[1:]) / 2
        t, x = times(both), motion(both)
        curve = quintic(t[::2], Track(*(part[::2] for part in x)))
        missed = (np.abs(curve(t[1::2]) - x[0][1::2])[:, :-1] > MISS_RAD).any(axis=1)
        share = np.diff(t[::2])[:, None] * np.array([1e-9, 0.5, 1 - 1e-9])
        steep = np.abs(curve((t[:-1:2, None] + share).reshape(-1), nu=3)) > jerk
        missed |= steep.reshape(len(w) - 1, -1).any(axis=1)
        missed &= np.diff(t[::2]) > 2 * CLOSE_S
        if not missed.any():
            break
        w = np.sort(np.concatenate([w, both[1::2][missed]]))
    return States(times(w), motion(w))


def refuse_endless(duration_s: float, step_s: float) -> None:
    """Refuse a motion that takes so long, or no finite time, that its instants could not be kept.

    Raises:
        MotionError: tells how long it would take.
    """
    if not duration_s <= MOST * step_s:
        raise MotionError(
            f"a phase would take {duration_s:.3g} s, over the {MOST * step_s:g} s there are instants for; raise the "
            "speed asked, the paces in [timing] or the drives' limits"
        )


def steepest(states: States, jerk: np.ndarray) -> float:
    """Return the greatest share of a jerk limit (J + 1,) that the quintics between instants use."""
    h, shares = np.diff(states.t_s), np.linspace(1e-9, 1 - 1e-9, LOOKS)
    t = (states.t_s[:-1, None] + h[:, None] * shares).reshape(-1)
    return float((np.abs(quintic(states.t_s, Track(*states.x))(t, nu=3)) / jerk).max())


def spread_out(marks: np.ndarray, times: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return ascending marks less those that come within :data:`CLOSE_S` of the one before, or of the end."""
    marks = np.unique(marks)
    t = times(marks)
    kept = [0]
    for k in range(1, len(marks) - 1):
        if t[k] - t[kept[-1]] > CLOSE_S and t[-1] - t[k] > CLOSE_S:
            kept.append(k)
    return marks[[*kept, len(marks) - 1]]
