"""Readers of what is exported, written apart from the writers: every text to times and joints in DH direction."""

import csv
import json
import re
import tomllib
from collections.abc import Callable

import numpy as np
import yaml

from nlpweld.cell.files import LIBRARY
from nlpweld.plan import Plan
from nlpweld.timeline import Track
from tests.export.timed import splined

Read = tuple[np.ndarray, dict[str, Track]]
KINDS = ("deg", "deg_s", "deg_s2")
FIELDS = ("positions", "velocities", "accelerations")
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the quicker of the two, where it is built in


def signs(plan: Plan) -> dict[str, list[int]]:
    """Return which way every joint counts, from the robot files themselves, by station or positioner."""
    robots = {station.name: f"robots/{station.robot.name}" for station in plan.cell.stations}
    if plan.cell.positioner:
        robots[plan.cell.positioner.name] = f"positioners/{plan.cell.positioner.robot.name}"
    files = {name: tomllib.loads((LIBRARY / f"{path}.toml").read_text()) for name, path in robots.items()}
    return {name: [joint.get("sign", 1) for joint in file["joints"]] for name, file in files.items()}


def read_csv(files: dict[str, str], plan: Plan) -> Read:
    rows = list(csv.DictReader(files["joints.csv"].splitlines()))
    tracks = {}
    for name, sign in signs(plan).items():
        joints = range(1, len(sign) + 1)
        values = [[[float(row[f"{name}.j{k}_{kind}"]) for k in joints] for row in rows] for kind in KINDS]
        tracks[name] = Track(*(sign * np.radians(x) for x in values))
    return np.array([float(row["t_s"]) for row in rows]), tracks


def read_messages(files: dict[str, str], plan: Plan, parse: Callable[[str], dict], ending: str) -> Read:
    tracks, clocks = {}, []
    for name, sign in signs(plan).items():
        message = parse(files[f"{name}.{ending}"])
        assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
        assert message["joint_names"] == [f"{name}_joint_{k}" for k in range(1, len(sign) + 1)]
        points = message["points"]
        assert all(set(point) == {*FIELDS, "effort", "time_from_start"} for point in points)
        tracks[name] = Track(*(sign * np.array([point[field] for point in points]) for field in FIELDS))
        clocks.append([(p["time_from_start"]["sec"], p["time_from_start"]["nanosec"]) for p in points])
    assert all(clock == clocks[0] for clock in clocks)
    assert all(type(sec) is int and type(nano) is int and 0 <= nano < 10**9 for sec, nano in clocks[0])
    return np.array([sec + 1e-9 * nano for sec, nano in clocks[0]]), tracks


def read_yaml(files: dict[str, str], plan: Plan) -> Read:
    return read_messages(files, plan, lambda text: yaml.load(text, LOADER), "yaml")


def read_json(files: dict[str, str], plan: Plan) -> Read:
    return read_messages(files, plan, json.loads, "json")


def read_rapid(files: dict[str, str], plan: Plan) -> Read:
    """Return the joints of MoveAbsJ and the sums of their times, which are the same in every module."""
    axes, outer, clocks = {}, {}, []
    for station, text in zip(plan.cell.stations, files.values(), strict=True):
        moves = re.findall(r"^ +MoveAbsJ \[\[([^\]]*)\],\[([^\]]*)\]\]\S*?(?:\\T:=([\d.]+))?,\w+,tool0;$", text, re.M)
        assert len(moves) == text.count("MoveAbsJ")
        axes[station.name] = np.array([[float(x) for x in robot.split(",")] for robot, _, _ in moves])
        outer[station.name] = [[float(x) for x in external.split(",")] for _, external, _ in moves]
        clocks.append(np.cumsum([float(t or 0) for _, _, t in moves]))
    assert all((clock == clocks[0]).all() for clock in clocks)
    return clocks[0], _with_outer(plan, axes, outer, clocks[0])


def read_krl(files: dict[str, str], plan: Plan) -> Read:
    """Return the points of the data lists in the order of the splines, at the sums of their parts."""
    axes, outer, clocks = {}, {}, []
    modules = list(dict.fromkeys(name.rpartition(".")[0] for name in files))
    for station, module in zip(plan.cell.stations, modules, strict=True):
        points = dict(re.findall(r"^P\[(\d+)\]=\{(.*)\}$", files[f"{module}.dat"], re.M))
        program = files[f"{module}.src"]
        order = re.findall(r"^ +S?PTP P\[(\d+)\]$", program, re.M)
        assert order == list(points)
        assert f"DECL E6AXIS P[{len(points)}]" in files[f"{module}.dat"]
        named = [dict(axis.split(" ") for axis in points[number].split(",")) for number in order]
        axes[station.name] = np.array([[float(point[f"A{k}"]) for k in range(1, 7)] for point in named])
        outer[station.name] = [[float(point.get(f"E{k}", 9e9)) for k in range(1, 7)] for point in named]
        clocks.append(np.cumsum([0.0, *(float(x) for x in re.findall(r"TIME_BLOCK PART=([\d.]+)", program))]))
    assert all((clock == clocks[0]).all() for clock in clocks)
    return clocks[0], _with_outer(plan, axes, outer, clocks[0])


def _with_outer(plan: Plan, axes: dict[str, np.ndarray], outer: dict[str, list], t_s: np.ndarray) -> dict[str, Track]:
    """Return tracks; the first robot's external axes are the positioner's, and nobody else has any."""
    found = dict(axes)
    for k, (name, values) in enumerate(outer.items()):
        used = len(plan.cell.positioner.robot.joints) if plan.cell.positioner and k == 0 else 0
        values = np.array(values)
        assert (values[:, used:] == 9e9).all(), name
        if used:
            found[plan.cell.positioner.name] = values[:, :used]
    sign = signs(plan)
    return {name: splined(t_s, np.radians(q) * sign[name]) for name, q in found.items()}


READERS = {"csv": read_csv, "ros2": read_yaml, "ros2-json": read_json, "rapid": read_rapid, "krl": read_krl}
