"""What the page is told of a plan, as plain data: bodies on frames, frames over the cursor, measures, verdict."""

import base64
from itertools import pairwise
from typing import Any

import numpy as np

from nlpweld.cell import Body, Cell, Robot, Station
from nlpweld.cell.task import Tee, Torch
from nlpweld.geometry.seam import weld_frames
from nlpweld.plan import joint_counts
from nlpweld.verify import Report
from nlpweld.verify import reference as ref
from nlpweld.verify.report import WHOLE
from nlpweld.view.film import Film

SEAM_POINTS = 240
TOLD = 4  # violations in the banner
ON_STICK = np.linspace(0.1, 0.9, 9)
HIDDEN_M = 1e-3  # how far a stick may stand out of a body that hides it


def content(name: str, film: Film, report: Report) -> dict[str, Any]:
    """Return everything the page needs of one plan; lengths in metres, angles in radians.

    Args:
        name: what the plan is called on the page.
        film: its frames.
        report: the verifier's, of the same plan.
    """
    plan, cell = film.plan, film.plan.cell
    names = list(film.poses)
    poses = np.stack([film.poses[frame][:, :3] for frame in names], axis=1)
    return {
        "name": name,
        "cell": cell.name,
        "title": cell.title,
        "placement_m": plan.placement_m.tolist(),
        "verdict": {"feasible": report.feasible, "violations": [str(v) for v in report.violations[:TOLD]]}
        | {"more": max(0, len(report.violations) - TOLD)},
        "objective": {"value": _number(report.objective), "name": WHOLE.get(report.reading, "MMR")}
        | {"unit": report.unit, "over_seam": report.over_seam.replace("_", " ")},
        "x": packed(film.x),
        "s": packed(film.s),
        "points": packed(plan.s),
        "welding": packed(film.welding),
        "phases": _phases(film),
        "frames": names,
        "poses": packed(poses),
        "robots": _robots(film),
        "workpiece": _workpiece(cell),
        "seams": _seams(film),
        "placement_pose": _placement(film),
        "measures": _measures(film),
    }


def packed(values: np.ndarray) -> dict[str, Any]:
    """Return an array as base64 of little-endian float32, row by row, with its shape."""
    array = np.ascontiguousarray(values, dtype="<f4")
    return {"shape": list(array.shape), "f32": base64.b64encode(array.tobytes()).decode()}


def _phases(film: Film) -> list[dict[str, Any]]:
    line = film.plan.timeline
    if not film.timed or line is None:
        return []
    spans = [(name, *line.span_s(name)) for name, _ in line.phases]
    return [{"name": name, "begin_s": begin, "end_s": end} for name, begin, end in spans if end > begin]


def _robots(film: Film) -> list[dict[str, Any]]:
    """Return the stations and the positioner, in their order."""
    cell = film.plan.cell
    robots = [_robot(st.name, st.robot, film, st) for st in cell.stations]
    return [*robots, _robot(cell.positioner.name, cell.positioner.robot, film)] if cell.positioner else robots


def _robot(name: str, robot: Robot, film: Film, station: Station | None = None) -> dict[str, Any]:
    """Return bodies of arm and tool, and sticks along the chain wherever no body shows where it goes."""
    tool = station.tool.bodies if station else ()
    flange = f"link{len(robot.joints)}"
    on = {end.frame for body in robot.bodies for end in (body.start, body.end)} | {"link0", flange}
    chain = [_end(f"{name}.link{i}") for i in range(len(robot.joints) + 1) if not robot.bodies or f"link{i}" in on]
    steps = list(pairwise(chain))
    if station:
        steps.append((_end_of(name, tool[-1].end) if tool else chain[-1], _end(f"{name}.tcp")))
    bodies = [_body(name, body, False) for body in robot.bodies] + [_body(name, body, True) for body in tool]
    sticks = [step for step in steps if not _hidden(step, bodies, film)]
    role = "turns" if station is None else "welds" if isinstance(station.coupling, Torch) else "carries"
    return {
        "name": name,
        "model": robot.title,
        "role": role,
        "tcp": f"{name}.tcp" if station else None,
        "bodies": bodies,
        "sticks": [{"start": a, "end": b} for a, b in sticks],
    }


def _end(frame: str, at_m: tuple[float, ...] = (0.0, 0.0, 0.0)) -> dict[str, Any]:
    return {"frame": frame, "at": list(at_m)}


def _end_of(name: str, end: Any) -> dict[str, Any]:
    return _end(f"{name}.{end.frame}", end.at_m)


def _body(name: str, body: Body, tool: bool) -> dict[str, Any]:
    ends = {"start": _end_of(name, body.start), "end": _end_of(name, body.end)}
    return {"label": f"{name}.{body.name}", "radius": body.radius_m, "tool": tool, **ends}


def _hidden(stick: tuple[dict[str, Any], dict[str, Any]], bodies: list[dict[str, Any]], film: Film) -> bool:
    """Tell whether a stick is too short to see, or lies within the robot's bodies in the first frame."""
    a, b = (_where(end, film) for end in stick)
    if np.linalg.norm(b - a) < HIDDEN_M:
        return True
    on = a + ON_STICK[:, None] * (b - a)
    inside = [_distance(on, _where(k["start"], film), _where(k["end"], film)) < k["radius"] + HIDDEN_M for k in bodies]
    return bool(np.any(inside, axis=0).all()) if inside else False


def _where(end: dict[str, Any], film: Film) -> np.ndarray:
    T = film.poses[end["frame"]][0]
    return T[:3, :3] @ np.array(end["at"]) + T[:3, 3]


def _distance(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return distances of points (M, 3) from the segment between a and b, shape (M,)."""
    along = b - a
    share = np.clip((p - a) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.linalg.norm(p - a - share[:, None] * along, axis=-1)


def _workpiece(cell: Cell) -> dict[str, Any]:
    work = cell.workpiece
    if isinstance(work, Tee):
        sizes = ("main_radius_m", "branch_radius_m", "main_length_m", "branch_top_m")
        return {"tee": {name: getattr(work, name) for name in sizes}, "bodies": []}
    bodies = [
        {"label": f"workpiece.{b.name}", "radius": b.radius_m, "tool": False}
        | {"start": _end("workpiece", b.start_m), "end": _end("workpiece", b.end_m)}
        for b in work.bodies
    ]
    return {"tee": None, "bodies": bodies}


def _seams(film: Film) -> list[dict[str, Any]]:
    """Return the seams that are welded, as points in C at equal steps of s, over the part that the plan covers."""
    cell = film.plan.cell
    welded = {st.coupling.seam for st in cell.stations if isinstance(st.coupling, Torch)}
    s = np.linspace(film.s[0], film.s[-1], SEAM_POINTS + 1)
    return [{"name": name, "points": packed(weld_frames(cell, s, name).p_C)} for name in cell.seams if name in welded]


def _placement(film: Film) -> list[float]:
    return [float(v) for v in ref.placement_pose(film.plan.placement)[:3].ravel()]


def _measures(film: Film) -> dict[str, Any]:
    cell = film.plan.cell
    levels = cell.constraints
    return {
        "w": {name: packed(w) for name, w in film.w.items()},
        "team": packed(film.team),
        "clearance": packed(film.clearance_m),
        "pair": packed(film.pair),
        "pairs": film.pair_labels,
        "joints": {name: packed(film.joints[name]) for name in joint_counts(cell)},
        "worst": film.worst,
        "floor_m3": levels.singularity_floor_m3,
        "clearance_m": levels.clearance_m,
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
