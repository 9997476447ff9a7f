"""A whole cycle: in, down to the seam, along it, up and back; approach and retreat free of collisions."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from nlpweld.cell.timing import Timing
from nlpweld.errors import MotionError
from nlpweld.timing.curve import Curve
from nlpweld.timing.joints import Along
from nlpweld.timing.law import paced, slowed
from nlpweld.timing.moves import Part, in_a_row, joined, together
from nlpweld.timing.off_seam import (
    Waypoints,
    back_off,
    backwards,
    carry,
    homes,
    joint_moves,
    pace_limits,
    stand_off,
    torches,
    vias,
)
from nlpweld.timing.sampling import States
from nlpweld.verify.apart_in_time import apart
from nlpweld.verify.scene import limits_rad

MOST = 64  # ways tried in one phase
SLACK_RAD = 1e-9  # by which rounding may exceed a joint's limit


@dataclass(frozen=True, eq=False)
class Cycle:
    """Everything a plan's cycle is made of.

    Attributes:
        along: the joints along the seam.
        timing: what the plan is timed by.
        limits: of rate, acceleration and jerk of all joints side by side that plans are made with, shape (3, J).
        jerk: the jerk limits themselves, and none for the seam parameter, shape (J + 1,).
        step_s: greatest time between instants [s].
        upwards: whether torches come from above the seam and leave it straight up, instead of along their own axes.
    """

    along: Along
    timing: Timing
    limits: np.ndarray
    jerk: np.ndarray
    step_s: float
    upwards: bool = False

    def phases(self) -> list[tuple[str, States]]:
        """Return all phases in their order.

        Raises:
            MotionError: a way is not free of collisions or leaves the limits of a joint.
            PlanError: a way off the seam is out of reach.
        """
        approach, retreat = self._off("approach", at_end=False), self._off("retreat", at_end=True)
        plunge = [self._line(name, backwards(self._plunges[name, False])) for name in self._welders]
        withdraw = [self._line(name, self._plunges[name, True]) for name in self._welders]
        return [
            ("approach", approach),
            ("plunge", self._checked("plunge", together(plunge, approach.x[0][-1], self.jerk, self.step_s))),
            ("weld", self._weld()),
            ("withdraw", self._checked("withdraw", together(withdraw, self._end(True), self.jerk, self.step_s))),
            ("retreat", retreat),
        ]

    @cached_property
    def _welders(self) -> list[str]:
        return torches(self.along.plan.cell)

    @cached_property
    def _plunges(self) -> dict[tuple[str, bool], Curve]:
        """The way of every torch back from the seam's start (False) and end (True)."""
        ends = [(name, end) for name in self._welders for end in (False, True)]
        return {(name, end): stand_off(self.along, name, end, self._back(name, end)) for name, end in ends}

    @cached_property
    def _carries(self) -> dict[tuple[str, bool], Curve | None]:
        """The way of every handler to where the work is taken over, whichever way torches go."""
        handlers = [station.name for station in self.along.plan.cell.stations if station.name not in self._welders]
        ends, offset_W = [(name, end) for name in handlers for end in (False, True)], np.array(self.timing.carry_m)
        return {(name, end): carry(self.along, name, end, offset_W) for name, end in ends}

    def _back(self, name: str, at_end: bool) -> np.ndarray:
        return back_off(self.along, name, at_end, self.timing.stand_off_m, self.upwards)

    def _end(self, at_end: bool) -> np.ndarray:
        """Return joints and parameter at the seam's start or end, shape (J + 1,)."""
        return self.along.curve.at(self.along.curve.ends[[-1 if at_end else 0]])[0]

    def _weld(self) -> States:
        bounds = np.hstack([self.limits, np.full((3, 1), np.inf)])  # the seam parameter has no drive
        pace, stops = pace_limits(self.timing.torch), self.along.stops
        runs = [slowed(self.along.curve, pace, bounds, a, b, self.step_s) for a, b in pairwise(stops)]
        return in_a_row(runs, self.jerk, self.step_s)

    def _line(self, name: str, curve: Curve) -> Part:
        """Return a straight way in space at the pace of travel."""
        own = self.along.columns[name]
        return Part(own, (paced(curve, pace_limits(self.timing.travel), self.limits[:, own]),))

    def _off(self, phase: str, at_end: bool) -> States:
        """Return approach or retreat on the first way that is free of collisions."""
        first, rest = "", self._end(at_end)
        for ways in self._ways(at_end):
            states = self._checked(phase, self._one_way(ways, rest, at_end))
            trouble, hopeless = self._trouble(phase, states)
            if not trouble:
                return states
            first = first or trouble
            if hopeless:
                break
        raise MotionError(
            f"{phase}: {first}, and no way round was found; give another home_deg, stand_off_m or carry_m in [timing]"
        )

    def _ways(self, at_end: bool) -> Iterator[dict[str, Waypoints]]:
        """Yield by which places each torch goes, the most direct ways first."""
        yield dict.fromkeys(self._welders, ())
        each = [vias(self.along, name, at_end, self._back(name, at_end)) for name in self._welders]
        ranks = sorted(product(*(range(len(places)) for places in each)), key=lambda k: (sum(k), k))
        for rank in ranks[1:MOST]:
            yield {name: places[k] for name, places, k in zip(self._welders, each, rank, strict=True)}

    def _one_way(self, ways: dict[str, Waypoints], rest: np.ndarray, at_end: bool) -> States:
        """Return approach or retreat by given places; ``rest`` is the seam's start or end."""
        own, cell, before, parts = self.along.columns, self.along.plan.cell, rest.copy(), []
        home = homes(cell, self.timing)
        for station in cell.stations:
            name = station.name
            if name in ways:
                stops = [self._plunges[name, at_end].at(np.array([np.inf]))[0], *ways[name], home[name]]
                stops = stops if at_end else stops[::-1]
                before[own[name]] = stops[0]
                parts.append(Part(own[name], joint_moves(stops, self.limits[:, own[name]])))
                continue
            curve = self._carries[name, at_end]
            if curve is not None:
                curve = curve if at_end else backwards(curve)
                parts.append(self._line(name, curve))
                before[own[name]] = curve.at(np.array([-np.inf]))[0]
        if cell.positioner is not None and at_end:
            back = own[cell.positioner.name]
            parts.append(Part(back, joint_moves([rest[back], self._end(False)[back]], self.limits[:, back])))
        return together(parts, before, self.jerk, self.step_s)

    def _checked(self, phase: str, states: States) -> States:
        """Refuse states outside the joints' limits."""
        of_all = limits_rad(self.along.plan.cell)
        for name, own in self.along.columns.items():
            q, limits = states.x[0][:, own], of_all[name]
            beyond = np.maximum(limits[:, 0] - q, q - limits[:, 1]).max(axis=0)
            joint = int(beyond.argmax())
            if not beyond[joint] <= SLACK_RAD:
                what = f"{name} J{joint + 1} would leave its limits by {np.degrees(beyond[joint]):.3g} deg"
                raise MotionError(f"{phase}: {what}; give another home_deg, carry_m or stand_off_m in [timing]")
        return states

    def _trouble(self, phase: str, states: States) -> tuple[str, bool]:
        """Return what comes too near in a phase, or nothing, and whether it does at an end: no way round mends that."""
        plan = self.along.plan
        near = apart(plan, joined(plan, [(phase, states)]))
        level = plan.cell.constraints.clearance_m
        ends = [near.nearest(end, end) for end in (0.0, float(states.t_s[-1]))]
        hopeless = min(ends)[0] < level
        least, pair, when = min(ends) if hopeless else near.nearest(0.0, np.inf)
        if least >= level:
            return "", False
        return f"{pair} come to {1e3 * least:.1f} mm after {when:.2f} s, below {1e3 * level:g} mm", hopeless
