"""The constraints of a plan, each a function that returns what breaks it; levels are exact, without margins."""

import math
from collections.abc import Iterator

import numpy as np

from nlpweld.cell import Station
from nlpweld.geometry.seam import seam_parameters
from nlpweld.plan import Plan
from nlpweld.verify.bodies import WORKPIECE
from nlpweld.verify.branch import JOINT, Side, has_branches, sides
from nlpweld.verify.report import Violation
from nlpweld.verify.scene import Scene, joint_steps, limits_rad
from nlpweld.verify.upright import posture_limit

CLOSURE = 1e-6  # [m] and [rad], at the points
SAME_S = 1e-9
WITHIN = 1e-9  # [rad], how far a free angle or a joint step may be beyond its bound
HELD = 1e-9  # [m] and [rad], how far a coordinate that the cell holds may be off
AXES = (("x", "m"), ("y", "m"), ("z", "m"), ("yaw", "rad"))


def violations(plan: Plan, scene: Scene) -> list[Violation]:
    """Return everything a plan breaks, in no order and with repetitions."""
    return [
        *points(plan),
        *box(plan),
        *closure(plan, scene),
        *posture(plan, scene),
        *continuity(plan, scene),
        *branches(plan, scene),
        *joint_limits(plan, scene),
        *singularity(plan, scene),
        *clearance(plan, scene),
        *freedom(plan),
        *tilt(plan, scene),
        *joint_step(plan),
    ]


def points(plan: Plan) -> Iterator[Violation]:
    """The plan's points are the seam's points, all of them: otherwise their mean is not the objective."""
    s = seam_parameters(plan.cell)
    if len(s) != len(plan.s):
        note = "number of points is not the cell's"
        yield Violation("points", None, None, len(plan.s), len(s), note=note)
    elif np.abs(plan.s - s).max() > SAME_S:
        worst = int(np.abs(plan.s - s).argmax())
        note = "the seam parameter is not the cell's"
        yield Violation("points", None, worst, float(plan.s[worst]), float(s[worst]), s=float(plan.s[worst]), note=note)


def box(plan: Plan) -> Iterator[Violation]:
    """The placement lies in the cell's search box; where both bounds are one value, on it."""
    bounds = plan.cell.search.bounds.T
    for (axis, unit), value, (lower, upper) in zip(AXES, plan.placement, bounds, strict=True):
        slack = HELD if lower == upper else 0.0
        if not lower - slack <= value <= upper + slack:
            limit = lower if value < lower else upper
            # Axes are told apart like joints: one violation for each.
            yield Violation("box", None, None, float(value), float(limit), joint=axis, unit=unit, note="placement")


def closure(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every TCP is where the weld asks, at the points and between them.

    Pan et al., eq. 1, 2, 4, 5; behind a positioner the loops of Zhang et al., eq. 5 to 15, close on its own joints.
    """
    for name, errors in scene.closure.items():
        for error, unit in zip(errors, ("m", "rad"), strict=True):
            point = int(error.argmax())
            if not error[point] <= CLOSURE:
                s = float(plan.s[point])
                yield Violation("closure", name, point, float(error[point]), CLOSURE, s=s, unit=unit)
    for gap in scene.motion.unclosed:
        if gap.robot in scene.closure:
            point, s = _nearest(plan, gap.s)
            note = "no configuration between the neighbours reaches the weld"
            value, unit = max((gap.position_m, "m"), (gap.rotation_rad, "rad"))
            yield Violation("closure", gap.robot, point, value, CLOSURE, s=s, unit=unit, note=note)


def posture(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """The positioner holds the main seam's weld upright (Zhang et al., eq. 7, 8), or tilted as the plan says.

    At the points and between them.
    """
    if plan.cell.positioner is None:
        return
    name, limit = plan.cell.positioner.name, posture_limit(plan.cell)
    k = int(scene.off_upright.argmax())
    if not scene.off_upright[k] <= limit:
        point, s = _place(plan, scene, k)
        yield Violation("posture", name, point, float(scene.off_upright[k]), limit, s=s, unit="rad")
    for gap in scene.motion.unclosed:
        if gap.robot == name:
            point, s = _nearest(plan, gap.s)
            note = "no joints between the neighbours hold the weld upright, or tilted as the plan says"
            yield Violation("posture", name, point, gap.rotation_rad, limit, s=s, unit="rad", note=note)


def continuity(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Joint paths are continuous along the seam, a closed one's from the last point to the first too."""
    for jump in scene.motion.jumps:
        point, s = _place(plan, scene, int(np.searchsorted(scene.motion.s, jump.s)))
        joint = f"J{jump.joint + 1}"
        note = f"moves too far between samples, however fine; {joint} moves most"
        what = (point, jump.step, jump.limit, s, joint)
        yield Violation("continuity", jump.robot, *what, unit=jump.unit, note=note)


def branches(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every arm is on the branch the cell allows and the plan states, and stays on it."""
    for station in plan.cell.stations:
        if not has_branches(station.robot):
            continue
        q, links = scene.motion.q[station.name], scene.links[station.name]
        for i, side in enumerate(sides(station, q, links)):
            for label, who in _asked(plan, station, side, i):
                yield from _contrary(plan, scene, station, side, (label, who))


def joint_limits(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every joint path, as given and not shifted by whole turns, lies within the limits."""
    for name, limits in limits_rad(plan.cell).items():
        margin = scene.joint_margin[name]
        worst = margin.min(axis=(0, 2))
        for joint in np.flatnonzero(~(worst >= 0)):
            k, side = np.unravel_index(margin[:, joint].argmin(), margin[:, joint].shape)
            value, limit = scene.motion.q[name][k, joint], limits[joint, side]
            note = f"{np.degrees(value):.2f} deg, DH direction"
            point, s = _place(plan, scene, int(k))
            what = (float(value), float(limit))
            yield Violation("joint_limit", name, point, *what, s=s, joint=f"J{joint + 1}", unit="rad", note=note)


def singularity(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every robot's w stays at or above the floor: the paper's rank condition made robust."""
    floor = plan.cell.constraints.singularity_floor_m3
    for name, w in scene.w.items():
        k = int(w.argmin())
        if not w[k] >= floor:
            point, s = _place(plan, scene, k)
            yield Violation("singularity", name, point, float(w[k]), floor, s=s, unit="m^3")


def clearance(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every pair of bodies keeps its distance (Pan et al. ask SD_min > 0)."""
    level = plan.cell.constraints.clearance_m
    labels, owners = scene.table.pair_labels, scene.table.pair_owners
    for pair in np.flatnonzero(~(scene.clearance_m.min(axis=0) >= level)):
        k = int(scene.clearance_m[:, pair].argmin())
        point, s = _place(plan, scene, k)
        value = float(scene.clearance_m[k, pair])
        yield Violation("clearance", owners[pair], point, value, level, s=s, pair=labels[pair], unit="m")


def freedom(plan: Plan) -> Iterator[Violation]:
    """Every free angle is within the cell's band, at the points and so between them; and so is a held torch."""
    if plan.freedom is None:
        return
    if plan.cell.freedom is None:
        yield Violation(
            "freedom",
            None,
            None,
            math.nan,
            math.nan,
            note="the cell has no [freedom] table, and the plan takes freedom",
        )
        return
    for name, offsets in plan.freedom.items():
        kind, robot = angle_of(name)
        band = np.radians(getattr(plan.cell.freedom, f"{kind}_deg"))
        beyond = np.maximum(band[0] - offsets, offsets - band[1])
        k = int(beyond.argmax())
        if not beyond[k] <= WITHIN:
            value, limit = float(offsets[k]), float(band[int(offsets[k] > band[1])])
            note = f"{np.degrees(value):.2f} deg off the nominal"
            s = float(plan.s[k])
            yield Violation("freedom", robot, k, value, limit, s=s, joint=kind, unit="rad", note=note)
    for station in plan.cell.stations:
        yield from _held(plan, station)


def tilt(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Where a plan tilts a weld that a positioner holds, it is the joints that keep the bands, along the whole seam.

    Slope and rotation are read off the joints; that they are those of the plan is for :func:`posture` to say.
    """
    if plan.cell.freedom is None or not set(scene.tilt) & set(plan.freedom or {}):
        return
    for name, angle in scene.tilt.items():
        band = np.radians(getattr(plan.cell.freedom, f"{name}_deg"))
        beyond = np.maximum(band[0] - angle, angle - band[1])
        k = int(beyond.argmax())
        if not beyond[k] <= WITHIN:
            value, limit = float(angle[k]), float(band[int(angle[k] > band[1])])
            point, s = _place(plan, scene, k)
            note = f"{np.degrees(value):.2f} deg off the position, by the positioner's joints"
            owner = plan.cell.positioner.name if plan.cell.positioner else None
            yield Violation("freedom", owner, point, value, limit, s=s, joint=name, unit="rad", note=note)


def _held(plan: Plan, station: Station) -> Iterator[Violation]:
    """A torch's travel and work angle, as much as they leave a right angle, do so by no more than one together."""
    held, free = getattr(station.coupling, "angles", None), plan.freedom or {}
    if held is None:
        return
    travel = np.radians(held.travel_deg - 90) + free.get(f"travel.{station.name}", np.zeros(len(plan.s)))
    work = np.radians(held.work_deg + 90) + free.get(f"work.{station.name}", np.zeros(len(plan.s)))
    off = np.abs(travel) + np.abs(work)
    k = int(off.argmax())
    if not off[k] <= np.pi / 2 + WITHIN:
        note = "no torch direction has these angles, which leave a right angle by more than one together"
        s = float(plan.s[k])
        what = (float(off[k]), np.pi / 2)
        yield Violation("freedom", station.name, k, *what, s=s, joint="travel, work", unit="rad", note=note)


def joint_step(plan: Plan) -> Iterator[Violation]:
    """No joint of a robot turns farther from one point to the next than a cell with freedom allows.

    Nor does one of the positioner where the plan tilts the weld.
    """
    if plan.freedom is None or plan.cell.freedom is None:
        return
    limit = float(np.radians(plan.cell.freedom.joint_step_deg))
    for name, steps in joint_steps(plan).items():
        for joint in np.flatnonzero(~(steps.max(axis=0) <= limit + WITHIN)):
            k = int(steps[:, joint].argmax())
            value, s = float(steps[k, joint]), float(plan.s[k])
            note = f"{np.degrees(value):.2f} deg to the next point"
            yield Violation("joint_step", name, k, value, limit, s=s, joint=f"J{joint + 1}", unit="rad", note=note)


def angle_of(name: str) -> tuple[str, str]:
    """Return the kind of a free angle, e.g. ``spin``, and whose it is: a station's, or the workpiece's."""
    kind, _, robot = name.partition(".")
    return kind, robot or WORKPIECE


def _asked(plan: Plan, station: Station, side: Side, index: int) -> list[tuple[str, str]]:
    """Return each label that is asked for, with who asks."""
    asked = [(str(side.labels[0]), "the first point")]
    allowed = getattr(plan.cell.configuration, side.feature)
    if allowed != "any":
        asked.append((allowed, "the cell"))
    stated = (plan.branches or {}).get(station.name)
    if stated is not None:
        asked.append((stated[index], "the plan"))
    return asked


def _contrary(plan: Plan, scene: Scene, station: Station, side: Side, asked: tuple[str, str]) -> Iterator[Violation]:
    """Yield the sample farthest on the other side than the one asked for."""
    label, who = asked
    wrong = side.labels != label
    if wrong.any():
        k = int(np.where(wrong, np.abs(side.value), -1.0).argmax())
        note = f"{side.feature} is {side.labels[k]}, {who} says {label}"
        point, s = _place(plan, scene, k)
        joint = JOINT[side.feature]
        value = float(side.value[k])
        yield Violation("branch", station.name, point, value, 0.0, s=s, joint=joint, unit=side.unit, note=note)


def _place(plan: Plan, scene: Scene, sample: int) -> tuple[int, float]:
    """Return (point, s) of a sample."""
    return int(scene.motion.point[sample]), _on_seam(plan, float(scene.motion.s[sample]))


def _nearest(plan: Plan, s: float) -> tuple[int, float]:
    """Return (point, s) of a place that is no sample; the point is the one before it."""
    return int(np.searchsorted(plan.s, s, side="right") - 1), _on_seam(plan, s)


def _on_seam(plan: Plan, s: float) -> float:
    """Return a seam parameter less the turns of a closed seam."""
    return s % 1.0 if plan.cell.seam.closed else s
