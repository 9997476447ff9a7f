"""From values at the seam points to the objective of the seam: their mean, their minimum, or what is between.

The exact model takes them as they are defined. Ipopt takes the minimum as the log-sum-exp of the penalties' own
sharpness s, ``-(1/s) log(1/N sum_j exp(-s m_j))``, which is the mean for small s, falls as s grows, and exceeds the
minimum by no more than log(N)/s. Both this and the power mean are concave, and their derivatives have one form
(:class:`Weights`): points couple by a matrix of rank one, so the derivatives point by point stay all that is needed.
Each grows with the values in proportion or one to one, so that the penalties beside it keep their weight.
"""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.levels import Objective
from nlpweld.kinematics.manipulability import magnitude

WORST = 1e300  # power of a value that counts no worse however near to zero
LEAST = 1e-12  # of a value, of order one, in a power mean, which has no slope at zero


@dataclass(frozen=True, eq=False)
class Weights:
    """A smooth objective F of the values m_j at N seam points, with derivatives.

    Attributes:
        value: F.
        slope: dF/dm_j, positive, shape (N,); they add to one or more.
        bend: minus what each point adds to the Hessian's diagonal, shape (N,).
        shared: factor of the outer product of the slopes: ``d2F/dm2 = shared * slope slope^T - diag(bend)``.
    """

    value: float
    slope: np.ndarray
    bend: np.ndarray
    shared: float


@dataclass(frozen=True)
class Worth:
    """How the values of the states on a path make one total, the greater the better.

    Attributes:
        exponent: p of a power mean with exponent -p, 0 for the sum, infinite for the least.
        unit: a value of order one, in which powers are taken.
    """

    exponent: float
    unit: float

    @staticmethod
    def of(cell: Cell, exponent: float | None = None) -> "Worth":
        """Return what a cell's objective over the seam asks for, or an exponent in its place."""
        own = cell.objective
        p = exponent or own.exponent or (np.inf if own.over_seam == "minimum" else 0.0)
        return Worth(p, magnitude(own.reading, cell.tight))

    @property
    def joined(self) -> np.ufunc:
        """What makes a total of summands."""
        return np.minimum if np.isinf(self.exponent) else np.add

    def summands(self, values: np.ndarray) -> np.ndarray:
        """Return what states of some values bring to a total; -inf stays what it is."""
        if self.exponent == 0.0 or np.isinf(self.exponent):
            return values
        with np.errstate(all="ignore"):  # values of zero, and powers beyond what numbers hold, are as bad as can be
            powers = np.minimum((self.unit / np.maximum(values, 0.0)) ** self.exponent, WORST)
        return np.where(np.isfinite(values), -powers, -np.inf)

    def value(self, total: float, n: int) -> float:
        """Return the objective of a path of n states by its total."""
        if np.isinf(self.exponent):
            return total
        return total / n if self.exponent == 0.0 else float(self.unit * (-total / n) ** (-1 / self.exponent))


def over_seam(objective: Objective, values: np.ndarray) -> np.ndarray:
    """Return the objective of values (..., N) along the seam, shape (...); NaN where one is not finite."""
    if objective.over_seam == "mean":
        return np.asarray(values.mean(axis=-1))
    least = np.where(np.isfinite(values.sum(axis=-1)), values.min(axis=-1), np.nan)
    return least if objective.exponent is None else _power_mean(values, least, objective.exponent)


def smooth(objective: Objective, values: np.ndarray, sharpness: float) -> Weights:
    """Return the smooth objective of values (N,) of order one at a sharpness."""
    n = len(values)
    if objective.over_seam == "mean":
        return Weights(float(values.mean()), np.full(n, 1 / n), np.zeros(n), 0.0)
    if objective.exponent is None:
        shares = np.exp(-sharpness * (values - values.min()))
        slope = shares / shares.sum()
        value = values.min() - np.log(shares.mean()) / sharpness
        return Weights(float(value), slope, sharpness * slope, sharpness)
    p, m = objective.exponent, np.maximum(values, LEAST)
    value = float(_power_mean(m, m.min(), p))
    slope = (value / m) ** (p + 1) / n
    return Weights(value, slope, (p + 1) * slope / m, (p + 1) / value)


def _power_mean(values: np.ndarray, least: np.ndarray, p: float) -> np.ndarray:
    """Return the power mean of values (..., N) with exponent -p, zero where the least of them is."""
    with np.errstate(all="ignore"):
        mean = ((least[..., None] / values) ** p).mean(axis=-1)
        return np.where(least == 0.0, 0.0, least * mean ** (-1 / p))
