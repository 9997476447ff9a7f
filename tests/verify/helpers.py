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


def found(report: Report, constraint: str) -> list[Violation]:
    assert not report.feasible
    return [v for v in report.violations if v.constraint == constraint]


def only(report: Report, constraint: str) -> list[Violation]:
    assert {v.constraint for v in report.violations} == {constraint}, str(report)
    return found(report, constraint)
