"""Axis limits under which a task takes a stated time, and what such totals can and cannot tell of them.

Two totals are two equations. Where the optimum is on its plateau they hold two combinations of limits, told here by
:func:`combinations`; any limits with the same two give the same totals, so that none of them is identified.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd
from scipy.optimize.elementwise import find_root

from nlpweld.motion import Limits, s_curve
from nlpweld.palletising.cycle import Legs, after, before, legs, ways
from nlpweld.palletising.optimum import best_height, unbraked_time
from nlpweld.palletising.task import PalletTask

NAMES = tuple(f"{axis}_{kind}" for axis in "ABCD" for kind in ("speed", "acceleration", "jerk"))
SWING_DEG_S2, LIFT_M_S2 = (50.0, 3000.0), (0.5, 20.0)  # accelerations that axes A and B may have
ROUNDS = 8  # at most, of solving one total for one axis after the other
SAME_S = 1e-8  # by how much a solved total may be off
NEWTON, KEPT_S = 8, 1e-11  # steps back to the totals at most, and when they are there
STEP = 1e-4  # of the logarithm of a limit, for central differences


@dataclass(frozen=True)
class Grid:
    """Speeds and ratios of jerk to acceleration [1/s] of axes A and B to be tried, every one with every other."""

    swing_deg_s: tuple[float, ...] = (100.0, 120.0, 130.0, 145.0, 160.0)
    lift_m_s: tuple[float, ...] = (1.0, 1.2, 1.5, 2.0)
    swing_ratio: tuple[float, ...] = (5.0, 10.0, 20.0)
    lift_ratio: tuple[float, ...] = (5.0, 10.0, 20.0, 40.0)

    @property
    def points(self) -> np.ndarray:
        """All combinations, shape (k, 4), in the order of the fields."""
        return np.array(list(product(self.swing_deg_s, self.lift_m_s, self.swing_ratio, self.lift_ratio)))


def limits_of(task: PalletTask) -> np.ndarray:
    """Return speed, acceleration and jerk of A, B, C and D in one row, shape (12,), in metres or degrees."""
    bounds = [axis.limits for axis in (task.axes.A, task.axes.B, task.axes.C, task.axes.D)]
    return np.array([float(v) for b in bounds for v in (b.velocity, b.acceleration, b.jerk)])


def totals(task: PalletTask, limits: np.ndarray) -> np.ndarray:
    """Return the totals before and after [s] under other limits of the axes.

    Args:
        task: for everything but its limits.
        limits: rows as :func:`limits_of` has them, shape (..., 12).

    Returns:
        Shape (..., 2).
    """
    a, b, c, d = (Limits(*np.moveaxis(limits[..., k : k + 3, None], -2, 0)) for k in (0, 3, 6, 9))
    way = ways(task)
    beside = [s_curve(x, own).duration_s for x, own in ((way.swing_deg, a), (way.reach_m, c), (way.wrist_deg, d))]
    z_0, z_1, z_2, z_3 = task.heights_m
    these = Legs(z_0, z_1, z_2, z_3, np.max(beside, axis=0), b)
    z, _ = best_height(these, task.cycle.z_a_m)
    return task.legs * np.stack([t.total_s.sum(axis=-1) for t in (before(these), after(these, z))], axis=-1)


def calibrated(task: PalletTask, wanted_s: tuple[float, float], grid: Grid) -> pd.DataFrame:
    """Solve both totals for the accelerations of A and B at every point of a grid.

    What is saved hardly depends on A, so that its equation is solved for B and the total before for A, in turn, each by
    a bracketed root.

    Args:
        task: for everything but speeds, accelerations and jerks of A and B.
        wanted_s: totals before and after [s].
        grid: what to try.

    Returns:
        One row a point: ``NAMES`` (limits, NaN where there is no root), before_s, after_s, and whether it is solved.
    """
    points = grid.points
    rows = np.tile(limits_of(task), (len(points), 1))
    rows[:, 0], rows[:, 3] = points[:, 0], points[:, 1]
    rows[:, 1], rows[:, 4] = np.sqrt(np.prod(SWING_DEG_S2)), np.sqrt(np.prod(LIFT_M_S2))
    rows[:, [2, 5]] = rows[:, [1, 4]] * points[:, 2:]
    for _ in range(ROUNDS):
        for column, ratio, bracket, before_only in ((4, 3, LIFT_M_S2, False), (1, 2, SWING_DEG_S2, True)):
            target = wanted_s[0] if before_only else wanted_s[0] - wanted_s[1]
            rows = _solved(task, rows, (column, points[:, ratio]), bracket, (target, before_only))
        found, left = np.full((len(rows), 2), np.nan), np.isfinite(rows).all(axis=1)
        found[left] = totals(task, rows[left])
        solved = left & (np.abs(found - wanted_s) < SAME_S).all(axis=1)
        if (solved == left).all():
            break
    table = pd.DataFrame(np.where(solved[:, None], rows, np.nan), columns=NAMES)
    table[["A_speed", "B_speed"]] = points[:, :2]
    table[["A_jerk_per_s", "B_jerk_per_s"]] = points[:, 2:]
    return table.assign(before_s=found[:, 0], after_s=found[:, 1], solved=solved)


def _solved(
    task: PalletTask,
    rows: np.ndarray,
    axis: tuple[int, np.ndarray],
    bracket: tuple[float, float],
    wanted: tuple[float, bool],
) -> np.ndarray:
    """Return rows of limits with one axis's acceleration, and jerk in proportion, where its equation holds."""
    column, ratio = axis
    target, before_only = wanted

    def put(acceleration: np.ndarray, k: np.ndarray) -> np.ndarray:
        own = rows[k].copy()
        own[..., column], own[..., column + 1] = acceleration, acceleration * ratio[k]
        return own

    def missing(acceleration: np.ndarray, k: np.ndarray) -> np.ndarray:
        found = totals(task, put(acceleration, k.astype(int)))
        return (found[..., 0] if before_only else found[..., 0] - found[..., 1]) - target

    left = np.flatnonzero(np.isfinite(rows).all(axis=1))
    found = find_root(missing, bracket, args=(left.astype(float),), tolerances={"xrtol": 1e-13, "fatol": 1e-11})
    result = np.full_like(rows, np.nan)
    result[left] = np.where(found.success[:, None], put(found.x, left), np.nan)
    return result


def combinations(task: PalletTask) -> dict[str, float]:
    """Return the two combinations of limits that totals are made of where the optimum is on its plateau [s].

    ``braking_s`` is what is saved on a leg: by how much the rise and the drop, braked at both ends, take longer than
    from rest without braking, ``[T(rise) - tau(rise)] + [T(drop) - tau(drop)]``. ``leg_s`` is a leg before,
    ``T(rise) + T(drop)`` and the mean over the boxes of the slowest of A, C and D.
    """
    lift, braked, free = task.axes.B.limits, 0.0, 0.0
    for way in (task.cycle.rise_m, task.cycle.drop_m):
        braked += float(s_curve(np.array(way), lift).duration_s)
        free += float(unbraked_time(np.array(way), lift))
    return {"braking_s": braked - free, "leg_s": braked + float(legs(task).beside_s.mean())}


def sensitivity(task: PalletTask) -> np.ndarray:
    """Return the derivatives of both totals in the logarithms of all limits [s], shape (2, 12), by differences."""
    return _slopes(task, np.log(limits_of(task)))


def _slopes(task: PalletTask, logarithms: np.ndarray) -> np.ndarray:
    steps = STEP * np.eye(len(logarithms))
    forward, back = (totals(task, np.exp(logarithms + sign * steps)) for sign in (1, -1))
    return (forward - back).T / (2 * STEP)


def walk(task: PalletTask, factors: dict[str, float], steps: int = 10) -> pd.DataFrame:
    """Change some limits of A and B step by step, and the others of theirs by as little as keeps both totals.

    Axes C and D, on which no total depends, stay. Newton steps of least length keep the totals.

    Args:
        task: where to begin.
        factors: what some of ``NAMES`` are multiplied by in all.
        steps: how many to take.

    Returns:
        One row a step, the first the task's own: limits by ``NAMES``, before_s and after_s.
    """
    x = np.log(limits_of(task))
    wanted = totals(task, np.exp(x))
    way = np.log([factors.get(name, 1.0) for name in NAMES]) / steps
    free = np.array([name not in factors for name in NAMES]) & (np.arange(len(NAMES)) < 6)
    rows = [x]
    for _ in range(steps):
        x = x + way
        for _ in range(NEWTON):
            missing = wanted - totals(task, np.exp(x))
            if np.abs(missing).max() < KEPT_S:
                break
            x = x + np.linalg.pinv(_slopes(task, x) * free) @ missing
        rows.append(x)
    table = pd.DataFrame(np.exp(rows), columns=NAMES)
    table[["before_s", "after_s"]] = totals(task, np.exp(np.array(rows)))
    return table


def one_way(task: PalletTask) -> PalletTask:
    """Return the task without its way back, on half the speeds, a quarter of accelerations, an eighth of jerks.

    Every S-curve then takes twice as long, so that the totals are the same: they cannot tell the two readings apart.
    """
    names = {"speed": 2.0, "acceleration": 4.0, "jerk": 8.0}
    axes = {}
    for axis in "ABCD":
        own = getattr(task.axes, axis)
        stated = {field: getattr(own, field) for field in type(own).model_fields if field != "source"}
        axes[axis] = {field: value / names[field.partition("_")[0]] for field, value in stated.items()}
    return task.with_(axes=axes, cycle={"reading": "one_way"})
