"""What a simulation found, in numbers, and whether it kept its levels."""

import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from nlpweld.html_table import html_table
from nlpweld.sim.options import SimOptions
from nlpweld.sim.recording import Contact
from nlpweld.verify.report import plain

WIDTH = 79
SHOWN = 8


@dataclass(frozen=True)
class Peak:
    """The largest value of a quantity and when it was; NaN where it never was measured."""

    value: float
    at_s: float


@dataclass(frozen=True)
class TorchResult:
    """How a torch kept to its seam.

    Attributes:
        seam_m: TCP off the weld point on the workpiece as simulated, while welding.
        seam_rms_m: root mean square of it.
        plan_m: TCP off the planned one, always.
        plan_rad: the same as an angle.
    """

    seam_m: Peak
    seam_rms_m: float
    plan_m: Peak
    plan_rad: Peak


@dataclass(frozen=True)
class GraspResult:
    """How a carrier held the workpiece.

    Attributes:
        drift_m: TCP off its grasp on the workpiece as simulated.
        drift_rad: the same as an angle.
        gap_m: what the planned paths alone leave open there.
        gap_rad: the same as an angle.
        force_n: at the grasp.
        torque_nm: at the grasp.
    """

    drift_m: Peak
    drift_rad: Peak
    gap_m: Peak
    gap_rad: Peak
    force_n: Peak
    torque_nm: Peak


@dataclass(frozen=True)
class Complaint:
    """One level that was not kept.

    Attributes:
        what: ``torch``, ``drift``, ``gap``, ``force``, ``torque``, ``contact``, ``stop`` or ``diverged``.
        who: station or pair.
        at_s: when it was worst.
        value: what was found then, in ``unit``.
        limit: what it may be.
        unit: of both.
    """

    what: str
    who: str
    at_s: float
    value: float
    limit: float
    unit: str

    def __str__(self) -> str:
        """Return one line."""
        if self.what == "diverged":
            return f"diverged at {self.at_s:.3f} s: accelerations are beyond numbers; nothing after it is known"
        said = {
            "torch": "torch off its weld point",
            "drift": "grasp drifts",
            "gap": "grasp left open by the plan itself",
            "force": "force at the grasp",
            "torque": "torque at the grasp",
            "contact": "contact",
            "stop": "joint planned beyond its stop",
        }[self.what]
        scale, unit = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}.get(self.unit, (1.0, self.unit))
        numbers = f"{scale * self.value:.4g} {unit}" + (f", limit {scale * self.limit:.4g}" if self.limit else "")
        return f"{said}: {self.who} at {self.at_s:.3f} s: {numbers}"


@dataclass(frozen=True)
class SimReport:
    """Everything a simulation found.

    Attributes:
        cell: name of the cell.
        from_s: first instant of the timeline that was played.
        until_s: last one.
        torches: by name of every welding station.
        grasps: by name of every carrying station.
        squeeze_n: largest internal force between the first and the last carrier, or None.
        servo_nm: largest torque of every joint by name of station or positioner.
        servo_error_rad: largest error of every joint likewise.
        clearance_m: least distance of any pair that may not touch.
        clearance_s: when that was.
        clearance_pair: which pair.
        contacts: all, in the order they began.
        wall_s: what stepping took.
        steps: how many steps were made.
        options: what was taken for granted.
        complaints: levels not kept; none where the simulation holds.
    """

    cell: str
    from_s: float
    until_s: float
    torches: dict[str, TorchResult]
    grasps: dict[str, GraspResult]
    squeeze_n: Peak | None
    servo_nm: dict[str, tuple[float, ...]]
    servo_error_rad: dict[str, tuple[float, ...]]
    clearance_m: float
    clearance_s: float
    clearance_pair: str | None
    contacts: tuple[Contact, ...]
    wall_s: float
    steps: int
    options: SimOptions
    complaints: tuple[Complaint, ...]

    @property
    def holds(self) -> bool:
        """Whether every level was kept."""
        return not self.complaints

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON data; NaN and infinity become None."""
        told: dict[str, Any] = plain({"holds": self.holds, **asdict(self)})
        return told

    def _repr_html_(self) -> str:
        """Show in a notebook the verdict, how torches and grasps did at worst, and what was not kept."""
        rows = [
            (f"torch of {name}", f"{_mm(torch.seam_m.value)} mm off the seam") for name, torch in self.torches.items()
        ]
        for name, one in self.grasps.items():
            loads = f"{one.force_n.value:.1f} N, {one.torque_nm.value:.1f} N m"
            rows.append((f"grasp of {name}", f"drifts {_micro(one.drift_m.value)} um, {loads}"))
        rows.append(("clearance", f"{_mm(self.clearance_m)} mm, {self.clearance_pair or 'no pair'}"))
        rows.append(("contacts", str(len(self.contacts))))
        table = html_table(" ".join(self._headline()), rows)
        return table + (html_table("not kept", [(str(c),) for c in self.complaints]) if self.complaints else "")

    def __str__(self) -> str:
        """Return a small table, at most 79 columns wide."""
        lines = [*self._headline(), *self._torches(), *self._grasps(), *self._servos(), *self._distances()]
        for complaint in self.complaints[:SHOWN]:
            lines += textwrap.wrap(str(complaint), WIDTH, initial_indent="  - ", subsequent_indent="      ")
        more = len(self.complaints) - SHOWN
        return "\n".join([*lines, f"  - and {more} more"] if more > 0 else lines)

    def _headline(self) -> list[str]:
        count, numerics = len(self.complaints), self.options.numerics
        verdict = "holds" if self.holds else f"does NOT hold: {count} level{'s' * (count != 1)} missed"
        span = f"{self.from_s:.3f} to {self.until_s:.3f} s"
        how = f"{self.steps:,} steps of {1e3 * numerics.step_s:g} ms in {self.wall_s:.1f} s"
        return textwrap.wrap(f"{self.cell}, {span}, {how}: {verdict}", WIDTH)

    def _torches(self) -> list[str]:
        lines = ["  torch              off the seam [mm]             off the plan", _row("", TORCH_HEADS, TORCH_WIDTHS)]
        for name, torch in self.torches.items():
            seam, off, turned = torch.seam_m, torch.plan_m, torch.plan_rad
            cells = (_mm(seam.value), _mm(torch.seam_rms_m), _when(seam), _mm(off.value), _mm(turned.value))
            lines.append(_row(f"    {name}", cells, TORCH_WIDTHS))
        return lines

    def _grasps(self) -> list[str]:
        if not self.grasps:
            return []
        head = "  grasp              drift          as planned           force          torque"
        lines = [head, _row("", GRASP_HEADS, GRASP_WIDTHS)]
        for name, grasp in self.grasps.items():
            small = [_micro(peak.value) for peak in (grasp.drift_m, grasp.drift_rad, grasp.gap_m, grasp.gap_rad)]
            force, torque = grasp.force_n, grasp.torque_nm
            cells = (*small, f"{force.value:.1f}", _when(force), f"{torque.value:.1f}", _when(torque))
            lines.append(_row(f"    {name}", cells, GRASP_WIDTHS))
        if self.squeeze_n is not None:
            lines.append(f"    internal force   {self.squeeze_n.value:.1f} N at {_when(self.squeeze_n)} s")
        return lines

    def _servos(self) -> list[str]:
        lines = ["  servo torque [N m], largest of J1 to Jn; largest error [mrad]"]
        for name, torques in self.servo_nm.items():
            numbers = " ".join(f"{value:7.1f}" for value in torques)
            lines.append(f"    {name:<15.15}{numbers}  {1e3 * max(self.servo_error_rad[name]):9.4f}")
        return lines

    def _distances(self) -> list[str]:
        pair = "" if self.clearance_pair is None else f", {self.clearance_pair} at {self.clearance_s:.2f} s"
        lines = textwrap.wrap(f"  clearance          {_mm(self.clearance_m)} mm{pair}", WIDTH)
        if not self.contacts:
            return [*lines, "  contacts           none"]
        lines.append("  contacts           times, from and to s, deepest mm")
        for touch in deepest(self.contacts)[:SHOWN]:
            same = [other for other in self.contacts if other.pair == touch.pair]
            span = f"{same[0].from_s:.3f} to {same[-1].until_s:.3f}"
            text = f"{touch.pair}: {len(same)}, {span}, {_mm(touch.depth_m)}"
            lines += textwrap.wrap(text, WIDTH, initial_indent="    ", subsequent_indent="      ")
        return lines


TORCH_HEADS, TORCH_WIDTHS = ("max", "rms", "at s", "mm", "mrad"), (9, 10, 9, 12, 10)
GRASP_HEADS, GRASP_WIDTHS = ("um", "urad", "um", "urad", "N", "at s", "N m", "at s"), (7, 7, 9, 9, 8, 7, 7, 6)


def deepest(contacts: Sequence[Contact]) -> list[Contact]:
    """Return the deepest contact of every pair, in the order pairs first touched."""
    worst: dict[str, Contact] = {}
    for touch in contacts:
        if touch.pair not in worst or touch.depth_m > worst[touch.pair].depth_m:
            worst[touch.pair] = touch
    return list(worst.values())


def _row(name: str, cells: tuple[str, ...], widths: tuple[int, ...]) -> str:
    return f"{name:<19.19}" + "".join(f"{text:>{width}}" for text, width in zip(cells, widths, strict=True))


def _mm(value: float) -> str:
    """Return thousandths, to three digits."""
    return f"{1e3 * value:.3g}"


def _micro(value: float) -> str:
    """Return millionths, to three digits."""
    return f"{1e6 * value:.3g}"


def _when(peak: Peak) -> str:
    return f"{peak.at_s:.2f}"
