"""How fast a cell welds and moves, and where its robots wait."""

from typing import Annotated

from pydantic import Field

from nlpweld.cell.checked import Checked, Finite, Name, NonNegative, Offset, Rate, Sourced, Span


class Pace(Checked):
    """Limits of a motion along a path.

    Attributes:
        speed_m_s: of the TCP or the workpiece's origin along it.
        acceleration_m_s2: along the path.
        jerk_m_s3: along the path.
    """

    speed_m_s: Rate
    acceleration_m_s2: Rate
    jerk_m_s3: Rate


class Timing(Sourced):
    """What a plan is timed by; a cell without it can be placed, but not timed.

    Attributes:
        torch: of the torch along the seam on the workpiece: the weld's speed, held wherever no limit binds, and how it
            gets there from rest at the seam's start and end.
        travel: of straight moves off the seam: a torch between seam and stand-off, a workpiece that is carried in.
        stand_off_m: how far off the seam a torch is before it comes to it and after it leaves: back along its own axis,
            or straight up where the way home from there is not free.
        carry_m: from the placement to where a workpiece that robots carry is taken over, in W; robots bring it from
            there before they weld, and back afterwards.
        home_deg: joints of a welding robot where it waits, as its controller shows them, by station.
        blend_m: half the length of seam along which a sudden change of the weld frame's turning rate, as where a line
            meets an arc, is spread; 0 stops there instead.
    """

    torch: Pace
    travel: Pace
    stand_off_m: Span
    carry_m: tuple[Offset, Offset, Offset] = (0.0, 0.0, 0.0)
    home_deg: Annotated[dict[Name, tuple[Finite, ...]], Field(min_length=1)]
    blend_m: NonNegative = 0.0
