"""Manipulability of one robot and of the team: the only definition of w, V, M_tight, M_loose and MMR in the graphs.

Everything here is plain arithmetic, so that it takes CasADi symbols and NumPy arrays alike, except the
intersection volume, which is a quadrature in NumPy and is not needed for MMR (it cancels in eq. 16).
"""

from collections.abc import Sequence
from functools import reduce
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.cell.levels import READINGS, Reading


def manipulability(J: ca.SX) -> ca.SX:
    """Return w = sqrt(det(J J^T)) (Yoshikawa; Pan et al., eq. 11) of a Jacobian with shape (m, n), m <= n."""
    return ca.sqrt(ca.det(J @ J.T))


def det_gram(J_v: ca.SX) -> ca.SX:
    """Return det(J_v J_v^T) of a translational Jacobian (3, n): the squared ellipsoid volume over (4 pi/3)^2."""
    A = J_v @ J_v.T
    return (
        A[0, 0] * (A[1, 1] * A[2, 2] - A[1, 2] ** 2)
        - A[0, 1] * (A[0, 1] * A[2, 2] - A[1, 2] * A[0, 2])
        + A[0, 2] * (A[0, 1] * A[1, 2] - A[1, 1] * A[0, 2])
    )


# m^3 in the reading's unit of volume
UNIT: dict[str, float] = dict.fromkeys(READINGS, 1.0) | {"millimetres": 1e9}


def magnitude(reading: Reading, tight: Sequence[bool]) -> float:
    """Return by how much a reading's unit blows up MMR, so that a solver can bring it back to order one."""
    return UNIT[reading] ** sum(tight)


def mmr(reading: Reading, w: Sequence[Any], gram: Sequence[Any], tight: Sequence[bool]) -> Any:
    """Return the multi-robot manipulability of one configuration (Pan et al., eq. 15 and 16).

    The weights of (16) are shares of a common volume: r_k = Vol(common)/V_k, beta_1 the mean of r over the tight
    robots, beta_2 over the loose ones. Vol(common) cancels, so only the volumes V_k enter, through
    V_k ~ sqrt(gram_k).

    Args:
        reading: ``paper`` is (16) as it stands; ``equal`` weighs both parts alike; ``harmonic`` takes the weighted
            harmonic mean; ``sqrt_tight`` takes the geometric mean of the tight robots instead of their product, so
            that both parts are in m^3; ``millimetres`` is (16) with lengths in mm. ``product`` and ``mean`` are those
            of all robots, for cells in which none is tightly coupled.
        w: manipulability of each robot [m^3].
        gram: det(J_v J_v^T) of each robot [m^6].
        tight: for each robot whether it is tightly coupled.

    Returns:
        MMR; its unit mixes (m^3)^n_tight with m^3 under ``paper`` (mm under ``millimetres``); (m^3)^n under
        ``product``, m^3 under ``mean``.
    """
    if reading == "product":
        return _product(list(w))
    if reading == "mean":
        return sum(w) / len(w)
    unit = UNIT[reading]
    m_tight = _product([unit * wk for wk, t in zip(w, tight, strict=True) if t])
    m_loose = _product([unit * wk for wk, t in zip(w, tight, strict=True) if not t])
    if reading == "sqrt_tight":
        m_tight = m_tight ** (1.0 / sum(tight))
    beta_1, beta_2 = _weights(reading, gram, tight)
    if reading == "harmonic":
        return (beta_1 + beta_2) / (beta_1 / m_tight + beta_2 / m_loose)
    return (beta_1 * m_tight + beta_2 * m_loose) / (beta_1 + beta_2)


def _weights(reading: Reading, gram: Sequence[Any], tight: Sequence[bool]) -> tuple[Any, Any]:
    """Return beta_1 and beta_2 up to their common factor."""
    if reading == "equal":
        return 1.0, 1.0
    shares = [1.0 / g**0.5 for g in gram]
    ours = [s for s, t in zip(shares, tight, strict=True) if t]
    theirs = [s for s, t in zip(shares, tight, strict=True) if not t]
    return sum(ours) / len(ours), sum(theirs) / len(theirs)


def _product(factors: list[Any]) -> Any:
    return reduce(lambda a, b: a * b, factors)


def ellipsoid_volume(J_v: np.ndarray) -> float:
    """Return the volume [m^3] of the velocity ellipsoid u^T (J_v J_v^T)^-1 u <= 1 of a Jacobian J_v (3, n)."""
    return float(4 / 3 * np.pi * np.sqrt(np.linalg.det(J_v @ J_v.T)))


def intersection_volume(jacobians: Sequence[np.ndarray], order: int = 131) -> float:
    """Return the volume common to several velocity ellipsoids moved to one centre [m^3].

    Vol = (1/3) * surface integral of min_k rho_k(u)^3 with rho_k(u) = (u^T (J_v J_v^T)^-1 u)^(-1/2), by Lebedev
    quadrature. The integrand has kinks where the nearest ellipsoid changes, so expect between three and four digits.

    Args:
        jacobians: translational Jacobians, each (3, n).
        order: order of the Lebedev rule (131 is the largest there is).
    """
    from scipy.integrate import lebedev_rule  # slow to import, and not needed for MMR

    points, weights = lebedev_rule(order)
    cores = [np.linalg.inv(J @ J.T) for J in jacobians]
    radii = [np.einsum("ip,ij,jp->p", points, core, points) ** -0.5 for core in cores]
    return float(weights @ np.min(radii, axis=0) ** 3 / 3)
