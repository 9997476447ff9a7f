"""What a placement may be judged by besides its cell's objective, measured on candidates and on verified plans."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.formulation.batch import Batch
from nlpweld.formulation.paths import turns
from nlpweld.kinematics.ik import signs
from nlpweld.plan import Plan
from nlpweld.verify import Report
from nlpweld.verify.scene import joint_steps


@dataclass(frozen=True)
class Aim:
    """A second aim beside the objective.

    Attributes:
        name: how it is called in tables, with its unit.
        label: how it is called in figures.
        sense: 1 where more is better, -1 where less is.
        level: the level of the cell that is raised to ask for more of it, or None where a cell states none.
    """

    name: str
    label: str
    sense: int
    level: str | None = None


AIMS = {
    aim.name: aim
    for aim in (
        Aim("clearance_m", "least clearance in m", 1, "clearance_m"),
        Aim("manipulability_m3", "least manipulability in m³", 1, "singularity_floor_m3"),
        Aim("travel_rad", "joint travel in rad", -1),
    )
}


def verified_value(aim: Aim, plan: Plan, report: Report) -> float:
    """Return what the verifier says of a plan: clearance and manipulability along the whole seam, not at points alone.

    Joint travel is the sum over stations and joints of what they turn from point to point, the way back included.
    """
    if aim.name == "clearance_m":
        return report.clearance_along_m
    if aim.name == "manipulability_m3":
        return min(report.singularity_min.values())
    stations = joint_steps(plan)
    return float(sum(stations[station.name].sum() for station in plan.cell.stations))


@dataclass(frozen=True)
class Meter:
    """Measures an aim at the seam's points for candidates that the exact model found feasible.

    The exact model itself looks at no clearance beyond the level asked for, and at no joint travel.

    Attributes:
        batch: the exact model, whose graphs these are.
        aim: the aim.
    """

    batch: Batch
    aim: Aim

    def __call__(self, X: np.ndarray, mode: np.ndarray) -> np.ndarray:
        """Return the aim's value at candidates X (m, d) on their modes (m,), shape (m,)."""
        found = np.full(len(X), np.nan)
        for one in np.unique(mode):
            own = mode == one
            found[own] = self._on_mode(X[own], int(one))
        return found

    def _on_mode(self, X: np.ndarray, mode: int) -> np.ndarray:
        points, m, n = self.batch.points, len(X), self.batch.points.shape[1]
        x, data = np.repeat(X, n, axis=0).T, np.tile(points, m)
        arms = []
        for arm, branch in zip(self.batch.stage.arms, self.batch.modes[mode], strict=True):
            sides = ca.repmat(ca.DM(signs((*branch, "noflip"))), 1, m * n)
            arms.append(arm.map(m * n)(x, data, sides))
        if self.aim.name == "travel_rad":
            return np.sum([self._travel(np.array(arm[0]).reshape(-1, m, n, 2)) for arm in arms], axis=0)
        if self.aim.name == "manipulability_m3":
            lanes = np.vstack([np.array(arm[1]) for arm in arms])
        else:
            lanes = self._gaps([*(arm[4] for arm in arms), self.batch.stage.work.map(m * n)(x, data)], m * n)
        return lanes.reshape(-1, m, n).min(axis=(0, 2))

    def _travel(self, cos_sin: np.ndarray) -> np.ndarray:
        """Return what the joints of a station turn, from their cosines and sines (6, m, N, 2), shape (m,) [rad]."""
        phase = cos_sin[..., 0] + 1j * cos_sin[..., 1]
        return np.abs(turns(phase, self.batch.cell.seam.closed)).sum(axis=(0, 2))

    def _gaps(self, ends: list[ca.DM], lanes: int) -> np.ndarray:
        """Return all distances at every lane [m] from the ends of all owners' bodies, shape (G, lanes)."""
        stage = self.batch.stage
        met = [meeting.map(lanes)(ends[a], ends[b]) for (a, b), meeting in stage.meetings.items()]
        over = [height.map(lanes)(own) for height, own in zip(stage.heights, ends, strict=True)]
        return np.vstack([np.array(gaps) for gaps in (*met, *over)])
