"""The constraints of a plan, each a function that returns what breaks it; levels are exact, without margins."""

from collections.abc import Iterator

import numpy as np

from nlpweld.cell import Station
from nlpweld.geometry.seam import seam_parameters
from nlpweld.plan import Plan
from nlpweld.verify.branch import JOINT, Side, has_branches, sides
from nlpweld.verify.report import Violation
from nlpweld.verify.scene import Scene

CLOSURE = 1e-6  # [m] and [rad], at the points
SAME_S = 1e-9


def violations(plan: Plan, scene: Scene) -> list[Violation]:
    """Return everything a plan breaks, in no order and with repetitions."""
    return [
        *points(plan),
        *box(plan),
        *closure(plan, scene),
        *continuity(scene),
        *branches(plan, scene),
        *joint_limits(plan, scene),
        *singularity(plan, scene),
        *clearance(plan, scene),
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
    """The placement lies in the cell's search box."""
    for axis, value, lower, upper in zip("xyz", plan.placement_m, *plan.cell.box, strict=True):
        if not lower <= value <= upper:
            limit = lower if value < lower else upper
            # Axes are told apart like joints: one violation for each.
            yield Violation("box", None, None, float(value), float(limit), joint=axis, unit="m", note="placement")


def closure(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every TCP is where the weld asks (Pan et al., eq. 1, 2, 4, 5), at the points and between them."""
    for name, errors in scene.closure.items():
        for error, unit in zip(errors, ("m", "rad"), strict=True):
            point = int(error.argmax())
            if not error[point] <= CLOSURE:
                s = float(plan.s[point])
                yield Violation("closure", name, point, float(error[point]), CLOSURE, s=s, unit=unit)
    for gap in scene.motion.unclosed:
        point = int(np.searchsorted(plan.s, gap.s, side="right") - 1)
        note = "no configuration between the neighbours reaches the weld"
        value, unit = max((gap.position_m, "m"), (gap.rotation_rad, "rad"))
        yield Violation("closure", gap.robot, point, value, CLOSURE, s=gap.s % 1.0, unit=unit, note=note)


def continuity(scene: Scene) -> Iterator[Violation]:
    """Joint paths are continuous along the closed seam."""
    for jump in scene.motion.jumps:
        point = int(scene.motion.point[np.searchsorted(scene.motion.s, jump.s)])
        joint = f"J{jump.joint + 1}"
        note = f"moves too far between samples, however fine; {joint} moves most"
        what = (point, jump.step, jump.limit, jump.s % 1.0, joint)
        yield Violation("continuity", jump.robot, *what, unit=jump.unit, note=note)


def branches(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every arm is on the branch the cell allows and the plan states, and stays on it."""
    for station in plan.cell.stations:
        if not has_branches(station.robot):
            continue
        q, links = scene.motion.q[station.name], scene.links[station.name]
        for i, side in enumerate(sides(station, q, links)):
            for label, who in _asked(plan, station, side, i):
                yield from _contrary(scene, station, side, label, who)


def joint_limits(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every joint path, as given and not shifted by whole turns, lies within the limits."""
    for station in plan.cell.stations:
        margin = scene.joint_margin[station.name]
        worst = margin.min(axis=(0, 2))
        for joint in np.flatnonzero(~(worst >= 0)):
            k, side = np.unravel_index(margin[:, joint].argmin(), margin[:, joint].shape)
            value, limit = scene.motion.q[station.name][k, joint], station.robot.limits_rad[joint, side]
            note = f"{np.degrees(value):.2f} deg, DH direction"
            point, s = _place(scene, int(k))
            name, what = f"J{joint + 1}", (float(value), float(limit))
            yield Violation("joint_limit", station.name, point, *what, s=s, joint=name, unit="rad", note=note)


def singularity(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every robot's w stays at or above the floor: the paper's rank condition made robust."""
    floor = plan.cell.constraints.singularity_floor_m3
    for name, w in scene.w.items():
        k = int(w.argmin())
        if not w[k] >= floor:
            point, s = _place(scene, k)
            yield Violation("singularity", name, point, float(w[k]), floor, s=s, unit="m^3")


def clearance(plan: Plan, scene: Scene) -> Iterator[Violation]:
    """Every pair of bodies keeps its distance (Pan et al. ask SD_min > 0)."""
    level = plan.cell.constraints.clearance_m
    labels, owners = scene.table.pair_labels, scene.table.pair_owners
    for pair in np.flatnonzero(~(scene.clearance_m.min(axis=0) >= level)):
        k = int(scene.clearance_m[:, pair].argmin())
        point, s = _place(scene, k)
        value = float(scene.clearance_m[k, pair])
        yield Violation("clearance", owners[pair], point, value, level, s=s, pair=labels[pair], unit="m")


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


def _contrary(scene: Scene, station: Station, side: Side, label: str, who: str) -> Iterator[Violation]:
    """Yield the sample farthest on the other side than the one asked for."""
    wrong = side.labels != label
    if wrong.any():
        k = int(np.where(wrong, np.abs(side.value), -1.0).argmax())
        note = f"{side.feature} is {side.labels[k]}, {who} says {label}"
        point, s = _place(scene, k)
        joint = JOINT[side.feature]
        value = float(side.value[k])
        yield Violation("branch", station.name, point, value, 0.0, s=s, joint=joint, unit=side.unit, note=note)


def _place(scene: Scene, sample: int) -> tuple[int, float]:
    """Return (point, s) of a sample."""
    return int(scene.motion.point[sample]), float(scene.motion.s[sample] % 1.0)
