"""What a timeline has to keep, each rule a function that returns what breaks it; nothing of its maker is believed."""

from collections.abc import Iterator

import numpy as np

from nlpweld.cell import Grasp, Station
from nlpweld.cell.task import Saddle
from nlpweld.cell.timing import Timing
from nlpweld.geometry.composite import seam_breaks, seam_length_m
from nlpweld.timeline import PHASES
from nlpweld.verify import reference as ref
from nlpweld.verify.apart_in_time import Apart
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.in_time import Moving, OnSeam
from nlpweld.verify.scene import limits_rad
from nlpweld.verify.timing_report import KINDS, Failure
from nlpweld.verify.upright import posture_limit, tilt

SHARE = 1e-6  # of a limit, by which it may be exceeded
SPEED = 1e-4  # of the speed asked: it is the weld's, and no drive's
CLOSURE = 1e-6  # [m] and [rad]: of handlers, torches and postures
SMOOTHED_RAD = np.radians(5.0)  # ISO 6947: test pieces may be off their position by 5 degrees in slope
SPLINE_RAD = np.radians(1.0)  # between points, free angles may leave the straight lines of the plan by this
POINTS_RAD = 1e-3  # by which joints may be off the plan's at its points, outside blends
LEAN = np.radians(60.0)  # between a torch's axis and its straight way to the seam
STILL = 1e-9  # [rad/s] and [rad/s^2], at both ends of the cycle
UNITS = ("rad/s", "rad/s^2", "rad/s^3")


def phases(seen: Moving) -> Iterator[Failure]:
    """There is a weld, and something before and after it."""
    names = [name for name, _ in seen.timeline.phases]
    for name in PHASES:
        begin, end = seen.timeline.span_s(name)
        if name not in names or not end > begin:
            yield Failure("phases", begin, name, 0.0, 0.0, "s", note=f"there is no {name}")


def joints(seen: Moving) -> Iterator[Failure]:
    """Every joint stays within its limits."""
    for name, limits in limits_rad(seen.cell).items():
        q = seen.q[name][0]
        beyond = np.maximum(limits[:, 0] - q, q - limits[:, 1])
        for joint in np.flatnonzero(~(beyond.max(axis=0) <= STILL)):
            k = int(beyond[:, joint].argmax())
            value = float(q[k, joint])
            limit = float(limits[joint, int(value > limits[joint, 1])])
            yield Failure("joint_limit", *seen.named(k), value, limit, "rad", name, f"J{joint + 1}")


def drives(seen: Moving, limits: dict[str, np.ndarray]) -> Iterator[Failure]:
    """Rates, accelerations and jerks of every joint keep the drives' limits, by name, each of shape (3, n)."""
    for name, rows in limits.items():
        for order, (row, kind, unit) in enumerate(zip(rows, KINDS, UNITS, strict=True), start=1):
            used = np.abs(seen.q[name][order]) / row
            for joint in np.flatnonzero(~(used.max(axis=0) <= 1 + SHARE)):
                k = int(used[:, joint].argmax())
                value = float(abs(seen.q[name][order, k, joint]))
                yield Failure(kind, *seen.named(k), value, float(row[joint]), unit, name, f"J{joint + 1}")


def rigid(seen: Moving) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return by how much every robot that carries the work is off the part that the first of them holds.

    That is by station position [m] and rotation [rad], each of shape (M,).
    """
    off = {}
    for station in seen.cell.stations:
        if isinstance(station.coupling, Grasp):
            wanted = seen.T_W_C @ station.coupling.T_C_E
            off[station.name] = ref.error_size(ref.pose_error(wanted, seen.tcps[station.name]))
    return off


def closure(seen: Moving, off: dict[str, tuple[np.ndarray, np.ndarray]]) -> Iterator[Failure]:
    """Handlers are rigid to the part at every instant (Pan et al., eq. 1, 4, 5)."""
    for name, errors in off.items():
        for error, unit in zip(errors, ("m", "rad"), strict=True):
            yield from _worst(seen, "closure", error, CLOSURE, unit, name)


def carried(seen: Moving, timing: Timing) -> Iterator[Failure]:
    """A workpiece that robots carry comes in and goes along a straight line, unturned, from and to its offset."""
    if seen.cell.positioner is not None:
        return
    offset, place = np.array(timing.carry_m), np.asarray(seen.plan.placement_m)
    for name, far, near in (("approach", 0, -1), ("plunge", 0, -1), ("withdraw", -1, 0), ("retreat", -1, 0)):
        at = seen.during(name)
        if len(at) == 0:
            continue
        T = seen.T_W_C[at]
        moves = name in ("approach", "retreat")
        from_place = T[:, :3, 3] - place
        length = np.linalg.norm(offset)
        share = from_place @ offset / length**2 if length and moves else np.zeros(len(at))
        off = np.linalg.norm(from_place - np.clip(share, 0, 1)[:, None] * offset, axis=-1)
        off[far] += np.linalg.norm(from_place[far] - offset) if moves else 0.0
        off[near] += np.linalg.norm(from_place[near])
        yield from _worst(seen, "carry", off, CLOSURE, "m", "workpiece", at, phase=name)
        still = np.tile(T[near], (len(at), 1, 1))
        turned = ref.error_size(ref.pose_error(still, T))[1]
        yield from _worst(seen, "carry", turned, CLOSURE, "rad", "workpiece", at, phase=name)


def posture_off(seen: Moving, main: OnSeam, free: Offsets | None) -> np.ndarray:
    """Return how far the weld is off the posture the plan asks, shape (K,) [rad]; of carried work, the greatest error.

    Of work that robots carry also its place counts, a metre like a radian.
    """
    s, T_W_C = np.clip(main.s, 0.0, 1.0), seen.T_W_C[main.at]
    if seen.cell.positioner is None:
        wanted = ref.workpiece_pose(seen.cell, seen.plan.placement, s, free=free)
        return np.maximum(*ref.error_size(ref.pose_error(wanted, T_W_C)))
    is_, asked = tilt(seen.cell, T_W_C, s), free.at(s) if free else {}
    return np.max([np.abs(is_[name] - asked.get(name, 0.0)) for name in is_], axis=0)


def directions(
    seen: Moving, torches: dict[str, OnSeam], posture: tuple[OnSeam, np.ndarray], loose: np.ndarray
) -> Iterator[Failure]:
    """Torches and posture are as the plan asks, but for blends and what splines of free angles leave of straight lines.

    Args:
        seen: the motion.
        torches: how each follows its seam.
        posture: the main torch, and how far the weld is off (K,) [rad].
        loose: by how much either may be off, shape (K,) [rad].
    """
    for name, torch in torches.items():
        yield from _worst(seen, "torch", torch.off_rad, loose, "rad", name, torch.at)
    main, off = posture
    holder = seen.cell.positioner.name if seen.cell.positioner else "workpiece"
    yield from _worst(seen, "posture", off, loose, "rad", holder, main.at)


def allowance(seen: Moving, main: OnSeam, timing: Timing) -> np.ndarray:
    """Return how far directions may be off what the plan asks, shape (K,) [rad]: more in blends, and where freed."""
    plan, cell = seen.plan, seen.cell
    tight = posture_limit(cell) if cell.positioner is not None else CLOSURE
    tight = max(tight, SPLINE_RAD) if plan.freedom else tight
    loose = np.full(len(main.at), tight)
    for seam in cell.seams.values():
        if isinstance(seam, Saddle) or timing.blend_m == 0.0:
            continue
        half = timing.blend_m / seam_length_m(seam) + 1e-9
        for at in seam_breaks(seam):
            off = np.abs(main.s - at)
            off = np.minimum(off, 1 - off) if seam.closed else off
            loose = np.where(off <= half, np.maximum(loose, SMOOTHED_RAD), loose)
    return loose


def seam(seen: Moving, torches: dict[str, OnSeam]) -> Iterator[Failure]:
    """Every torch's weld point is on its seam, goes along it one way, and from its one end to the other."""
    for name, torch in torches.items():
        yield from _worst(seen, "seam", torch.off_m, CLOSURE, "m", name, torch.at)
        back = np.append(np.maximum.accumulate(torch.s)[:-1] - torch.s[1:], 0.0)
        yield from _worst(seen, "seam", back, CLOSURE, "", name, torch.at, "goes back along the seam")
        for k, end in ((0, 0.0), (-1, 1.0)):
            if not abs(torch.s[k] - end) <= CLOSURE:
                note = f"the weld {'begins' if k == 0 else 'ends'} elsewhere than the seam"
                yield Failure("seam", *seen.named(torch.at[k]), float(torch.s[k]), end, "", name, note=note)


def speed(seen: Moving, main: OnSeam, station: Station, asked_m_s: float) -> Iterator[Failure]:
    """The torch of the main seam is never faster than asked."""
    yield from _worst(seen, "speed", main.speed_m_s, asked_m_s * (1 + SPEED), "m/s", station.name, main.at)


def points(seen: Moving, main: OnSeam, loose: np.ndarray) -> Iterator[Failure]:
    """All of the plan's joints are met at its points, unless a blend is there."""
    plan = seen.plan
    order = np.argsort(main.s, kind="stable")
    when = np.interp(plan.s, main.s[order], seen.t_s[main.at][order])
    blended = np.interp(plan.s, main.s[order], loose[order]) >= SMOOTHED_RAD
    for name, q in seen.timeline.at(when).items():
        off = np.where(blended, 0.0, np.abs(q - plan.paths[name]).max(axis=1))
        k = int(off.argmax())
        if not off[k] <= POINTS_RAD:
            note = f"point {k} of the plan is passed on other joints"
            yield Failure("points", float(when[k]), "weld", float(off[k]), POINTS_RAD, "rad", name, note=note)


def home(seen: Moving, timing: Timing) -> Iterator[Failure]:
    """Torches wait at home before and after."""
    for station in seen.cell.stations:
        if station.name in timing.home_deg:
            signs = np.array([joint.sign for joint in station.robot.joints])
            at = np.radians(signs * np.array(timing.home_deg[station.name]))
            for k in (0, len(seen.t_s) - 1):
                off = np.abs(seen.q[station.name][0, k] - at)
                if not off.max() <= CLOSURE:
                    joint = f"J{off.argmax() + 1}"
                    yield Failure("home", *seen.named(k), float(off.max()), CLOSURE, "rad", station.name, joint)
    if seen.cell.positioner is not None:
        name = seen.cell.positioner.name
        back = np.abs(seen.q[name][0, -1] - seen.q[name][0, 0])
        if not back.max() <= CLOSURE:
            joint = f"J{back.argmax() + 1}"
            yield Failure("home", *seen.named(len(seen.t_s) - 1), float(back.max()), CLOSURE, "rad", name, joint)


def rest(seen: Moving) -> Iterator[Failure]:
    """Everything rests at both ends of the cycle."""
    for name, q in seen.q.items():
        for k in (0, -1):
            moves = np.abs(q[1:3, k]).max(axis=0)
            if not moves.max() <= STILL:
                at = k % len(seen.t_s)
                joint = f"J{moves.argmax() + 1}"
                yield Failure("rest", *seen.named(at), float(moves.max()), STILL, "", name, joint)


def axis(seen: Moving, torches: dict[str, OnSeam]) -> Iterator[Failure]:
    """Torches come to the seam and leave it in a straight line, not turned, and within a lean of their own axes."""
    for name in torches:
        for phase, end in (("plunge", -1), ("withdraw", 0)):
            at = seen.during(phase)
            if len(at):
                T = seen.tcps[name][at]
                way, z = T[:, :3, 3] - T[end, :3, 3], T[end, :3, 2]
                line = way[-1 - end] / np.linalg.norm(way[-1 - end])
                aside = np.linalg.norm(way - (way @ line)[:, None] * line, axis=-1) + np.maximum(-way @ line, 0.0)
                lean = np.full(len(at), np.arccos(np.clip(-line @ z, -1.0, 1.0)))
                yield from _worst(seen, "axis", lean, LEAN, "rad", name, at, phase=phase)
                turned = ref.error_size(ref.pose_error(np.tile(T[end], (len(at), 1, 1)), T))[1]
                yield from _worst(seen, "axis", aside, CLOSURE, "m", name, at, phase=phase)
                yield from _worst(seen, "axis", turned, CLOSURE, "rad", name, at, phase=phase)


def clearance(seen: Moving, near: Apart) -> Iterator[Failure]:
    """Every pair of bodies keeps its distance in every phase."""
    level = seen.cell.constraints.clearance_m
    for name, _ in seen.timeline.phases:
        least, pair, when = near.nearest(*seen.timeline.span_s(name))
        if not least >= level - CLOSURE * (name == "weld"):
            yield Failure("clearance", when, name, least, level, "m", pair=pair)


def _worst(
    seen: Moving,
    check: str,
    value: np.ndarray,
    limit: np.ndarray | float,
    unit: str,
    robot: str,
    at: np.ndarray | None = None,
    note: str = "",
    phase: str = "",
) -> Iterator[Failure]:
    """Yield the sample that exceeds its limit most, if one does; a phase's ends belong to two."""
    bound = np.broadcast_to(limit, value.shape)
    over = np.where(np.isfinite(value), value - bound, np.inf)
    k = int(over.argmax())
    if over[k] > 0:
        sample = k if at is None else int(at[k])
        when, during = seen.named(sample)
        yield Failure(check, when, phase or during, float(value[k]), float(bound[k]), unit, robot, note=note)
