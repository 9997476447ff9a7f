"""Curves through samples of smooth functions: piecewise Chebyshev polynomials, with derivatives."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev

DEGREE = 11  # of a piece; joint paths of the built-in cells are met to 1e-12 rad by pieces of a 48th of the seam
JUMP = 1e-4  # of a derivative's largest value, above which it jumps
ROUNDING = 1e-10  # of the values over the half pieces' k-th power: what a k-th derivative is worth


@dataclass(frozen=True, eq=False)
class Curve:
    """A vector that depends on one variable x, smooth within pieces.

    Attributes:
        ends: where pieces join, ascending, shape (K + 1,).
        coefficients: Chebyshev coefficients over each piece, shape (degree + 1, K, J).
    """

    ends: np.ndarray
    coefficients: np.ndarray

    @property
    def length(self) -> float:
        """How far x runs."""
        return float(self.ends[-1] - self.ends[0])

    def at(self, x: np.ndarray, derivative: int = 0, side: str = "right") -> np.ndarray:
        """Return values, or derivatives up to the third, shape (M, J), at x (M,), held to the ends.

        Args:
            x: where.
            derivative: 0 to 3.
            side: whose piece counts where two join, the one that begins there (``right``) or ends there (``left``).
        """
        x = np.clip(x, self.ends[0], self.ends[-1])
        piece = np.clip(np.searchsorted(self.ends, x, side=side) - 1, 0, len(self.ends) - 2)  # type: ignore[call-overload]
        half = np.diff(self.ends)[piece] / 2
        local = (x - self.ends[piece]) / half - 1
        c = self._derivatives[derivative][:, piece]
        return chebyshev.chebval(local[:, None], c, tensor=False) / half[:, None] ** derivative

    @cached_property
    def joins(self) -> np.ndarray:
        """Where the second or third derivative jumps, shape (B,)."""
        inside, jumps = self.ends[1:-1], np.zeros(len(self.ends) - 2, dtype=bool)
        rounding, half = ROUNDING * np.abs(self.at(self.ends)).max(axis=0), np.diff(self.ends) / 2
        least = np.minimum(half[:-1], half[1:])[:, None]
        for k in (2, 3):
            apart = np.abs(self.at(inside, k) - self.at(inside, k, side="left"))
            largest = np.abs(self.at(self.ends, k)).max(axis=0)
            jumps |= (apart > JUMP * largest + rounding / least**k).any(axis=1)
        return inside[jumps]

    @cached_property
    def _derivatives(self) -> list[np.ndarray]:
        found = [self.coefficients]
        for _ in range(3):
            found.append(chebyshev.chebder(found[-1]))
        return found


def curve_through(function: Callable[[np.ndarray], np.ndarray], ends: np.ndarray, degree: int = DEGREE) -> Curve:
    """Return the curve that meets a function (M,) -> (M, J) at the Chebyshev points of each piece, ends included."""
    nodes, fit = _nodes(degree)
    half = np.diff(ends) / 2
    x = ends[:-1, None] + half[:, None] * (nodes + 1)
    x[:, -1] = ends[1:]
    values = function(x.reshape(-1)).reshape(len(half), degree + 1, -1)
    return Curve(ends, np.einsum("ij,kjm->ikm", fit, values))


def straight(start: np.ndarray, end: np.ndarray) -> Curve:
    """Return the straight line from start to end, shapes (J,), along x from 0 to 1."""
    return Curve(np.array([0.0, 1.0]), np.stack([(start + end) / 2, (end - start) / 2])[:, None])


def split(ends: np.ndarray, longest: float) -> np.ndarray:
    """Return ascending ends with pieces halved, thirded and so on until none is longer than given."""
    parts = [np.linspace(a, b, int(np.ceil((b - a) / longest - 1e-9)) + 1)[:-1] for a, b in pairwise(ends)]
    return np.append(np.concatenate(parts), ends[-1])


def arc_length(point: Callable[[np.ndarray], np.ndarray], ends: np.ndarray) -> tuple[np.ndarray, Curve]:
    """Measure a curve in space that is smooth within pieces of its parameter.

    Args:
        point: parameters (M,) to points (M, 3) [m].
        ends: of the pieces, shape (K + 1,).

    Returns:
        Arc length at the ends (K + 1,) [m], and the parameter as a curve of arc length.
    """
    p = curve_through(point, ends)
    speed = curve_through(lambda s: np.linalg.norm(p.at(s, 1), axis=-1)[:, None], ends)
    whole = chebyshev.chebint(speed.coefficients, lbnd=-1) * (np.diff(ends) / 2)[:, None]
    lengths = np.asarray(chebyshev.chebval(1.0, whole))[..., 0].reshape(-1)
    at_ends = np.concatenate([[0.0], np.cumsum(lengths)])

    def parameter(sigma: np.ndarray) -> np.ndarray:
        k = np.clip(np.searchsorted(at_ends, sigma, side="right") - 1, 0, len(lengths) - 1)
        local = 2 * (sigma - at_ends[k]) / lengths[k] - 1
        half = np.diff(ends)[k] / 2
        for _ in range(30):
            off = chebyshev.chebval(local, whole[:, k, 0], tensor=False) - (sigma - at_ends[k])
            rate = chebyshev.chebval(local, speed.coefficients[:, k, 0], tensor=False) * half
            local = np.clip(local - off / rate, -1.0, 1.0)
            if np.abs(off).max() < 1e-15:
                break
        return (ends[k] + half * (local + 1))[:, None]

    return at_ends, curve_through(parameter, at_ends)


def _nodes(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the Chebyshev points of the second kind in [-1, 1], and the matrix from values there to coefficients."""
    nodes = chebyshev.chebpts2(degree + 1)
    return nodes, np.linalg.inv(chebyshev.chebvander(nodes, degree))
