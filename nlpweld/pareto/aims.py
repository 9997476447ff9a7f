"""What a placement may be judged by besides its cell's objective, measured on candidates and on verified plans."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell import Cell
from nlpweld.cell.robot import Robot
from nlpweld.errors import OptionError
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.holder import held
from nlpweld.formulation.paths import turns
from nlpweld.geometry.seam import seam_parameters
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
        Aim("quickest_s", "quickest pass in s", -1),
    )
}


def verified_value(aim: Aim, plan: Plan, report: Report) -> float:
    """Return what the verifier says of a plan: clearance and manipulability along the whole seam, not at points alone.

    Joint travel is the sum over stations and joints of what they turn from point to point, the way back included. The
    quickest pass takes from point to point what the slowest joint, the positioner's included, takes at its full speed:
    no motion through the plan's points is quicker, whatever the torch could do.
    """
    if aim.name == "clearance_m":
        return report.clearance_along_m
    if aim.name == "manipulability_m3":
        return min(report.singularity_min.values())
    cell, stations = plan.cell, joint_steps(plan)
    if aim.name == "travel_rad":
        return float(sum(stations[station.name].sum() for station in cell.stations))
    taken = [stations[station.name] / speeds_rad_s(station.robot) for station in cell.stations]
    table = cell.positioner
    tilted = table is not None and table.name in stations  # the plan tilts the weld, so that the table goes its own way
    turning = stations[table.name] / speeds_rad_s(table.robot) if table and tilted else turning_s(cell)
    return float(np.hstack([*taken, turning]).max(axis=1).sum())


def speeds_rad_s(robot: Robot) -> np.ndarray:
    """Return the greatest speeds of a robot's joints, shape (n,) [rad/s].

    Raises:
        OptionError: the robot's file states none.
    """
    if robot.drives is None:
        raise OptionError(f"robot '{robot.name}' states no speeds; add drives.speed_deg_s to its file")
    return np.radians(robot.drives.speed_deg_s)


def turning_s(cell: Cell) -> np.ndarray:
    """Return what the positioner's slowest joint takes from point to point at full speed, shape (N or N - 1, 1) [s]."""
    s = seam_parameters(cell)
    q = held(cell, s).q
    if cell.positioner is None or q is None:
        return np.zeros((len(s) if cell.seam.closed else len(s) - 1, 1))
    steps = turns(np.exp(1j * q.T), cell.seam.closed).T
    return (np.abs(steps) / speeds_rad_s(cell.positioner.robot)).max(axis=1, keepdims=True)


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
        if self.aim.name == "quickest_s":
            return self._quickest([np.array(arm[0]).reshape(-1, m, n, 2) for arm in arms])
        if self.aim.name == "manipulability_m3":
            lanes = np.vstack([np.array(arm[1]) for arm in arms])
        else:
            lanes = self._gaps([*(arm[4] for arm in arms), self.batch.stage.work.map(m * n)(x, data)], m * n)
        return lanes.reshape(-1, m, n).min(axis=(0, 2))

    def _travel(self, cos_sin: np.ndarray) -> np.ndarray:
        """Return what the joints of a station turn, from their cosines and sines (6, m, N, 2), shape (m,) [rad]."""
        phase = cos_sin[..., 0] + 1j * cos_sin[..., 1]
        return np.abs(turns(phase, self.batch.cell.seam.closed)).sum(axis=(0, 2))

    def _quickest(self, cos_sin: list[np.ndarray]) -> np.ndarray:
        """Return the time of the quickest pass from every station's joints (6, m, N, 2), shape (m,) [s]."""
        slowest = turning_s(self.batch.cell)[:, 0]
        for station, joints in zip(self.batch.cell.stations, cos_sin, strict=True):
            steps = np.abs(turns(joints[..., 0] + 1j * joints[..., 1], self.batch.cell.seam.closed))
            slowest = np.maximum(slowest, (steps / speeds_rad_s(station.robot)[:, None, None]).max(axis=0))
        return slowest.sum(axis=1)

    def _gaps(self, ends: list[ca.DM], lanes: int) -> np.ndarray:
        """Return all distances at every lane [m] from the ends of all owners' bodies, shape (G, lanes)."""
        stage = self.batch.stage
        met = [meeting.map(lanes)(ends[a], ends[b]) for (a, b), meeting in stage.meetings.items()]
        over = [height.map(lanes)(own) for height, own in zip(stage.heights, ends, strict=True)]
        return np.vstack([np.array(gaps) for gaps in (*met, *over)])
