"""Ways to change a cell and to spoil a plan."""

import dataclasses
from typing import Any

import numpy as np

from nlpweld.cell import Cell
from nlpweld.plan import Plan
from nlpweld.verify.report import Report, Violation

ROBOTS = ("handler_1", "handler_2", "welder")
BRANCH = dict.fromkeys(ROBOTS, ("front", "up", "noflip"))


def changed(plan: Plan, **fields: Any) -> Plan:
    """Return a copy of a plan with some fields replaced."""
    return dataclasses.replace(plan, **fields)


def with_path(plan: Plan, name: str, path: np.ndarray) -> Plan:
    """Return a copy of a plan with one robot's path replaced."""
    return changed(plan, paths={**plan.paths, name: path})


def cell_with(cell: Cell, **tables: dict[str, Any]) -> Cell:
    """Return a copy of a cell with some fields of some tables replaced, unchecked."""
    return cell.model_copy(update={t: getattr(cell, t).model_copy(update=fields) for t, fields in tables.items()})


def with_limits(cell: Cell, name: str, joint: int, **limits: float) -> Cell:
    """Return a copy of a cell with other limits [deg, as the controller counts] of one joint of one robot."""
    stations = []
    for station in cell.stations:
        if station.name == name:
            joints = list(station.robot.joints)
            joints[joint] = joints[joint].model_copy(update=limits)
            robot = station.robot.model_copy(update={"joints": tuple(joints)})
            station = station.model_copy(update={"robot": robot})
        stations.append(station)
    return cell.model_copy(update={"stations": tuple(stations)})


def without_freedom(plan: Plan) -> Plan:
    """Return a copy of a plan whose cell has no [freedom] table."""
    return changed(plan, cell=plan.cell.model_copy(update={"freedom": None}))


def station_with(cell: Cell, index: int, **fields: Any) -> Cell:
    """Return a copy of a cell with some fields of the coupling of one robot replaced, unchecked."""
    stations = list(cell.stations)
    coupling = stations[index].coupling.model_copy(update=fields)
    stations[index] = stations[index].model_copy(update={"coupling": coupling})
    return cell.model_copy(update={"stations": tuple(stations)})


def turned_about(cell: Cell, origin: np.ndarray, yaw: float) -> Cell:
    """Return a copy of a cell with its robots and their headings turned about a vertical line, any yaw allowed."""
    c, s = np.cos(yaw), np.sin(yaw)
    R, stations = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), []
    for station in cell.stations:
        base = origin + R @ (np.array(station.base_position_m) - origin)
        roll, pitch, old = station.base_rpy_deg
        rpy, coupling = (roll, pitch, old + np.degrees(yaw)), station.coupling
        if getattr(coupling, "heading_deg", None) is not None:
            coupling = coupling.model_copy(update={"heading_deg": coupling.heading_deg + np.degrees(yaw)})
        moved = {"base_position_m": tuple(base), "base_rpy_deg": rpy, "coupling": coupling}
        stations.append(station.model_copy(update=moved))
    turned = cell.model_copy(update={"stations": tuple(stations)})
    return cell_with(turned, search={"yaw_deg": (-180.0, 180.0)})


def found(report: Report, constraint: str) -> list[Violation]:
    assert not report.feasible
    return [v for v in report.violations if v.constraint == constraint]


def only(report: Report, constraint: str) -> list[Violation]:
    assert {v.constraint for v in report.violations} == {constraint}, str(report)
    return found(report, constraint)
