"""Weld frames along a seam, with sudden changes of their turning rate spread over some length."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BPoly
from scipy.spatial.transform import Rotation

from nlpweld.cell import Cell
from nlpweld.cell.task import Saddle
from nlpweld.geometry.composite import seam_breaks, seam_length_m
from nlpweld.geometry.seam import weld_frames
from nlpweld.geometry.weld_angles import weld_rotations
from nlpweld.timing.curve import curve_through

STEP = 1e-7  # of the seam parameter, from a break to where its sides are told apart
SAME_RAD = 1e-6  # between directions of both sides
SAME_RATE = 1e-4  # [rad] a whole seam, between turning rates of both sides
ROOM = 0.45  # of the way to the next break, at most, is a blend's


@dataclass(frozen=True, eq=False)
class Kink:
    """Where pieces of a seam join and its frame turns on at another rate, or stands otherwise.

    Attributes:
        s: seam parameter.
        corner: whether the seam's own direction jumps, so that no torch can go round it without a stop.
        half: half the parameter over which it is spread; 0 where it is not.
        R_C_p: the weld frame there, shape (3, 3).
        turn: rotation vector from that frame as a polynomial of the parameter's distance, or None where not spread.
    """

    s: float
    corner: bool
    half: float
    R_C_p: np.ndarray
    turn: BPoly | None


@dataclass(frozen=True, eq=False)
class SeamFrames:
    """The frames of one seam.

    Within a blend the rotation vector from the frame at the kink follows the quintic that meets it, its rate and
    its acceleration at both ends of the blend. Points stay where they are: only directions are blended.

    Attributes:
        cell: the cell.
        name: the seam's name.
        breaks: where pieces join, shape (B,).
        kinks: those of them where frames turn on otherwise.
    """

    cell: Cell
    name: str
    breaks: np.ndarray
    kinks: tuple[Kink, ...]

    def points(self, s: np.ndarray) -> np.ndarray:
        """Return weld points in C, shape (M, 3) [m]."""
        return weld_frames(self.cell, s, self.name).p_C

    def rotations(self, s: np.ndarray) -> np.ndarray:
        """Return R_C_p at parameters (M,), shape (M, 3, 3), blended."""
        R = weld_rotations(weld_frames(self.cell, s, self.name))
        for kink in self.kinks:
            off = _apart(self.cell, s, kink.s)
            inside = np.abs(off) < kink.half
            if kink.turn is not None and inside.any():
                R[inside] = kink.R_C_p @ Rotation.from_rotvec(kink.turn(off[inside])).as_matrix()
        return R

    @property
    def cuts(self) -> np.ndarray:
        """Where frames or points are no longer one smooth function, shape (C,), in [0, 1]."""
        around = [kink.s + side * kink.half for kink in self.kinks for side in (-1, 1)]
        cuts = np.concatenate([self.breaks, around])
        return np.unique(cuts % 1.0) if self.cell.seams[self.name].closed else cuts[(cuts > 0) & (cuts < 1)]


def seam_frames(cell: Cell, name: str, blend_m: float) -> SeamFrames:
    """Return the frames of a seam, kinks spread over ``blend_m`` [m] to either side, or as far as there is room."""
    seam = cell.seams[name]
    if isinstance(seam, Saddle):
        return SeamFrames(cell, name, np.empty(0), ())
    at = seam_breaks(seam)
    marks = np.append(at, at[0] + 1) if seam.closed else np.concatenate([[0.0], at, [1.0]])
    gap = np.diff(marks)
    room = np.minimum(np.roll(gap, 1), gap) if seam.closed else np.minimum(gap[:-1], gap[1:])
    half = np.minimum(blend_m / seam_length_m(seam), ROOM * room)
    kinks = (_kink(cell, name, float(s), float(h), float(r)) for s, h, r in zip(at, half, room, strict=True))
    return SeamFrames(cell, name, at, tuple(kink for kink in kinks if kink is not None))


def _kink(cell: Cell, name: str, s: float, half: float, room: float) -> Kink | None:
    """Return the kink at a break, or None where the seam goes on as before."""
    beside = weld_rotations(weld_frames(cell, _inside(cell, s + STEP * np.array([-2.0, -1.0, 1.0, 2.0])), name))
    turns = Rotation.from_matrix(beside[2].T @ beside).as_rotvec()
    before, after = (turns[1] - turns[0]) / STEP, (turns[3] - turns[2]) / STEP
    apart = turns[1] + (before + after) * STEP
    corner = np.linalg.norm(np.cross(beside[1][:, 0], beside[2][:, 0])) > SAME_RAD + 2 * STEP * np.abs(after).max()
    if np.abs(apart).max() <= SAME_RAD and np.abs(after - before).max() <= SAME_RATE:
        return None
    R = beside[2] @ Rotation.from_rotvec(-after * STEP).as_matrix()
    if half == 0.0:
        return Kink(s, bool(corner), 0.0, R, None)
    width = min(half, ROOM * room)

    def turn(off: np.ndarray) -> np.ndarray:
        frames = weld_rotations(weld_frames(cell, _inside(cell, s + off), name))
        return Rotation.from_matrix(R.T @ frames).as_rotvec()

    sides = (np.array([-half - width, -half]), np.array([half, half + width]))
    ends = [
        [curve_through(turn, side).at(np.array([end]), d)[0] for d in range(3)]
        for side, end in zip(sides, (-half, half), strict=True)
    ]
    return Kink(s, bool(corner), half, R, BPoly.from_derivatives([-half, half], ends))


def _inside(cell: Cell, s: np.ndarray) -> np.ndarray:
    return s % 1.0 if cell.seam.closed else np.clip(s, 0.0, 1.0)


def _apart(cell: Cell, s: np.ndarray, at: float) -> np.ndarray:
    """Return the parameter from a place, around a closed seam the shorter way."""
    return (s - at + 0.5) % 1.0 - 0.5 if cell.seam.closed else s - at
