"""Straight and circular pieces put end to end, as numbers: where each starts, which way, how long and how curved."""

from dataclasses import dataclass

import numpy as np

JOINED_M = 1e-6  # gap that counts as closed, and how far an arc's start may be off its plane; files round to this
SHORTEST_M = 1e-9  # a piece below this has no direction
ACROSS = 1e-3  # least sine between a direction and the tangent for a normal to be made from both


@dataclass(frozen=True)
class Track:
    """Pieces of constant curvature in order, in any frame.

    Attributes:
        start: where each piece starts, shape (K, 3) [m].
        tangent: unit tangent there, shape (K, 3).
        inward: unit vector from the start to the centre, shape (K, 3); of no account for straight pieces.
        length_m: length of each piece, shape (K,) [m].
        curvature: 1 / radius, 0 for straight pieces, shape (K,) [1/m].
    """

    start: np.ndarray
    tangent: np.ndarray
    inward: np.ndarray
    length_m: np.ndarray
    curvature: np.ndarray

    def at(self, piece: np.ndarray, along_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and unit tangents at lengths along pieces.

        Args:
            piece: index of the piece, shape (M,).
            along_m: length from the piece's start, shape (M,) [m].

        Returns:
            p, shape (M, 3) [m], and tangents, shape (M, 3).
        """
        t, n = self.tangent[piece], self.inward[piece]
        turned = (self.curvature[piece] * along_m)[:, None]
        sinc, half = np.sinc(turned / np.pi), np.sinc(turned / (2 * np.pi))  # sin(x)/x: exact on straight pieces too
        p = self.start[piece] + along_m[:, None] * (sinc * t + turned / 2 * half**2 * n)
        return p, np.cos(turned) * t + np.sin(turned) * n

    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the position and tangent at the end of each piece, shapes (K, 3)."""
        return self.at(np.arange(len(self.length_m)), self.length_m)

    def least_sine(self, direction: np.ndarray) -> np.ndarray:
        """Return the least sine between a fixed unit direction (3,) and the tangent along each piece, shape (K,)."""
        along, across = self.tangent @ direction, self.inward @ direction
        swept = self.curvature * self.length_m
        crest = np.arctan2(across, along)
        passes = np.floor((swept - crest) / np.pi) >= np.ceil(-crest / np.pi)
        ends = np.maximum(np.abs(along), np.abs(np.cos(swept) * along + np.sin(swept) * across))
        on_crest = passes & (self.curvature > 0)
        return np.sqrt(np.maximum(0.0, 1 - np.where(on_crest, np.hypot(along, across), ends) ** 2))


def line(start: np.ndarray, to: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Return a straight piece as a row of a :class:`Track`.

    Raises:
        ValueError: it has no length.
    """
    step = to - start
    length = float(np.linalg.norm(step))
    if length < SHORTEST_M:
        raise ValueError("line of zero length; leave it out or mend to_m")
    return start, step / length, np.zeros(3), length, 0.0


def arc(
    start: np.ndarray, centre: np.ndarray, axis: np.ndarray, angle: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Return a circular piece, turned about an axis through its centre, as a row of a :class:`Track`.

    Args:
        start: where it starts, shape (3,) [m].
        centre: shape (3,) [m].
        axis: direction of any length, shape (3,).
        angle: right-hand about the axis, not 0 and at most a turn either way [rad].

    Raises:
        ValueError: axis, radius or angle is zero, the angle is above a turn, or the start is not in the arc's plane.
    """
    norm = np.linalg.norm(axis)
    if norm == 0.0:
        raise ValueError("axis is zero; give the direction the arc turns about")
    if not 0.0 < abs(angle) <= 2 * np.pi + 1e-12:
        raise ValueError(f"angle_deg is {np.degrees(angle):g}; give an angle up to 360 either way, not 0")
    axis = axis / norm
    off_plane = float((start - centre) @ axis)
    if abs(off_plane) > JOINED_M:
        raise ValueError(f"arc is not joined: its start is {abs(off_plane):.3g} m off the plane through centre_m")
    outward = (start - centre) - off_plane * axis
    radius = float(np.linalg.norm(outward))
    if radius < SHORTEST_M:
        raise ValueError("centre_m is where the arc starts, so its radius is zero; move it")
    tangent = np.sign(angle) * np.cross(axis, outward) / radius
    return start, tangent, -outward / radius, radius * abs(angle), 1 / radius


def refuse_turning_back(track: Track, closed: bool, called: str) -> None:
    """Refuse pieces that turn by more than a right angle where they join.

    Args:
        track: the pieces.
        closed: whether the last joins the first.
        called: what a piece is called, e.g. ``piece``; counted from 1.

    Raises:
        ValueError: names the first such piece and the angle.
    """
    after, before = track.tangent, np.roll(track.ends()[1], 1, axis=0)
    cosine = np.sum(after * before, axis=-1)
    if not closed:
        cosine[0] = 1.0
    if (cosine < -1e-9).any():
        i = int(np.flatnonzero(cosine < -1e-9)[0])
        angle = np.degrees(np.arccos(max(-1.0, cosine[i])))
        raise ValueError(
            f"{called} {i + 1} turns back by {angle:.4g} deg from {called} {(i - 1) % len(cosine) + 1}; "
            "a seam may turn by up to 90 deg where pieces join"
        )
