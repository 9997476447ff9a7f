"""The measures by their definitions: products of manipulabilities, common volumes, and MMR (Pan et al.)."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nlpweld.cell import Cell
from nlpweld.cell.levels import Objective

DIRECTIONS = 2000
MM3_PER_M3 = 1e9
OF_ALL: dict[str, Callable[..., np.ndarray]] = {
    "product": np.prod,
    "mean": np.mean,
}  # readings that do not tell tight from loose robots


@dataclass(frozen=True, eq=False)
class Measures:
    """Measures at M configurations.

    Attributes:
        mmr: value of the cell's reading: one of eq. (16), or product or mean of all w, shape (M,).
        m_tight: product of the tight robots' w (eq. 15), shape (M,) [m^3 each]; NaN where there are none.
        m_loose: product of the loose robots' w, shape (M,).
        common_volume: Vol(E_1 ∩ ... ∩ E_n) of the velocity ellipsoids, shape (M,).
        ratio: r_k = Vol(∩) / V_k by station name, each of shape (M,).
    """

    mmr: np.ndarray
    m_tight: np.ndarray
    m_loose: np.ndarray
    common_volume: np.ndarray
    ratio: dict[str, np.ndarray]


def measure(cell: Cell, w: dict[str, np.ndarray], Jv: dict[str, np.ndarray]) -> Measures:
    """Return every measure of the cell's robots.

    Args:
        cell: tells which robots are tight and which loose, and the reading.
        w: manipulability by station name, each of shape (M,) [m^3].
        Jv: translational rows of the Jacobian by station name, each of shape (M, 3, n) [m/rad].
    """
    cores = {name: J @ J.swapaxes(-1, -2) for name, J in Jv.items()}
    common = common_volume(np.stack(list(cores.values()), axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = {name: common / ellipsoid_volume(core) for name, core in cores.items()}
    m_tight, m_loose = products(cell, w)
    return Measures(team(cell, w, ratio), m_tight, m_loose, common, ratio)


def products(cell: Cell, w: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return M_tight and M_loose, each of shape (M,); M_tight is NaN where no robot is tight."""
    tight, loose = _sides(cell)
    m_loose = np.prod([w[name] for name in loose], axis=0)
    return (np.prod([w[name] for name in tight], axis=0) if tight else np.full_like(m_loose, math.nan)), m_loose


def team(cell: Cell, w: dict[str, np.ndarray], ratio: dict[str, np.ndarray]) -> np.ndarray:
    """Return the value of the cell's reading, shape (M,), from manipulabilities and shares r_k by station name.

    A factor that all shares of a configuration have in common cancels.
    """
    if cell.objective.reading in OF_ALL:
        return OF_ALL[cell.objective.reading](list(w.values()), axis=0)
    tight, loose = _sides(cell)
    beta = (np.mean([ratio[name] for name in tight], axis=0), np.mean([ratio[name] for name in loose], axis=0))
    return read(cell.objective.reading, beta, products(cell, w), (len(tight), len(loose)))


def team_along(cell: Cell, w: dict[str, np.ndarray], Jv: dict[str, np.ndarray]) -> np.ndarray:
    """Return the cell's reading at M configurations, shape (M,), without their common volume, which cancels."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = {name: 1 / ellipsoid_volume(J @ J.swapaxes(-1, -2)) for name, J in Jv.items()}
    return team(cell, w, shares)


def least_along(cell: Cell, w: dict[str, np.ndarray], Jv: dict[str, np.ndarray]) -> float:
    """Return the least value of the cell's reading at M configurations."""
    return float(team_along(cell, w, Jv).min())


def along_seam(objective: Objective, values: np.ndarray) -> float:
    """Return the cell's objective of the values (N,) at the seam's points, by the definition of each."""
    if objective.over_seam == "minimum":
        return float(values.min())
    if objective.exponent is None:
        return float(values.mean())
    best = float(values.max())  # in units of which powers are taken, so that they stay within what numbers hold
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return float(best * np.mean((values / best) ** -objective.exponent) ** (-1 / objective.exponent))


def _sides(cell: Cell) -> tuple[list[str], list[str]]:
    """Return the names of the tight and of the loose stations."""
    tight = [s.name for s in cell.stations if s.coupling.kind == "tight"]
    return tight, [s.name for s in cell.stations if s.coupling.kind == "loose"]


def read(
    reading: str, beta: tuple[np.ndarray, np.ndarray], m: tuple[np.ndarray, np.ndarray], count: tuple[int, int]
) -> np.ndarray:
    """Return MMR by one reading of Pan et al., eq. (16).

    Args:
        reading: one of ``nlpweld.cell.READINGS`` but those in ``OF_ALL``.
        beta: weights of the tight and the loose part, each of shape (M,).
        m: M_tight and M_loose, each of shape (M,).
        count: numbers of tight and loose robots.
    """
    (b1, b2), (tight, loose) = beta, m
    if reading == "equal":
        b1 = b2 = np.ones_like(tight)
    if reading == "sqrt_tight":
        tight = tight ** (1 / count[0])
    if reading == "millimetres":
        tight, loose = tight * MM3_PER_M3 ** count[0], loose * MM3_PER_M3 ** count[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        if reading == "harmonic":
            return (b1 + b2) / (b1 / tight + b2 / loose)
        return (b1 * tight + b2 * loose) / (b1 + b2)


def ellipsoid_volume(core: np.ndarray) -> np.ndarray:
    """Return the volume of the ellipsoids u^T core^-1 u <= 1, shape (M,), from cores of shape (M, 3, 3)."""
    return 4 / 3 * math.pi * np.sqrt(np.maximum(np.linalg.det(core), 0.0))


def common_volume(cores: np.ndarray) -> np.ndarray:
    """Return the volume common to concentric ellipsoids, by quadrature over the sphere.

    Vol = (1/3) ∮ min_k rho_k(u)^3 dΩ with rho_k(u) = (u^T core_k^-1 u)^(-1/2).

    Args:
        cores: J_v J_v^T of n robots, shape (M, n, 3, 3).

    Returns:
        Volumes, shape (M,); zero where an ellipsoid is flat.
    """
    flat = (np.linalg.det(cores) <= 1e-18).any(axis=1)
    inverse = np.linalg.inv(np.where(flat[:, None, None, None], np.eye(3), cores))
    u = sphere_directions()
    x, y, z = u.T
    products = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z])
    A = inverse[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    largest = (A @ products).max(axis=1)  # the smallest rho_k belongs to the largest form
    return np.where(flat, 0.0, 4 * math.pi / 3 * (largest**-1.5).mean(axis=-1))


@lru_cache(maxsize=1)
def sphere_directions() -> np.ndarray:
    """Return unit vectors spread evenly on the sphere (Fibonacci lattice), shape (DIRECTIONS, 3)."""
    k = np.arange(DIRECTIONS) + 0.5
    z = 1 - 2 * k / DIRECTIONS
    angle = math.pi * (1 + math.sqrt(5)) * k
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)
