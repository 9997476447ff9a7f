"""Ways to change how a plan is timed."""

from dataclasses import replace
from typing import Any

from nlpweld.cell.robot import Drives
from nlpweld.plan import Plan


def with_timing(plan: Plan, **fields: Any) -> Plan:
    """Return a copy of a plan with some fields of its cell's [timing] replaced, unchecked."""
    assert plan.cell.timing is not None
    timing = plan.cell.timing.model_copy(update=fields)
    return replace(plan, cell=plan.cell.model_copy(update={"timing": timing}))


def with_drives(plan: Plan, index: int, **fields: Any) -> Plan:
    """Return a copy of a plan with some limits of one station's drives replaced."""
    stations = list(plan.cell.stations)
    robot = stations[index].robot
    assert isinstance(robot.drives, Drives)
    robot = robot.model_copy(update={"drives": robot.drives.model_copy(update=fields)})
    stations[index] = stations[index].model_copy(update={"robot": robot})
    return replace(plan, cell=plan.cell.model_copy(update={"stations": tuple(stations)}))
