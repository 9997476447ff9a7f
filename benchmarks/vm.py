"""The same stage functions in CasADi's virtual machine, mapped over the seam, with NumPy in between."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from benchmarks.naive import Verdict
from nlpweld.cell import Cell, Robot
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.manipulability import mmr


@dataclass(eq=False)
class Vm:
    """CasADi functions, one candidate at a time; leaves out as early as nlpweld does.

    Attributes:
        cell: a cell whose robots stand in front, elbow up; either wrist will do.
    """

    cell: Cell

    def __post_init__(self) -> None:
        """Map every graph over the seam."""
        stage, n = Stage(self.cell), self.cell.seam.points
        self.points = ca.DM(point_data(self.cell, seam_parameters(self.cell)))
        self.grips = [f.map(n) for f in stage.grips]
        self.limbs = [f.map(n) for f in stage.limbs]
        self.meetings = {pair: f.map(n) for pair, f in stage.meetings.items()}
        self.work, self.heights = stage.work.map(n), [f.map(n) for f in stage.heights]
        self.front_up = ca.DM(np.ones((3, n)))
        self.tight = self.cell.tight

    def __call__(self, X: np.ndarray) -> list[Verdict]:
        """Return the verdict of every placement (m, 3) [m]."""
        return [self.verdict(x) for x in X]

    def verdict(self, x: np.ndarray) -> Verdict:
        """Return the verdict of one placement (3,) [m]."""
        level = self.cell.constraints
        at, n = ca.repmat(ca.DM(x), 1, self.cell.seam.points), self.cell.seam.points
        grips = [f(at, self.points, self.front_up) for f in self.grips]
        if min(float(ca.mmin(reach)) for _, _, reach in grips) < 0.0:
            return Verdict(float("-inf"), False)
        w = [np.array(grip[1]).ravel() for grip in grips]
        need = np.radians(level.joint_margin_deg)
        good = np.min(w) >= level.singularity_floor_m3 + level.singularity_margin_m3
        angles = [np.array(grip[0]).reshape(6, n, 2) for grip in grips]
        if not good or not all(_inside(s.robot, a, need) for s, a in zip(self.cell.stations, angles, strict=True)):
            return Verdict(float("-inf"), False)
        limbs = [f(at, grip[0]) for f, grip in zip(self.limbs, grips, strict=True)]
        ends = [*(limb[1] for limb in limbs), self.work(at, self.points)]
        low = [float(ca.mmin(f(own))) for f, own in zip(self.heights, ends, strict=True)]
        low += [float(ca.mmin(f(ends[a], ends[b]))) for (a, b), f in self.meetings.items()]
        gram = [np.array(limb[0]).ravel() for limb in limbs]
        value = mmr(self.cell.objective.reading, w, gram, self.tight).mean()
        return Verdict(float(value), min(low) >= level.clearance_m + level.clearance_margin_m, min(low))


def _inside(robot: Robot, angles: np.ndarray, need: float) -> bool:
    """Tell whether the closed paths of cosines and sines (6, N, 2), on either wrist, keep the joint limits."""
    theta = np.arctan2(angles[..., 1], angles[..., 0])
    q = np.unwrap(np.hstack([theta, theta[:, :1]]), axis=1) - robot.dh[:, 3:]
    low, high = q.min(axis=1), q.max(axis=1)
    bent = 2 * robot.dh[4, 3]
    turned = [0.0, 0.0, 0.0, np.pi, 0.0, np.pi]
    other = np.array([low + turned, high + turned])
    other[:, 4] = -high[4] - bent, -low[4] - bent
    return _fit(robot, low, high, need) or _fit(robot, *other, need)


def _fit(robot: Robot, low: np.ndarray, high: np.ndarray, need: float) -> bool:
    lower, upper = robot.limits_rad.T
    turns = np.array([[0.0], [2 * np.pi], [-2 * np.pi]])
    fits = (low + turns - lower >= need) & (upper - high - turns >= need)
    return bool(fits.any(axis=0).all())
