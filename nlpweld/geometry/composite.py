"""Points, tangents and normals of composite and polyline seams, by arc length (NumPy only)."""

import numpy as np

from nlpweld.cell.seams import Composite, Polyline
from nlpweld.errors import CellError
from nlpweld.geometry.weld_frames import WeldFrames


def seam_length_m(seam: Composite | Polyline) -> float:
    """Return the arc length of a seam [m]."""
    return float(seam.track.length_m.sum())


def seam_breaks(seam: Composite | Polyline) -> np.ndarray:
    """Return the seam parameters where pieces join, ascending; a closed seam's first is 0."""
    joints = _fractions(seam)[:-1]
    return joints if seam.closed else joints[1:]


def equal_steps(seam: Composite | Polyline) -> np.ndarray:
    """Return the parameters of the seam's points, shape (points,): equal arc lengths apart.

    An open seam has its ends among them; a closed one has the first once, at 0.
    """
    return np.linspace(0.0, 1.0, seam.points, endpoint=not seam.closed)


def composite_frames(seam: Composite | Polyline, s: np.ndarray) -> WeldFrames:
    """Return the weld frames of a seam.

    Where pieces join, the one that starts there gives tangent and normal.

    Args:
        seam: composite or polyline seam.
        s: fraction of the arc length, shape (M,): in [0, 1] for open seams, one turn per unit for closed ones.

    Raises:
        CellError: a parameter of an open seam is outside [0, 1], or not a number.
    """
    s = np.asarray(s, dtype=float)
    piece, along = _located(seam, s % 1.0 if seam.closed else _inside(s))
    p, tangent = seam.track.at(piece, along)
    if isinstance(seam, Composite):
        return WeldFrames(p, tangent, _leaned(seam, tangent))
    return WeldFrames(p, tangent, _interpolated(seam, piece, along))


def _fractions(seam: Composite | Polyline) -> np.ndarray:
    """Return the parameters at the pieces' ends, shape (K + 1,), from 0 to 1."""
    ends = np.concatenate([[0.0], np.cumsum(seam.track.length_m)])
    return ends / ends[-1]


def _located(seam: Composite | Polyline, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the piece (M,) that parameters in [0, 1] fall on and the length along it (M,) [m]."""
    length, fractions = seam.track.length_m, _fractions(seam)
    piece = np.minimum(np.searchsorted(fractions, s, side="right") - 1, len(length) - 1)
    return piece, np.clip((s - fractions[piece]) * length.sum(), 0.0, length[piece])


def _inside(s: np.ndarray) -> np.ndarray:
    outside = ~((s >= 0.0) & (s <= 1.0))
    if outside.any():
        i = int(np.flatnonzero(outside)[0])
        raise CellError(f"seam parameter {s[i]:g} of point {i} is outside 0 to 1 of an open seam; keep to its ends")
    return s


def _leaned(seam: Composite, tangent: np.ndarray) -> np.ndarray:
    """Return ``side x tangent``, leaned about the tangent towards ``side``, shape (M, 3)."""
    normal = _unit(np.cross(seam.across, tangent))
    lean = np.radians(seam.lean_deg)
    return np.cos(lean) * normal + np.sin(lean) * np.cross(tangent, normal)


def _interpolated(seam: Polyline, piece: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the normals between those of a piece's ends, shape (M, 3)."""
    start, end = (_unit(n)[piece] for n in seam.piece_normals)
    share = (along / seam.track.length_m[piece])[:, None]
    return _unit((1 - share) * start + share * end)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
