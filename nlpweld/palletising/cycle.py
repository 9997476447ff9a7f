"""The cycle of a box before and after: its legs, and how long their stages take (Cao et al. 2012, section 3).

Before, axis B rises from P0 to P1, all axes go to P2 together, and B sinks to P3: three moves from rest to rest. After,
B makes two, from z_0 up to z_max and down to z_3, while A, C and D start when B passes z_1 and end when it passes z_2.
"""

from dataclasses import dataclass

import numpy as np

from nlpweld.motion import Limits, SCurve, s_curve
from nlpweld.palletising.task import PalletTask


@dataclass(frozen=True, eq=False)
class Legs:
    """Ways from pick to place; arrays broadcast against each other, and against heights z_max.

    Attributes:
        z_0: height of P0 [m], and ``z_1`` to ``z_3`` likewise.
        beside_s: how long the slowest of A, C and D takes [s].
        lift: limits of axis B [m].
    """

    z_0: np.ndarray
    z_1: np.ndarray
    z_2: np.ndarray
    z_3: np.ndarray
    beside_s: np.ndarray
    lift: Limits

    @property
    def lowest_m(self) -> np.ndarray:
        """The lowest z_max that eq. (12) allows [m]."""
        return np.max([self.z_0, self.z_1, self.z_2, self.z_3], axis=0)

    def of(self, box: int) -> "Legs":
        """Return the way of one of the boxes along the first axis of the arrays."""
        return Legs(self.z_0[box], self.z_1[box], self.z_2[box], self.z_3[box], self.beside_s[box], self.lift)

    def up(self, z_max_m: np.ndarray) -> SCurve:
        """Return axis B's move from z_0 to z_max."""
        return s_curve(z_max_m - self.z_0, self.lift)

    def down(self, z_max_m: np.ndarray) -> SCurve:
        """Return axis B's move from z_max to z_3."""
        return s_curve(self.z_3 - z_max_m, self.lift)


@dataclass(frozen=True, eq=False)
class Stages:
    """The three stages of a cycle, in seconds.

    Attributes:
        up_s: t_1, from P0 to P1.
        across_s: t_2, from P1 to P2.
        down_s: t_3, from P2 to P3.
        lift_s: t_M, what axis B needs for the stage across when it does not wait; its own move before.
    """

    up_s: np.ndarray
    across_s: np.ndarray
    down_s: np.ndarray
    lift_s: np.ndarray

    @property
    def total_s(self) -> np.ndarray:
        """How long the leg takes [s]."""
        return self.up_s + self.across_s + self.down_s


@dataclass(frozen=True, eq=False)
class Ways:
    """What axes A, C and D have to go for every box, and how long each takes; shapes (n,).

    Attributes:
        swing_deg: of axis A; ``swing_s`` is its time.
        reach_m: of axis C, likewise.
        wrist_deg: of axis D, likewise: headings that differ by half a turn are the same for a box.
    """

    swing_deg: np.ndarray
    reach_m: np.ndarray
    wrist_deg: np.ndarray
    swing_s: np.ndarray
    reach_s: np.ndarray
    wrist_s: np.ndarray

    @property
    def beside_s(self) -> np.ndarray:
        """The slowest of the three [s]."""
        return np.max([self.swing_s, self.reach_s, self.wrist_s], axis=0)


def ways(task: PalletTask) -> Ways:
    """Return the displacements of A, C and D from pick to place, in cylindrical coordinates."""
    (x, y, _), (u, v, _, heading) = task.pick.at_m, task.places_m.T
    swing = _least_turn(np.degrees(np.arctan2(v, u) - np.arctan2(y, x)), 360.0)
    reach = np.hypot(u, v) - np.hypot(x, y)
    wrist = _least_turn(heading - task.pick.yaw_deg - swing, 180.0)
    axes = task.axes
    times = [s_curve(way, axis.limits).duration_s for way, axis in ((swing, axes.A), (reach, axes.C), (wrist, axes.D))]
    return Ways(swing, reach, wrist, *times)


def legs(task: PalletTask) -> Legs:
    """Return the way of every box of a task from pick to place; arrays have shape (n,)."""
    z_0, z_1, z_2, z_3 = task.heights_m
    return Legs(z_0, z_1, z_2, z_3, ways(task).beside_s, task.axes.B.limits)


def before(legs: Legs) -> Stages:
    """Return the stages of three moves from rest to rest; the slowest axis decides the one across."""
    up, lift, down = (
        s_curve(to - start, legs.lift).duration_s
        for start, to in ((legs.z_0, legs.z_1), (legs.z_1, legs.z_2), (legs.z_2, legs.z_3))
    )
    return Stages(up, np.maximum(lift, legs.beside_s), down, lift)


def after(legs: Legs, z_max_m: np.ndarray) -> Stages:
    """Return the stages of the cycle that rises to z_max: eq. (13) to (17).

    Where A, C and D take longer than t_M, axis B waits at its top.

    Args:
        legs: the ways.
        z_max_m: broadcasts against them; not under ``legs.lowest_m``.
    """
    up, down = legs.up(z_max_m), legs.down(z_max_m)
    t_1 = up.time_at(legs.z_1 - legs.z_0)
    t_3 = down.duration_s - down.time_at(legs.z_2 - z_max_m)
    t_M = up.duration_s + down.duration_s - t_1 - t_3
    return Stages(t_1, np.maximum(t_M, legs.beside_s), t_3, t_M)


def _least_turn(angle_deg: np.ndarray, whole_deg: float) -> np.ndarray:
    """Return angles within half a whole turn either way."""
    return angle_deg - whole_deg * np.round(angle_deg / whole_deg)
