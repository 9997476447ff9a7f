"""How a weld lies: slope, rotation and deviation of its frame, and the main positions of ISO 6947 (NumPy only).

A weld frame {p} has x along the root in the direction of welding, z along the centre line of the section from root
to cap, and y = z x x. {B} is any frame whose z axis is vertical. Angles are in radians, arrays have leading axes alike.
"""

from dataclasses import dataclass

import numpy as np

from nlpweld.geometry.weld_frames import WeldFrames

SLOPE_TOLERANCE_DEG, ROTATION_TOLERANCE_DEG = 5.0, 10.0  # ISO 6947, how far test pieces may be off a main position
MAIN_POSITIONS = {  # name: slopes [deg], rotations [deg]; no rotation where the weld is vertical
    "PA": ((0, 180), (90,)),
    "PB": ((0, 180), (45, 135)),
    "PC": ((0, 180), (0, 180)),
    "PD": ((0, 180), (225, 315)),
    "PE": ((0, 180), (270,)),
    "PF": ((90,), ()),
    "PG": ((270,), ()),
}
OUTSIDE = "-"
VERTICAL = 1e-12  # length of the root axis's horizontal part under which its heading is taken as undefined


@dataclass(frozen=True)
class IsoPositions:
    """The main positions of ISO 6947 next to given welds.

    Attributes:
        name: the position, or ``-`` where the weld is off every main position by more than the tolerances, shape (M,).
        nearest: the nearest main position, within tolerances or not, shape (M,).
        slope_off: slope less that of the nearest, in (-pi, pi], shape (M,) [rad].
        rotation_off: rotation less that of the nearest, in (-pi, pi], shape (M,) [rad]; 0 for PF and PG, which a
            turn about the vertical root axis does not change.
    """

    name: np.ndarray
    nearest: np.ndarray
    slope_off: np.ndarray
    rotation_off: np.ndarray


def weld_rotations(frames: WeldFrames) -> np.ndarray:
    """Return R_C_p of weld frames, x along the tangent and z along the normal, shape (M, 3, 3)."""
    x, z = frames.tangent_C, frames.normal_C
    return np.stack([x, np.cross(z, x), z], axis=-1)


def weld_angles(R_B_p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return slope, rotation and deviation of weld frames (Zhang et al., Fig. 1).

    Slope: the root axis above the horizontal, up positive, in [-pi/2, pi/2]. Rotation: from the horizontal direction
    across the weld to the centre line, counter-clockwise seen against the root axis, in (-pi, pi]; the direction
    across is y_B turned by the deviation, which is y_B itself in Zhang et al., Fig. 1 (b). Deviation: from x_B to the
    horizontal part of the root axis, counter-clockwise seen from above, in (-pi, pi]. On a vertical weld the deviation
    is undetermined and given as 0; close to it, deviation and rotation are worth 1e-16 / cos(slope) each, while
    :func:`weld_rotation` still gives the frame back to 1e-15.

    Args:
        R_B_p: weld frames, shape (..., 3, 3).

    Returns:
        slope, rotation, deviation, each of shape (...) [rad].
    """
    x, z = R_B_p[..., 0], R_B_p[..., 2]
    level = np.hypot(x[..., 0], x[..., 1])
    deviation = np.where(level > VERTICAL, np.arctan2(x[..., 1], x[..., 0]), 0.0)
    across = np.stack([-np.sin(deviation), np.cos(deviation), np.zeros_like(deviation)], axis=-1)
    rotation = np.arctan2(np.sum(z * np.cross(x, across), axis=-1), np.sum(z * across, axis=-1))
    return np.arctan2(x[..., 2], level), _half_open(rotation), _half_open(deviation)


def weld_rotation(slope: np.ndarray, rotation: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """Return the weld frames of given angles, ``Rz(deviation) Ry(-slope) Rx(rotation - pi/2)``; see `weld_angles`.

    Args:
        slope: root axis above the horizontal, shape (...) [rad]; beyond +-pi/2 the frame is that of other angles.
        rotation: centre line from the horizontal across the weld, shape (...) [rad].
        deviation: heading of the root axis from x_B, shape (...) [rad].

    Returns:
        R_B_p, shape (..., 3, 3).
    """
    half = np.asarray(rotation) - np.pi / 2
    return turn("z", np.asarray(deviation)) @ turn("y", -np.asarray(slope)) @ turn("x", half)


def fillet_rotation(R_B_p: np.ndarray, half_angle: float, side: int) -> np.ndarray:
    """Return the frames {p'} whose centre line upright puts a fillet weld in position PB (Zhang et al., section 1.1).

    {p} is turned about its root axis by half the angle between the plates: with {p'} upright, one plate is level.

    Args:
        R_B_p: weld frames, centre line halfway between the plates, shape (..., 3, 3).
        half_angle: half the angle between the plates [rad]; pi/4 for plates at right angles.
        side: which plate becomes level: +1 turns {p} counter-clockwise seen against the root axis, -1 clockwise.

    Returns:
        R_B_p', shape (..., 3, 3).
    """
    return R_B_p @ turn("x", np.asarray(side * half_angle))


def iso_position(
    slope: np.ndarray,
    rotation: np.ndarray,
    slope_tolerance_deg: float = SLOPE_TOLERANCE_DEG,
    rotation_tolerance_deg: float = ROTATION_TOLERANCE_DEG,
) -> IsoPositions:
    """Return the main welding positions PA to PG of welds (ISO 6947, edition with slopes and rotations from 0 to 360).

    The nearest is the one whose larger deviation, in tolerances, is least. A slope of Zhang et al. is never beyond
    +-pi/2, so that of the rows with slopes 0 and 180 it only meets the first; PA is (0, pi/2) in both conventions.

    Args:
        slope: slopes, shape (M,) [rad].
        rotation: rotations, shape (M,) [rad].
        slope_tolerance_deg: largest slope off a main position [deg].
        rotation_tolerance_deg: largest rotation off a main position [deg].
    """
    names, off = _off_every_row(np.atleast_1d(slope), np.atleast_1d(rotation))
    tolerances = np.radians([slope_tolerance_deg, rotation_tolerance_deg])
    in_tolerances = np.abs(off / tolerances).max(axis=-1)
    best = in_tolerances.argmin(axis=0)
    points = np.arange(best.size)
    slope_off, rotation_off = off[best, points].T
    within = in_tolerances[best, points] <= 1 + 1e-12  # a deviation of just the tolerance counts as within
    return IsoPositions(np.where(within, names[best], OUTSIDE), names[best], slope_off, rotation_off)


def turn(axis: str, angle: np.ndarray) -> np.ndarray:
    """Return right-hand rotations about an axis ``x``, ``y`` or ``z`` by angles (...) [rad], shape (..., 3, 3)."""
    i, j, k = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}[axis]
    R = np.zeros((*np.shape(angle), 3, 3))
    R[..., i, i] = R[..., j, j] = np.cos(angle)
    R[..., j, i], R[..., i, j], R[..., k, k] = np.sin(angle), -np.sin(angle), 1.0
    return R


def _off_every_row(slope: np.ndarray, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows' names (rows,) and how far slope and rotation are off each, shape (rows, M, 2)."""
    names, off = [], []
    for name, (slopes, rotations) in MAIN_POSITIONS.items():
        for row in slopes:
            for turned in rotations or (None,):
                rotation_off = np.zeros_like(slope) if turned is None else _wrapped(rotation - np.radians(turned))
                names.append(name)
                off.append(np.stack([_wrapped(slope - np.radians(row)), rotation_off], axis=-1))
    return np.array(names), np.array(off)


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Return angles brought into (-pi, pi]."""
    return np.pi - (np.pi - angle) % (2 * np.pi)


def _half_open(angle: np.ndarray) -> np.ndarray:
    """Return angles of atan2 with -pi, which a negative zero brings about, made pi."""
    return np.where(angle <= -np.pi, np.pi, angle)
