"""``time_plan``: a plan in, the same plan with its time axis out."""

from dataclasses import replace

import numpy as np
from pydantic import ValidationError

from nlpweld.cell.complaint import first_complaint
from nlpweld.cell.timing import Pace
from nlpweld.errors import MotionError, PlanError
from nlpweld.motion.limits import finite
from nlpweld.plan import Plan
from nlpweld.timing.cycle import Cycle
from nlpweld.timing.joints import along_seam
from nlpweld.timing.moves import joined
from nlpweld.timing.sampling import States
from nlpweld.timing.wanted import wanted
from nlpweld.verify.check import refuse_wrong
from nlpweld.verify.timing import drive_limits

STEP_S = 0.05  # between instants, at most
RESERVE = 1e-3  # of every limit is left to what quintics overshoot between instants


def time_plan(plan: Plan, speed_m_s: float | None = None, step_s: float = STEP_S) -> Plan:
    """Return a plan with its time axis.

    Torches weld at the cell's speed and slow down only where a joint's limit binds, by the law of
    :mod:`nlpweld.timing.law`. What comes before and after is told in :mod:`nlpweld.timing.cycle`. Nothing is claimed
    about the result: :func:`nlpweld.verify.verify_timing` says what it keeps.

    Args:
        plan: a plan whose cell has a [timing] table and whose robots state their drives.
        speed_m_s: of the torch along the seam, instead of the cell's; the returned plan's cell has it.
        step_s: greatest time between instants of the timeline [s].

    Raises:
        MotionError: the cell has no [timing], a robot no drives, a number is none to time by, or no way between home
            and seam is free.
        PlanError: the plan's chains do not close.
    """
    step = _above_zero(step_s, "step_s")
    if speed_m_s is not None:
        plan = _at_speed(plan, _above_zero(speed_m_s, "speed_m_s"))
    cell = plan.cell
    if cell.timing is None:
        raise MotionError(f"{cell.name}: has no [timing] table to time a plan by; add one")
    limits = np.hstack(list(drive_limits(cell).values()))
    refuse_wrong(plan)
    along = along_seam(plan, wanted(plan, cell.timing.blend_m), wanted(plan, 0.0))
    jerk = np.append(limits[2], np.inf)
    cycle = Cycle(along, cell.timing, limits * (1 - RESERVE), jerk, step)
    return plan.timed(joined(plan, _free_phases(cycle)))


def _free_phases(cycle: Cycle) -> list[tuple[str, States]]:
    """Return the phases with torches along their own axes, or else straight up; the error is that of the former."""
    try:
        return cycle.phases()
    except MotionError as first:
        try:
            return replace(cycle, upwards=True).phases()
        except (MotionError, PlanError):
            raise first from None


def _above_zero(value: float, name: str) -> float:
    number = float(finite(value, name))
    if not number > 0:
        raise MotionError(f"{name} {number:g} is not above 0; give a positive number")
    return number


def _at_speed(plan: Plan, speed_m_s: float) -> Plan:
    """Return a plan whose cell asks for another speed of the torch."""
    timing = plan.cell.timing
    if timing is None:
        return plan
    try:
        torch = Pace.model_validate({**timing.torch.model_dump(), "speed_m_s": speed_m_s})
    except ValidationError as error:
        raise MotionError(first_complaint(error, {"speed_m_s": speed_m_s})) from None
    asked = timing.model_copy(update={"torch": torch})
    return replace(plan, cell=plan.cell.model_copy(update={"timing": asked}))
