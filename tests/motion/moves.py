"""Random moves for tests, over as many orders of magnitude as asked."""

import numpy as np

from nlpweld.motion import Limits, SCurve


def moves(count: int, decades: float, seed: int = 0) -> tuple[np.ndarray, Limits]:
    """Return displacements and limits of up to so many decades to either side of one."""
    rng = np.random.default_rng(seed)
    spread = 10 ** rng.uniform(-decades, decades, (4, count))
    return spread[0] * rng.choice([-1.0, 1.0], count), Limits(*spread[1:])


def edges(move: SCurve) -> np.ndarray:
    """Return the instants at which the pieces of moves meet, start, middle and end included, shape (9, m) [s]."""
    rise, ramp, end = move.rise_s, move.jerk_s, move.duration_s
    own = [0 * end, ramp, rise - ramp, rise, end / 2, end - rise, end - rise + ramp, end - ramp, end]
    return np.stack(own)
