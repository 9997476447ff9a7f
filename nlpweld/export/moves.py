"""A timed plan as its controllers see it: instants, and joints in the direction in which each controller counts."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from nlpweld.cell.robot import Robot
from nlpweld.export.instants import TICK_S, chosen, deviation_rad
from nlpweld.plan import Plan
from nlpweld.timeline import Timeline

AT_REST_RAD_S = 1e-6


@dataclass(frozen=True, eq=False)
class Mover:
    """A robot or positioner and its joints at K instants, in controller direction, each array of shape (K, n).

    Attributes:
        name: of the station or positioner.
        robot: as its file states it.
        q: joint angles [rad].
        rate: their first derivative [rad/s].
        acceleration: their second derivative [rad/s^2].
    """

    name: str
    robot: Robot
    q: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True, eq=False)
class Moves:
    """What is written, whatever the format.

    Attributes:
        cell: name of the cell.
        t_s: instants, whole microseconds, shape (K,) [s].
        s: seam parameter of the torches, shape (K,).
        welding: whether the torches weld from an instant to the next, shape (K,).
        resting: whether everything stands still at an instant, shape (K,).
        begins: index of an instant to the name of the phase that begins there.
        robots: the stations, in the order of the cell.
        positioner: what holds the work, if no robot does.
        deviation_rad: how far any joint of the plan is from straight lines in joint space between the instants.
    """

    cell: str
    t_s: np.ndarray
    s: np.ndarray
    welding: np.ndarray
    resting: np.ndarray
    begins: dict[int, str]
    robots: tuple[Mover, ...]
    positioner: Mover | None
    deviation_rad: float

    @property
    def movers(self) -> tuple[Mover, ...]:
        """The robots, then the positioner."""
        return self.robots if self.positioner is None else (*self.robots, self.positioner)

    @property
    def steps_s(self) -> np.ndarray:
        """Time from each instant to the next, shape (K - 1,) [s]."""
        return np.diff(self.t_s)

    @property
    def blocks(self) -> list[tuple[int, int]]:
        """Pairs of instants, by index, at which a phase begins or ends and everything stands still."""
        last = len(self.t_s) - 1
        stops = [k for k in sorted(self.begins) if k == 0 or self.resting[k]]
        return list(pairwise([*stops, last]))


def moves_of(plan: Plan, every_s: float | None = None) -> Moves:
    """Return what a timed plan asks of its controllers.

    Args:
        plan: with a timeline.
        every_s: see :func:`~nlpweld.export.instants.chosen`.

    Raises:
        PlanError: the plan is not timed.
        OptionError: a step that cannot be used.
    """
    timeline = plan.needed_timeline
    t_s = chosen(timeline, plan.s, every_s)
    held = plan.cell.positioner
    motion = [timeline.at(t_s, derivative) for derivative in range(3)]

    def mover(name: str, robot: Robot) -> Mover:
        signs = np.array([joint.sign for joint in robot.joints])
        return Mover(name, robot, *(signs * values[name] for values in motion))

    fastest = np.max([np.abs(rate).max(axis=1) for rate in motion[1].values()], axis=0)
    begin, end = timeline.span_s("weld")
    return Moves(
        cell=plan.cell.name,
        t_s=t_s,
        s=timeline.s_at(t_s),
        welding=(t_s > begin - TICK_S / 2) & (t_s < end - TICK_S / 2),
        resting=fastest < AT_REST_RAD_S,
        begins=_begins(timeline, t_s),
        robots=tuple(mover(station.name, station.robot) for station in plan.cell.stations),
        positioner=mover(held.name, held.robot) if held else None,
        deviation_rad=deviation_rad(timeline, t_s),
    )


def _begins(timeline: Timeline, t_s: np.ndarray) -> dict[int, str]:
    """Return by index of an instant the phase that begins there; phases of no length are left out."""
    found, begin = {}, 0.0
    for name, until in timeline.phases:
        if until - begin > TICK_S:
            found[int(np.abs(t_s - begin).argmin())] = name
        begin = until
    return found
