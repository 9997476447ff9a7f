"""The ways to the seam and back: torches along their axes, what is carried along a line, joints straight home."""

from itertools import pairwise

import numpy as np

from nlpweld.cell import Cell
from nlpweld.cell.task import Grasp
from nlpweld.cell.timing import Pace, Timing
from nlpweld.errors import PlanError
from nlpweld.motion import Limits
from nlpweld.timing.curve import Curve, curve_through, split, straight
from nlpweld.timing.joints import Along, Arm
from nlpweld.timing.law import Run, paced

PIECES = 8  # of a straight line in space
ASIDE_M = (0.1, 0.2)  # how far a torch goes aside from its stand-off, if its straight move home collides,
DIRECTIONS = 8  # in how many directions,
RAISED_M = (0.0, 0.1, 0.2, 0.3)  # and how far it is raised
Waypoints = tuple[np.ndarray, ...]


def pace_limits(pace: Pace) -> Limits:
    """Return a pace as limits of a motion along a path."""
    return Limits(np.array(pace.speed_m_s), np.array(pace.acceleration_m_s2), np.array(pace.jerk_m_s3))


def torches(cell: Cell) -> list[str]:
    """Return the names of the welding stations."""
    return [station.name for station in cell.stations if not isinstance(station.coupling, Grasp)]


def homes(cell: Cell, timing: Timing) -> dict[str, np.ndarray]:
    """Return where torches wait, by station, in DH direction, each of shape (n,) [rad]."""
    signs = {st.name: np.array([joint.sign for joint in st.robot.joints]) for st in cell.stations}
    return {name: np.radians(signs[name] * np.array(deg)) for name, deg in timing.home_deg.items()}


def away(arm: Arm, T_W_E: np.ndarray, q: np.ndarray, offset_W: np.ndarray) -> Curve:
    """Return the joints of a tool that moves off a pose along a straight line, over its way [m].

    Args:
        arm: who holds it.
        T_W_E: where it begins, shape (4, 4).
        q: joints there, shape (n,) [rad].
        offset_W: from there to where it ends, shape (3,) [m].

    Raises:
        PlanError: a place on the way is out of reach.
    """
    length = float(np.linalg.norm(offset_W))

    def joints(way: np.ndarray) -> np.ndarray:
        T = np.tile(T_W_E, (len(way), 1, 1))
        T[:, :3, 3] += way[:, None] * (offset_W / length)
        return arm.joints(T, q)

    return curve_through(joints, split(np.array([0.0, length]), length / PIECES))


def backwards(curve: Curve) -> Curve:
    """Return a curve run from its end."""
    signs = (-1.0) ** np.arange(len(curve.coefficients))
    ends = (curve.ends[0] + curve.ends[-1] - curve.ends)[::-1]
    return Curve(ends, (curve.coefficients * signs[:, None, None])[:, ::-1])


def joint_moves(stops: list[np.ndarray], limits: np.ndarray) -> tuple[Run, ...]:
    """Return the quickest synchronised moves along straight lines in joint space, from rest to rest.

    All joints of a move share one S-curve, that of the joint that takes longest: what is passed on the way does not
    depend on drives, so a way that is free of collisions stays so.

    Args:
        stops: joints where each move begins and the last ends, each of shape (n,) [rad].
        limits: of rate, acceleration and jerk, shape (3, n).
    """
    runs = []
    for start, end in pairwise(stops):
        way = np.abs(end - start)
        moving = way > 1e-12
        if moving.any():
            runs.append(paced(straight(start, end), Limits(*(limits[:, moving] / way[moving]).min(axis=1)), limits))
    return tuple(runs)


def seam_end(along: Along, name: str, at_end: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return joints and TCP pose of a station at the seam's start or end."""
    row = along.curve.at(along.curve.ends[[-1 if at_end else 0]])
    s = np.array([1.0 if at_end else 0.0])
    T_W_C, _ = along.wanted.work(s)
    return row[0, along.columns[name]], along.wanted.tool(along.arms[name].station, s, T_W_C)[0]


def back_off(along: Along, name: str, at_end: bool, length_m: float, upwards: bool) -> np.ndarray:
    """Return from the seam's start or end to a torch's stand-off, back along its own axis or straight up, (3,) [m]."""
    _, T_W_E = seam_end(along, name, at_end)
    return length_m * (np.array([0.0, 0.0, 1.0]) if upwards else -T_W_E[:3, 2])


def stand_off(along: Along, name: str, at_end: bool, offset_W: np.ndarray) -> Curve:
    """Return a torch's straight way from the seam's start or end to its stand-off, over its length."""
    q, T_W_E = seam_end(along, name, at_end)
    return away(along.arms[name], T_W_E, q, offset_W)


def carry(along: Along, name: str, at_end: bool, offset_W: np.ndarray) -> Curve | None:
    """Return a handler's way from the placement to where the work is taken over, or None where that is one place."""
    if not offset_W.any():
        return None
    q, T_W_E = seam_end(along, name, at_end)
    return away(along.arms[name], T_W_E, q, offset_W)


def vias(along: Along, name: str, at_end: bool, offset_W: np.ndarray) -> list[Waypoints]:
    """Return the places by which a torch may go home from its stand-off, in the order to try: first by none.

    They are the stand-off, ``offset_W`` from the seam, moved aside and raised, the nearest first.
    """
    q, T_W_E = seam_end(along, name, at_end)
    arm, limits = along.arms[name], along.arms[name].station.robot.limits_rad
    found: list[Waypoints] = [()]
    for offset in _aside():
        try:
            via = away(arm, T_W_E, q, offset + offset_W).at(np.array([np.inf]))[0]
        except PlanError:
            continue
        if ((via >= limits[:, 0]) & (via <= limits[:, 1])).all():
            found.append((via,))
    return found


def _aside() -> list[np.ndarray]:
    """Return offsets in W [m], the shortest first, none left out or doubled."""
    turns = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    level = [np.zeros(2)] + [r * np.array([np.cos(a), np.sin(a)]) for r in ASIDE_M for a in turns]
    offsets = [np.append(xy, z) for xy in level for z in RAISED_M]
    return sorted((o for o in offsets if o.any()), key=lambda o: round(float(np.linalg.norm(o)), 6))
