"""The free angles of a weld: their offsets anywhere on the seam, and how they turn the workpiece and the torches."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class Offsets:
    """Offsets of free angles from their nominal values, linear in s between the points of a plan.

    A closed seam goes from its last point to its first the way the numbers say: no turn is taken off.

    Attributes:
        s: seam parameter of the points, shape (N,).
        closed: whether the seam is closed.
        angles: offset by name of the angle, each of shape (N,) [rad].
    """

    s: np.ndarray
    closed: bool
    angles: Mapping[str, np.ndarray] = field(default_factory=dict)

    def at(self, s: np.ndarray) -> dict[str, np.ndarray]:
        """Return the offsets at seam parameters (M,) by name, each of shape (M,) [rad]."""
        if not self.closed:
            return {name: np.interp(s, self.s, u) for name, u in self.angles.items()}
        own, way = np.append(self.s, self.s[0] + 1), self.s[0] + (np.asarray(s) - self.s[0]) % 1.0
        return {name: np.interp(way, own, np.append(u, u[0])) for name, u in self.angles.items()}


def turned_work(R_P_C: np.ndarray, tangent_P: np.ndarray, across_P: np.ndarray, u: dict[str, np.ndarray]) -> np.ndarray:
    """Return workpiece rotations in {P} with yaw and tilt, shape (M, 3, 3).

    Rotation first, about the tangent as it is without freedom; then slope, about the axis across it, a positive
    one lifting the tangent's end; then yaw about the vertical. With the weld frame {p} that makes Rz(yaw) R_P_p
    Ry(-slope) Rx(rotation).

    Args:
        R_P_C: rotations without freedom, shape (M, 3, 3).
        tangent_P: x axis of the main seam's weld frame at R_P_C, shape (M, 3).
        across_P: its y axis after the turn of the cell's posture, shape (M, 3).
        u: offsets by name, each of shape (M,) [rad]; those not named are zero.
    """
    turns = (("rotation", 1, tangent_P), ("slope", -1, across_P), ("yaw", 1, np.array([0.0, 0.0, 1.0])))
    for name, sense, axis in turns:
        if name in u:
            R_P_C = _about(np.broadcast_to(axis, R_P_C.shape[:2]), sense * u[name], R_P_C)
    return R_P_C


def spun(T_W_E: np.ndarray, spin: np.ndarray | None) -> np.ndarray:
    """Return TCP poses (M, 4, 4) turned about their own z axes by spins (M,) [rad], or as they are."""
    if spin is None:
        return T_W_E
    x, y = T_W_E[:, :3, 0], T_W_E[:, :3, 1]
    c, s = np.cos(spin)[:, None], np.sin(spin)[:, None]
    turned = T_W_E.copy()
    turned[:, :3, 0], turned[:, :3, 1] = c * x + s * y, c * y - s * x
    return turned


def _about(axis: np.ndarray, angle: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Return rotations (M, 3, 3), their columns turned about unit axes (M, 3) by angles (M,) [rad] (Rodrigues)."""
    k, c, s = axis[..., None], np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    along = (k * R).sum(axis=1, keepdims=True)
    return c * R + s * np.cross(k, R, axis=1) + (1 - c) * k * along
