"""What the compiled loops of :mod:`~.candidate` are given: facts of a cell, and room for one candidate."""

from typing import NamedTuple

import numpy as np


class Facts(NamedTuple):
    """What is the same for all candidates; S stations, B arm branches, owners as in the stage, P pairs of bodies.

    Attributes:
        points: data of the seam points, flat, (d * N,).
        only: the one mode to look at; all if negative.
        signs: shoulder, elbow and wrist of every arm branch, (B, 3).
        joints: lower and upper limits and DH offsets of every station, (S, 3, n) [rad].
        wrists: whether the wrists noflip and flip are allowed, (2,).
        levels: joint margin [rad], singularity floor [m^3], clearance [m], with the solvers' margins.
        owners: the two owners of every meeting, (M, 2).
        first: where each meeting's pairs begin, and the end, (M + 1,).
        bodies: the two bodies of every pair, (P, 2).
        counts: how many bodies every owner has, (S + 1,).
        numbers: squared lengths [m^2] and sum of radii [m] of every pair, as the gap graph takes them, (P, 3).
        halves: sum of half lengths of every pair [m], (P,).
        floors: owner, body and radius of every body that the floor concerns, (F, 3).
    """

    points: np.ndarray
    only: int
    signs: np.ndarray
    joints: np.ndarray
    wrists: np.ndarray
    levels: np.ndarray
    owners: np.ndarray
    first: np.ndarray
    bodies: np.ndarray
    counts: np.ndarray
    numbers: np.ndarray
    halves: np.ndarray
    floors: np.ndarray


class Scratch(NamedTuple):
    """Room for one candidate.

    Attributes:
        cos_sin: cosines, then sines, of one arm, (2 * n * N,).
        spare: (N,).
        w: manipulability by station and branch, (S, B, N) [m^3].
        gram: likewise det(J_v J_v^T) [m^6].
        ends: likewise body ends, the workpiece's last on branch 0, (S + 1, B, 6 * bodies * N) [m].
        middles: likewise the middles of their axes, (S + 1, B, 3 * bodies * N) [m].
        missed: likewise how far each constraint is missed, (S, B, 4).
        seen: likewise whether it was looked at beyond the grip, (S, B).
        known: clearance missed by meeting and both branches, NaN where not looked at, (M, B, B).
        w_chosen: manipulability on the chosen branches, (S * N,) [m^3].
        gram_chosen: likewise det(J_v J_v^T) [m^6].
        choice: branch of every station, (S,).
        total: how far each constraint is missed on the chosen branches, (4,).
    """

    cos_sin: np.ndarray
    spare: np.ndarray
    w: np.ndarray
    gram: np.ndarray
    ends: np.ndarray
    middles: np.ndarray
    missed: np.ndarray
    seen: np.ndarray
    known: np.ndarray
    w_chosen: np.ndarray
    gram_chosen: np.ndarray
    choice: np.ndarray
    total: np.ndarray
