"""Who moves when in a cycle, as curves: velocities before and after, and stages over the height of the top."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from nlpweld.motion import Limits, SCurve, s_curve
from nlpweld.palletising.cycle import after, before, legs, ways
from nlpweld.palletising.task import PalletTask

AXES = {"A": "deg", "B": "m", "C": "m", "D": "deg"}  # and their units
Cycle = Literal["before", "after"]


@dataclass(frozen=True, eq=False)
class Motion:
    """One move of one axis within a leg.

    Attributes:
        axis: its name.
        start_s: when it begins [s].
        curve: the move, one of no length perhaps.
    """

    axis: str
    start_s: float
    curve: SCurve


def motions(task: PalletTask, box: int, cycle: Cycle, z_max_m: float) -> list[Motion]:
    """Return all moves of a box's leg from pick to place; the way back is their mirror image.

    Args:
        task: what is palletised.
        box: which box, from 0.
        cycle: ``before``, or ``after``, where axis B waits at its top while A, C and D are not there yet.
        z_max_m: height of the top of the cycle after.
    """
    leg, z = legs(task).of(box), np.array(z_max_m)
    stages = before(leg) if cycle == "before" else after(leg, z)
    t_1, t_2, t_3 = (float(t) for t in (stages.up_s, stages.across_s, stages.down_s))
    if cycle == "before":
        across = _slowed(_b(task, leg.z_2 - leg.z_1), t_2, task)
        lift = [(0.0, _b(task, leg.z_1 - leg.z_0)), (t_1, across), (t_1 + t_2, _b(task, leg.z_3 - leg.z_2))]
    else:
        down = leg.down(z)
        lift = [(0.0, leg.up(z)), (t_1 + t_2 + t_3 - float(down.duration_s), down)]
    way, axes = ways(task), task.axes
    others = (("A", way.swing_deg, axes.A), ("C", way.reach_m, axes.C), ("D", way.wrist_deg, axes.D))
    beside = [Motion(name, t_1, _slowed(_move(all_[box], axis.limits), t_2, task)) for name, all_, axis in others]
    return [*(Motion("B", start, curve) for start, curve in lift), *beside]


def at(moves: list[Motion], axis: str, t_s: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Return how far an axis has come at instants, from where it began, or a derivative of that, shape (n,)."""
    value = np.zeros(np.shape(t_s))
    for move in moves:
        if move.axis == axis:
            value += move.curve.at(t_s - move.start_s, derivative)
    return value


def velocities(task: PalletTask, box: int, z_max_m: float, count: int = 401) -> pd.DataFrame:
    """Return the velocities of all axes on a box's leg: cycle, t_s, A_deg_s, B_m_s, C_m_s, D_deg_s."""
    parts = []
    for cycle in ("before", "after"):
        moves = motions(task, box, cycle, z_max_m)
        t = np.linspace(0.0, max(move.start_s + float(move.curve.duration_s) for move in moves), count)
        columns = {f"{axis}_{unit}_s": at(moves, axis, t, 1) for axis, unit in AXES.items()}
        parts.append(pd.DataFrame({"cycle": cycle, "t_s": t} | columns))
    return pd.concat(parts, ignore_index=True)


def over_height(task: PalletTask, box: int, count: int = 401) -> pd.DataFrame:
    """Return a leg's stages over z_max, for Cao et al.'s Fig. 9 to 12.

    Columns: z_max_m, up_s (t_1), across_s (t_2), down_s (t_3), lift_s (t_M), beside_s (the slowest of A, C and D) and
    total_s.
    """
    leg = legs(task).of(box)
    z = np.linspace(float(leg.lowest_m), task.cycle.z_a_m, count)
    stages = after(leg, z)
    columns = {name: getattr(stages, name) for name in ("up_s", "across_s", "down_s", "lift_s", "total_s")}
    return pd.DataFrame({"z_max_m": z, **columns, "beside_s": float(leg.beside_s)})


def _b(task: PalletTask, way: float) -> SCurve:
    return _move(way, task.axes.B.limits)


def _move(way: float, limits: Limits) -> SCurve:
    return s_curve(np.array(way), limits)


def _slowed(curve: SCurve, duration_s: float, task: PalletTask) -> SCurve:
    """Return a move that arrives with the others, where axes are synchronised."""
    return curve.stretched(np.array(duration_s)) if task.cycle.synchronised else curve
