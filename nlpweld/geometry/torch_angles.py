"""How a torch is held against the weld: travel, work and spin angle, and stand-off (NumPy only).

{H} is the torch's end frame, z_H pointing from the seam to the torch. ``R_p_H = Ry(phi) Rx(eta) Rz(spin)``, the form
that the printed entries of Zhang et al., eq. (4), multiply out to. Their equations for phi and eta are lost; from
z_H = (cos travel, cos work, .) follow ``eta = -(pi/2 + work)`` and ``phi = arcsin(cos travel / sin |work|)``. Both
angles are computed by atan2 from the components of z_H, which stays accurate where the arcsine does not.
"""

import numpy as np

from nlpweld.errors import KinematicsError
from nlpweld.geometry.weld_angles import turn

SLACK = 1e-15  # by how much round-off may lift cos^2 travel + cos^2 work above 1 where the torch lies on the surface
POLE = 1e-12  # sine of the work angle under which z_H is along y and phi is undetermined


def torch_rotation(travel: np.ndarray, work: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """Return the torch's rotation in the weld frame (Zhang et al., eq. 4).

    Where the torch lies along y (work 0 or -pi) phi is undetermined and taken as 0.

    Args:
        travel: from the root axis x to z_H, in (0, pi), shape (...) [rad]; Zhang et al. use (0, pi/2].
        work: from y to z_H, counted negative, in [-pi, 0], shape (...) [rad].
        spin: about z_H, shape (...) [rad].

    Returns:
        R_p_H, shape (..., 3, 3).

    Raises:
        KinematicsError: an angle is out of range, or cos^2 travel + cos^2 work > 1, so that no direction has both.
    """
    travel, work, spin = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (travel, work, spin)))
    height_sq = height_squared(travel, work)
    _check(travel, work, spin, height_sq)
    phi = _phi(np.cos(travel), np.sqrt(np.maximum(height_sq, 0.0)), np.sin(-work))
    return turn("y", phi) @ turn("x", -(np.pi / 2 + work)) @ turn("z", spin)


def torch_pose(travel: np.ndarray, work: np.ndarray, spin: np.ndarray, stand_off_m: float) -> np.ndarray:
    """Return the torch's pose T_p_H in the weld frame, its origin at ``stand_off_m * z_H`` (Zhang et al., eq. 4).

    Args:
        travel: see :func:`torch_rotation`.
        work: see :func:`torch_rotation`.
        spin: see :func:`torch_rotation`.
        stand_off_m: from the weld point to the torch's end [m].

    Returns:
        T_p_H, shape (..., 4, 4).

    Raises:
        KinematicsError: as :func:`torch_rotation`.
    """
    R = torch_rotation(travel, work, spin)
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, stand_off_m * R[..., 2], 1.0
    return T


def torch_angles(R_p_H: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return travel, work and spin angle of torch rotations; the inverse of :func:`torch_rotation`.

    Travel and work are angles between unit vectors and accurate to round-off everywhere. Round-off in R moves the spin
    by 1e-16 / sin |work|: where the torch lies along y, only the sum of phi and spin is determined. Where the torch
    lies on the surface, its rise is the root of a difference, so that rebuilding R from the angles keeps half the
    digits (4e-7 measured), while the cosines of both angles keep all.

    Args:
        R_p_H: torch rotations in the weld frame, shape (..., 3, 3).

    Returns:
        travel in [0, pi], work in [-pi, 0] and spin in (-pi, pi], each of shape (...) [rad].

    Raises:
        KinematicsError: a torch points from below the weld (z_H has a negative z component).
    """
    x, y, z = (R_p_H[..., 2][..., i] for i in range(3))
    if np.any(z < -np.sqrt(SLACK)):
        raise KinematicsError(f"{_point(z < -np.sqrt(SLACK))}torch points at the weld from below; turn it over")
    across = np.hypot(x, z)
    travel, work = np.arctan2(np.hypot(y, z), x), -np.arctan2(across, y)
    spin = np.where(
        across > POLE, np.arctan2(R_p_H[..., 1, 0], R_p_H[..., 1, 1]), np.arctan2(-R_p_H[..., 0, 1], R_p_H[..., 0, 0])
    )
    return travel, work, np.where(spin <= -np.pi, np.pi, spin)


def height_squared(travel: np.ndarray, work: np.ndarray) -> np.ndarray:
    """Return 1 - cos^2 travel - cos^2 work, the square of the torch's rise above the surface, without cancellation.

    Negative where no direction has both angles. Shape (...).
    """
    return -np.cos(travel + work) * np.cos(travel - work)


def _phi(along: np.ndarray, up: np.ndarray, sine_of_work: np.ndarray) -> np.ndarray:
    """Return the turn about y that brings z towards x, from z_H's components along x and z."""
    return np.where(sine_of_work > POLE, np.arctan2(along, up), 0.0)


def _check(travel: np.ndarray, work: np.ndarray, spin: np.ndarray, height_sq: np.ndarray) -> None:
    """Refuse angles out of range and pairs no direction has."""
    for name, wrong, must in (
        ("travel", ~((travel > 0) & (travel < np.pi)), "lie between 0 and 180 deg"),
        ("work", ~((work >= -np.pi) & (work <= 0)), "lie between -180 and 0 deg"),
        ("spin", ~np.isfinite(spin), "be finite"),
    ):
        if wrong.any():
            value = {"travel": travel, "work": work, "spin": spin}[name][wrong][0]
            raise KinematicsError(f"{_point(wrong)}{name} angle is {np.degrees(value):g} deg; it must {must}")
    wrong = height_sq < -SLACK
    if wrong.any():
        t, w = np.degrees(travel[wrong][0]), np.degrees(work[wrong][0])
        raise KinematicsError(
            f"{_point(wrong)}no torch direction has travel angle {t:g} deg and work angle {w:g} deg: "
            f"cos^2 + cos^2 is {1 - height_sq[wrong][0]:.4g}, above 1; bring one of them nearer to a right angle"
        )


def _point(wrong: np.ndarray) -> str:
    """Return which point is the first wrong one, counted from 0; nothing for a single torch."""
    return f"point {int(np.flatnonzero(wrong)[0])}: " if wrong.ndim else ""
