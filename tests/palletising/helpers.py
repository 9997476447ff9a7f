"""Random ways of boxes."""

import numpy as np

from nlpweld.motion import Limits
from nlpweld.palletising.cycle import Legs


def random_legs(rng: np.random.Generator, count: int) -> Legs:
    """Return ways with limits of their own, of all shapes: from jerk alone to long cruises."""
    z_0, rise, drop, apart = rng.uniform(0.0, 1.0, (4, count))
    z_3 = z_0 + apart - 0.5
    v, a, jerk = 10.0 ** rng.uniform([[-0.5], [-0.5], [0.0]], [[1.0], [1.5], [2.5]], (3, count))
    return Legs(z_0, z_0 + rise, z_3 + drop, z_3, rng.uniform(0.0, 2.5, count), Limits(v, a, jerk))
