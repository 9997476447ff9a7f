"""Joint paths as curves: along the seam, and along straight lines to and from it, by the closed-form inverse."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from nlpweld.cell import Cell, Station
from nlpweld.errors import PlanError
from nlpweld.kinematics.chain import rpy_pose
from nlpweld.kinematics.ik import BRANCHES, SphericalArm, signs, spherical_arm
from nlpweld.plan import Plan, joint_counts
from nlpweld.timing.curve import Curve, arc_length, curve_through, split
from nlpweld.timing.wanted import Wanted

SAME_RAD = 1e-3  # by which a plan's joints may be off the inverse at its points; chains it closes to 1e-6 m are nearer
PIECES = 48  # of a seam, at least


@dataclass(frozen=True, eq=False)
class Arm:
    """A station and the branch a plan has it on.

    Attributes:
        station: the robot at its place.
        branch: signs of shoulder, elbow and wrist.
    """

    station: Station
    branch: tuple[int, int, int]

    def joints(self, T_W_E: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Return joints for TCP poses (M, 4, 4), continuous, the first within half a turn of ``near``, (M, 6) [rad].

        Raises:
            PlanError: a pose is out of reach.
        """
        q, reach = inverse(self.station, T_W_E, self.branch)
        if not reach.min() >= 0:
            raise PlanError(f"{self.station.name}: cannot reach all of the way off the seam; shorten it in [timing]")
        q = np.unwrap(q, axis=0)
        return q + 2 * np.pi * np.round((near - q[0]) / (2 * np.pi))


def inverse(station: Station, T_W_E: np.ndarray, branch: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return joints in (-pi, pi], shape (M, 6) [rad], and reach (M,), negative where there are none."""
    T_W_B = rpy_pose(station.base_position_m, station.base_rpy_deg)
    T_F_E = rpy_pose(station.tool.translation_m, station.tool.rpy_deg)
    T_B_F = np.linalg.inv(T_W_B) @ T_W_E @ np.linalg.inv(T_F_E)
    m = len(T_B_F)
    solve = _solver(spherical_arm(station.robot)).map(m)
    q, reach = solve(T_B_F.transpose(1, 0, 2).reshape(4, 4 * m), ca.DM(np.tile(np.array([branch]).T, m)))
    return np.array(q).T, np.array(reach).reshape(-1)


@lru_cache(maxsize=16)
def _solver(arm: SphericalArm) -> ca.Function:
    """Return an arm's inverse as a function, built once."""
    return arm.function


@dataclass(frozen=True, eq=False)
class Along:
    """All joints of a cell along the seam of a plan.

    Attributes:
        wanted: what the plan asks for.
        arms: every station on its branch, by name.
        curve: joints of everything, side by side, then the seam parameter, over the arc length of the main seam [m].
        stops: arc lengths at which everything has to stand, ascending, both ends included [m].
    """

    wanted: Wanted
    arms: dict[str, Arm]
    curve: Curve
    stops: np.ndarray

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self.wanted.plan

    @cached_property
    def columns(self) -> dict[str, slice]:
        """Which columns of the curve belong to whom."""
        return columns(self.plan.cell)


def columns(cell: Cell) -> dict[str, slice]:
    """Return by name which columns of all joints side by side belong to a station or the positioner."""
    counts = joint_counts(cell)
    ends = np.cumsum([0, *counts.values()])
    return {name: slice(int(a), int(b)) for name, a, b in zip(counts, ends[:-1], ends[1:], strict=True)}


def along_seam(plan: Plan, wanted: Wanted, exact: Wanted) -> Along:
    """Return the joints along the seam, on the plan's branches and turns.

    Args:
        plan: the plan.
        wanted: what it asks for, kinks spread.
        exact: the same with its kinks as they are, which its own points are held against.

    Raises:
        PlanError: the plan's joints are not those that close its chains.
    """
    arms = _arms(plan, exact)
    cuts = np.unique(np.concatenate([[0.0, 1.0], *(seam.cuts for seam in wanted.seams.values()), _knots(plan)]))
    ends = split(cuts[np.diff(cuts, prepend=-1.0) > 1e-9], 1 / PIECES)
    main = wanted.seams["main"]
    sigma, parameter = arc_length(main.points, ends)

    def joints(at: np.ndarray) -> np.ndarray:
        s = np.clip(parameter.at(at)[:, 0], 0.0, 1.0)
        T_W_C, table = wanted.work(s)
        found = [arm.joints(wanted.tool(arm.station, s, T_W_C), plan.paths[name][0]) for name, arm in arms.items()]
        return np.concatenate([*found, table, s[:, None]], axis=1)

    rests = [kink.s for seam in wanted.seams.values() for kink in seam.kinks if kink.corner or kink.half == 0.0]
    stops = np.unique(np.concatenate([sigma[[0, -1]], np.interp([s for s in rests if 0 < s < 1], ends, sigma)]))
    along = Along(wanted, arms, curve_through(joints, sigma), stops)
    _refuse_other_turns(along, np.interp(plan.s, ends, sigma))
    return along


def _knots(plan: Plan) -> np.ndarray:
    return np.asarray(plan.s, dtype=float) if plan.freedom else np.empty(0)


def _arms(plan: Plan, exact: Wanted) -> dict[str, Arm]:
    """Return every station on the branch that meets the plan's joints at its points."""
    T_W_C, table = exact.work(plan.s)
    if plan.cell.positioner is not None:
        name = plan.cell.positioner.name
        off = np.abs(np.asarray(plan.paths[name]) - table).max(axis=1)
        _refuse_open(name, off)
        T_W_C = exact.turned(np.asarray(plan.paths[name]))
    arms = {}
    for station in plan.cell.stations:
        T_W_E, path = exact.tool(station, plan.s, T_W_C), np.asarray(plan.paths[station.name])
        best: tuple[np.ndarray, tuple[int, int, int]] | None = None
        for branch in BRANCHES:
            q, _ = inverse(station, T_W_E, signs(branch))
            apart = np.abs((q - path + np.pi) % (2 * np.pi) - np.pi).max(axis=1)
            if best is None or apart.max() < best[0].max():
                best = apart, signs(branch)
        assert best is not None
        _refuse_open(station.name, best[0])
        arms[station.name] = Arm(station, best[1])
    return arms


def _refuse_open(name: str, off: np.ndarray) -> None:
    worst = int(off.argmax())
    if not off[worst] <= SAME_RAD:
        raise PlanError(
            f"a plan without closure: {name} is {np.degrees(off[worst]):.3g} deg off the joints that follow the weld "
            f"at point {worst}; see 'nlpweld verify', and solve again"
        )


def _refuse_other_turns(along: Along, sigma: np.ndarray) -> None:
    """Refuse a plan whose joints are whole turns off at some points: between them it is torn."""
    q = along.curve.at(sigma)
    for name, own in along.columns.items():
        torn = np.abs(q[:, own] - along.plan.paths[name]).max(axis=1) > np.pi
        if torn.any():
            point = int(torn.argmax())
            raise PlanError(f"a plan that is torn: {name} turns by whole turns before point {point}; solve again")
