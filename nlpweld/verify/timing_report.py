"""What the checker found about a timed plan: how long it takes, what it uses of every limit, and what it breaks."""

import math
import textwrap
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from nlpweld.html_table import html_table
from nlpweld.verify.report import plain

WIDTH = 79
SHOWN = 8
REACHED = 1e-4  # of the speed asked, by which a speed that counts as reached may fall short
KINDS = ("rate", "acceleration", "jerk")


@dataclass(frozen=True)
class Failure:
    """Something a timed plan breaks, at its worst instant.

    Attributes:
        check: ``joint_limit``, ``rate``, ``acceleration``, ``jerk``, ``closure``, ``carry``, ``seam``, ``torch``,
            ``posture``, ``speed``, ``clearance``, ``points``, ``home``, ``rest``, ``phases`` or ``axis``.
        t_s: when [s].
        phase: in which phase.
        value: what was found, in ``unit``.
        limit: what it may be.
        unit: of both.
        robot: station or positioner, where one is to blame.
        joint: ``J1`` to ``Jn``.
        pair: two bodies.
        note: what the numbers alone do not say.
    """

    check: str
    t_s: float
    phase: str
    value: float
    limit: float
    unit: str = ""
    robot: str | None = None
    joint: str | None = None
    pair: str | None = None
    note: str = ""

    def __str__(self) -> str:
        """Return one line: what, who, when, by how much."""
        who = " ".join(part for part in (self.pair or self.robot, self.joint) if part)
        unit = f" {self.unit}" if self.unit else ""
        text = f"{self.check} {who}".rstrip() + f" at {self.t_s:.3f} s ({self.phase}): "
        return f"{text}{self.value:.6g}{unit}, limit {self.limit:.6g}{'; ' + self.note if self.note else ''}"


@dataclass(frozen=True)
class Use:
    """How much of which limit is used, over a while or at most.

    Attributes:
        begin_s: from when [s].
        end_s: until when [s]; the same for an instant.
        robot: station or positioner.
        joint: ``J1`` to ``Jn``.
        kind: ``rate``, ``acceleration`` or ``jerk``.
        used: the greatest share of the limit in that while; 1 is all of it.
    """

    begin_s: float
    end_s: float
    robot: str
    joint: str
    kind: str
    used: float


@dataclass(frozen=True)
class Slowed:
    """A stretch of the seam on which the torch is slower than asked, besides the ramps at both ends.

    Attributes:
        begin_s: from when [s].
        end_s: until when [s].
        s: seam parameters at both.
        least_m_s: the least speed on it [m/s].
        use: the limit most used on it.
    """

    begin_s: float
    end_s: float
    s: tuple[float, float]
    least_m_s: float
    use: Use


@dataclass(frozen=True)
class Nearest:
    """The least distance of any two bodies in a phase."""

    phase: str
    distance_m: float
    pair: str
    t_s: float


@dataclass(frozen=True, eq=False)
class TimingReport:
    """Everything the checker found out about the time axis of a plan, from the timeline alone.

    Attributes:
        cell: name of the cell.
        cycle_s: how long everything takes [s].
        arc_on_s: how long torches weld [s].
        phases: name, begin and end of each [s].
        speed_m_s: what the cell asks of the torch along the seam.
        fastest_m_s: greatest speed of the main seam's torch while it welds.
        slowed: where it is slower.
        most: the greatest use of each kind of limit.
        nearest_limit: which joint is nearest to which limit, while after while.
        windings: by name, how many whole turns each joint is turned on by welding a closed seam.
        left: the same at the end of the cycle: what has still to be unwound, once the part is released.
        closure_m: how far handlers' TCPs are from rigid to the part.
        closure_rad: the same as an angle.
        seam_m: how far weld points are from their seams.
        torch_rad: greatest angle of a torch off what the plan asks, outside blends.
        posture_rad: the same of the weld's posture.
        blended_rad: greatest angle of torch or posture off what the plan asks, in blends and by free angles' splines.
        clearance: the nearest bodies of each phase.
        samples: instants looked at.
        failures: what is broken, in the order of the checks.
        torch_speed: instants [s] and speeds [m/s] of the main seam's torch while it welds, shape (2, K).
    """

    cell: str
    cycle_s: float
    arc_on_s: float
    phases: tuple[tuple[str, float, float], ...]
    speed_m_s: float
    fastest_m_s: float
    slowed: tuple[Slowed, ...]
    most: tuple[Use, ...]
    nearest_limit: tuple[Use, ...] = field(repr=False)
    windings: dict[str, tuple[int, ...]]
    left: dict[str, tuple[int, ...]]
    closure_m: float
    closure_rad: float
    seam_m: float
    torch_rad: float
    posture_rad: float
    blended_rad: float
    clearance: tuple[Nearest, ...]
    samples: int
    failures: tuple[Failure, ...]
    torch_speed: np.ndarray = field(repr=False, default_factory=lambda: np.empty((2, 0)))

    @property
    def feasible(self) -> bool:
        """Whether nothing is broken."""
        return not self.failures

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON data, without the array; NaN and infinity become None."""
        told = {name: value for name, value in asdict(self).items() if name != "torch_speed"}
        return {**plain(told), "feasible": self.feasible}

    def _repr_html_(self) -> str:
        """Show in a notebook the verdict, when what goes on, what is nearest then, and what is broken."""
        near = {one.phase: f"{1e3 * one.distance_m:.1f} mm, {one.pair}" for one in self.clearance}
        rows = [(name, f"{begin:.3f}", f"{end:.3f}", near.get(name, "")) for name, begin, end in self.phases]
        verdict = "verified" if self.feasible else "NOT verified"
        title = f"{self.cell}: cycle {self.cycle_s:.3f} s, arc on {self.arc_on_s:.3f} s; {verdict}"
        table = html_table(title, rows, ("phase", "from [s]", "to [s]", "nearest bodies"))
        return table + (html_table("failures", [(str(f),) for f in self.failures]) if self.failures else "")

    def __str__(self) -> str:
        """Return a small table, at most 80 columns wide."""
        count = len(self.failures)
        verdict = "verified" if self.feasible else f"NOT verified: {count} failure{'s' * (count != 1)}"
        lines = [f"{self.cell}: cycle {self.cycle_s:.3f} s, arc on {self.arc_on_s:.3f} s; {verdict}"]
        lines.append("  phase      from [s]    to [s]  nearest bodies")
        near = {one.phase: one for one in self.clearance}
        for name, begin, end in self.phases:
            told = f"{1e3 * near[name].distance_m:.1f} mm, {near[name].pair}" if name in near else ""
            lines += textwrap.wrap(f"  {name:<9} {begin:9.3f} {end:9.3f}  {told}", WIDTH, subsequent_indent=" " * 33)
        lines += [*self._speed(), *self._limits(), *self._windings()]
        rigid = f"{self.closure_m:.1e} m, {self.closure_rad:.1e} rad"
        lines.append(f"  rigid handlers    {rigid}; torch off its seam {self.seam_m:.1e} m")
        off = f"torch {self.torch_rad:.1e} rad, posture {self.posture_rad:.1e} rad"
        lines.append(f"  off what is asked {off}; {math.degrees(self.blended_rad):.3f} deg in blends")
        lines.append(f"  {self.samples} instants looked at")
        for failure in self.failures[:SHOWN]:
            lines += textwrap.wrap(str(failure), WIDTH, initial_indent="  - ", subsequent_indent="      ")
        more = count - SHOWN
        return "\n".join([*lines, f"  - and {more} more"] if more > 0 else lines)

    def _speed(self) -> list[str]:
        text = f"  torch speed       {1e3 * self.speed_m_s:.3g} mm/s asked, {1e3 * self.fastest_m_s:.4g} mm/s at most"
        reached = self.fastest_m_s >= self.speed_m_s * (1 - REACHED)
        lines = [text + ("" if self.slowed else ", slowed nowhere" if reached else ": never reached")]
        for one in self.slowed[:SHOWN]:
            use = f"{one.use.robot} {one.use.joint} {one.use.kind} {100 * one.use.used:.1f} %"
            where = f"s {one.s[0]:.4f} to {one.s[1]:.4f} ({one.begin_s:.2f} to {one.end_s:.2f} s)"
            text = f"    slowed to {1e3 * one.least_m_s:.4g} mm/s, {where}: {use}"
            lines += textwrap.wrap(text, WIDTH, subsequent_indent=" " * 6)
        more = len(self.slowed) - SHOWN
        return [*lines, f"    and {more} more"] if more > 0 else lines

    def _limits(self) -> list[str]:
        told = (f"{use.kind} {100 * use.used:.1f} % ({use.robot} {use.joint})" for use in self.most)
        lines = textwrap.wrap("  most used         " + ", ".join(told), WIDTH, subsequent_indent=" " * 20)
        lines.append("  nearest its limit")
        longest = sorted(self.nearest_limit, key=lambda use: use.begin_s - use.end_s)[:SHOWN]
        for use in sorted(longest, key=lambda use: use.begin_s):
            joint = f"{use.robot} {use.joint} {use.kind}"
            lines.append(f"    {use.begin_s:9.3f} to {use.end_s:9.3f} s  {joint:<32} {100 * use.used:6.2f} %")
        more = len(self.nearest_limit) - SHOWN
        return [*lines, f"    and {more} shorter whiles"] if more > 0 else lines

    def _windings(self) -> list[str]:
        lines = []
        wound, left = (_turns(which) for which in (self.windings, self.left))
        if wound:
            lines += textwrap.wrap(f"  turned by the weld {wound}", WIDTH, subsequent_indent=" " * 21)
        if left:
            text = f"  left to unwind     {left}, once the part is released"
            lines += textwrap.wrap(text, WIDTH, subsequent_indent=" " * 21)
        return lines


def _turns(which: dict[str, tuple[int, ...]]) -> str:
    """Return whole turns as text, those of joints that made none left out."""
    rows = ((name, k, turns) for name, row in which.items() for k, turns in enumerate(row, start=1))
    return ", ".join(f"{name} J{k} {turns:+d}" for name, k, turns in rows if turns)
