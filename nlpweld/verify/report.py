"""What the checker found: every number of a plan, and what it breaks by how much and where."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from nlpweld.cell import Cell
from nlpweld.html_table import html_table
from nlpweld.verify.worst_case import WorstCase

# An excess of this size [in the constraint's own unit] counts as equally bad; constraints not named come first.
SCALE = {
    ("box", "m"): 0.05,
    ("box", "rad"): 0.1,
    ("closure", "m"): 1e-3,
    ("closure", "rad"): 1e-3,
    ("posture", "rad"): 0.01,
    ("continuity", "rad"): 0.1,
    ("continuity", "m"): 0.01,
    ("branch", "m"): 0.1,
    ("branch", ""): 0.1,
    ("joint_limit", "rad"): 0.1,
    ("singularity", "m^3"): 0.02,
    ("clearance", "m"): 0.02,
    ("freedom", "rad"): 0.1,
    ("joint_step", "rad"): 0.1,
}
WHOLE = {"product": "product of w", "mean": "mean of w"}  # objectives that are no MMR
SHOWN = 8
WIDTH = 79


@dataclass(frozen=True)
class Violation:
    """One broken constraint, at the worst place.

    Attributes:
        constraint: ``finite``, ``points``, ``box``, ``closure``, ``posture``, ``continuity``, ``branch``,
            ``joint_limit``, ``singularity``, ``clearance``, ``freedom``, ``joint_step`` or ``reach``.
        robot: name of a station (of the first body of a pair) or of the positioner, ``workpiece``, or None where no
            robot is to blame.
        point: index of the plan's point at or before the place, or None.
        value: what was found, in ``unit``.
        limit: what it may be at most or at least.
        s: seam parameter of the place.
        joint: ``J1`` to ``Jn``, or the axis of a placement, ``x``, ``y``, ``z`` or ``yaw``, or
            a free angle, ``yaw``, ``slope``, ``rotation``, ``spin``, ``travel`` or ``work``.
        pair: the two bodies.
        unit: of value and limit.
        note: what the numbers alone do not say.
    """

    constraint: str
    robot: str | None
    point: int | None
    value: float
    limit: float
    s: float | None = None
    joint: str | None = None
    pair: str | None = None
    unit: str = ""
    note: str = ""

    @property
    def severity(self) -> float:
        """Excess over the limit in units of ``SCALE``; infinite for what has no scale or no number."""
        scale = SCALE.get((self.constraint, self.unit))
        excess = abs(self.value - self.limit)
        return excess / scale if scale and math.isfinite(excess) else math.inf

    @property
    def key(self) -> tuple[str, ...]:
        """Violations with the same key are one, told once."""
        return (self.constraint, self.pair or self.robot or "", self.joint or "", self.unit)

    def __str__(self) -> str:
        """Return one line: what, who, where, by how much."""
        who = " ".join(part for part in (self.pair or self.robot, self.joint) if part)
        where = "" if self.point is None else f" at point {self.point}"
        where += "" if self.s is None else f" (s {self.s:.4f})"
        unit = f" {self.unit}" if self.unit else ""
        numbers = f": {self.value:.6g}{unit}, limit {self.limit:.6g}" if math.isfinite(self.value) else ""
        return f"{self.constraint} {who}{where}{numbers}{'; ' + self.note if self.note else ''}"


@dataclass(frozen=True, eq=False)
class Report:
    """Everything the checker found out about one plan or placement.

    ``objective``, ``*_mean``, ``mmr_min``, ``mmr_max``, ``manipulability_min`` and ``clearance_m`` are over the N
    points of the seam; ``mmr_min_along`` is the least along the whole of it.
    ``clearance_along_m``, ``joint_margin_rad``, ``posture_rad`` and ``singularity_min`` are over the whole seam,
    between the points too; these decide.

    Attributes:
        cell: name of the cell.
        at: placement of the origin of {P} in W [m]: of C where robots carry the workpiece.
        yaw_rad: turn of {P} about z_W [rad].
        n_points: number of points N.
        reading: the reading of Pan et al., eq. (16), that MMR has, or ``product`` or ``mean`` of all robots' w.
        over_seam: what the cell maximises over the seam: ``mean``, ``minimum`` or ``soft_minimum`` of the N points.
        exponent: of the soft minimum (see :class:`~nlpweld.cell.levels.Objective`), else None.
        objective: the value of that; its unit is that of MMR.
        mmr_mean: mean of the N points; its unit depends on the reading ("paper" adds m^6 to m^3).
        mmr_min: least of the N points.
        mmr_max: greatest of the N points.
        mmr_min_along: least along the whole seam, between the points too.
        m_tight_mean: mean product of the tight robots' w (eq. 15) [m^3 for each]; NaN where there are none.
        m_loose_mean: mean product of the loose robots' w [m^3 for each].
        manipulability_mean: by station name [m^3].
        manipulability_min: by station name [m^3].
        singularity_min: by station name [m^3].
        clearance_m: least distance of any pair; negative is penetration.
        clearance_along_m: the same along the whole seam.
        closest_pair: the two bodies of that pair.
        closest_s: where on the seam.
        joint_margin_rad: least distance of any joint, the positioner's too, from a limit; negative is beyond.
        joint_step_rad: farthest any robot's joint turns from one point to the next, a closed seam's way back included;
            the positioner's too where the plan tilts the weld.
        closure_m: largest position error of any TCP at the points.
        closure_rad: largest rotation error of any TCP at the points.
        posture_rad: how far the positioner is from holding the weld upright, or tilted as the plan says; 0 without one.
        samples: number of configurations looked at.
        feasible: no violation.
        violations: worst first, one for each constraint, robot or pair, and joint.
        profile: arrays over the N points, by name; those of a robot as ``name.station``.
        worst_case: the same under errors of the set-up, where they were asked for; they then count for ``feasible``.
    """

    cell: str
    at: tuple[float, float, float]
    yaw_rad: float
    n_points: int
    reading: str
    over_seam: str
    exponent: float | None
    objective: float
    mmr_mean: float
    mmr_min: float
    mmr_max: float
    mmr_min_along: float
    m_tight_mean: float
    m_loose_mean: float
    manipulability_mean: dict[str, float]
    manipulability_min: dict[str, float]
    singularity_min: dict[str, float]
    clearance_m: float
    clearance_along_m: float
    closest_pair: str | None
    closest_s: float | None
    joint_margin_rad: float
    joint_step_rad: float
    closure_m: float
    closure_rad: float
    posture_rad: float
    samples: int
    feasible: bool
    violations: tuple[Violation, ...]
    profile: dict[str, np.ndarray] = field(default_factory=dict, repr=False)
    worst_case: WorstCase | None = None

    @classmethod
    def without_plan(
        cls,
        cell: Cell,
        at: Sequence[float] | np.ndarray,
        n_points: int,
        violations: list[Violation] | tuple[Violation, ...],
    ) -> "Report":
        """Return the report of a placement for which there is no plan to measure; its numbers are NaN.

        Args:
            cell: the cell.
            at: placement of {P} in W, x, y, z [m] and, if given, yaw [rad].
            n_points: number of seam points asked for.
            violations: why there is no plan, e.g. :func:`unreachable`; never feasible, even if empty.
        """
        nan = math.nan
        x, y, z, yaw = (float(value) for value in (*at, 0.0)[:4])
        each = {station.name: nan for station in cell.stations}
        return cls(
            cell=cell.name, at=(x, y, z), yaw_rad=yaw, n_points=n_points, reading=cell.objective.reading,
            over_seam=cell.objective.over_seam, exponent=cell.objective.exponent, objective=nan,
            mmr_mean=nan, mmr_min=nan, mmr_max=nan, mmr_min_along=nan, m_tight_mean=nan, m_loose_mean=nan,
            manipulability_mean=each, manipulability_min=dict(each), singularity_min=dict(each),
            clearance_m=nan, clearance_along_m=nan, closest_pair=None, closest_s=None,
            joint_margin_rad=nan, joint_step_rad=nan, closure_m=nan, closure_rad=nan,
            posture_rad=nan if cell.positioner else 0.0,
            samples=0, feasible=False, violations=worst_first(violations),
        )  # fmt: skip

    def to_json(self, profile: bool = False) -> dict[str, Any]:
        """Return plain JSON data; NaN and infinity become None.

        Args:
            profile: whether to include the arrays over the points.
        """
        shallow = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "profile"}
        shallow["violations"] = [asdict(v) for v in self.violations]
        shallow["worst_case"] = self.worst_case and asdict(self.worst_case)
        if profile:
            shallow["profile"] = {name: array.tolist() for name, array in self.profile.items()}
        return {name: plain(value) for name, value in shallow.items()}

    def __str__(self) -> str:
        """Return a small table, at most 80 columns wide."""
        lines = [*self._headline(), *self._numbers(), *(self.worst_case.lines() if self.worst_case else ())]
        for violation in self.violations[:SHOWN]:
            lines += textwrap.wrap(str(violation), WIDTH, initial_indent="  - ", subsequent_indent="      ")
        more = len(self.violations) - SHOWN
        return "\n".join([*lines, f"  - and {more} more"] if more > 0 else lines)

    def _repr_html_(self) -> str:
        """Show in a notebook the verdict, what was measured, and what is broken."""
        label = f"{WHOLE.get(self.reading, f'MMR ({self.reading})')} {self.unit}"
        rows = [(label, self.mmr_mean, self.mmr_min, self.mmr_min_along)]
        for name, mean in self.manipulability_mean.items():
            rows.append((f"w of {name} [m^3]", mean, self.manipulability_min[name], self.singularity_min[name]))
        rows.append(("clearance [mm]", math.nan, 1e3 * self.clearance_m, 1e3 * self.clearance_along_m))
        rows.append(("joint margin [deg]", math.nan, math.nan, math.degrees(self.joint_margin_rad)))
        shown = [(row[0], *("" if math.isnan(x) else f"{x:.6g}" for x in row[1:])) for row in rows]
        table = html_table(" ".join(self._headline()), shown, ("", "mean", "least at points", "along the seam"))
        return table + (html_table("violations", [(str(v),) for v in self.violations]) if self.violations else "")

    def _headline(self) -> list[str]:
        at = ", ".join(f"{x:.4g}" for x in self.at)
        yaw = f", yaw {math.degrees(self.yaw_rad):.4g} deg" if self.yaw_rad else ""
        count = len(self.violations)
        verdict = "feasible" if self.feasible else f"NOT feasible: {count} violation{'s' * (count != 1)}"
        return textwrap.wrap(f"{self.cell} at ({at}) m{yaw}, {self.n_points} points: {verdict}", WIDTH)

    def _numbers(self) -> list[str]:
        if not self.samples:
            return ["  no plan to measure"]
        lines = [*self._objective(), "  w [m^3]           mean       least at points   along the seam"]
        for name, mean in self.manipulability_mean.items():
            least, along = self.manipulability_min[name], self.singularity_min[name]
            lines.append(f"    {name:<15.15} {mean:<10.6f} {least:<17.6f} {along:.6f}")
        pair = "" if self.closest_pair is None else f", {self.closest_pair} at s {self.closest_s:.4f}"
        whole = f"{1e3 * self.clearance_along_m:.3f} mm along the seam"
        clearance = f"  clearance         {1e3 * self.clearance_m:.3f} mm{pair}; {whole}"
        lines += textwrap.wrap(clearance, WIDTH, subsequent_indent=" " * 20)
        lines.append(f"  joint margin      {math.degrees(self.joint_margin_rad):.3f} deg")
        lines.append(f"  joint step        {math.degrees(self.joint_step_rad):.3f} deg")
        if self.posture_rad:
            lines.append(f"  posture           {self.posture_rad:.1e} rad from the posture asked")
        closure = f"{self.closure_m:.1e} m, {self.closure_rad:.1e} rad"
        return [*lines, f"  closure           {closure}; {self.samples} configurations"]

    @property
    def unit(self) -> str:
        """Unit of the reading, in brackets, for as much as it has one: most of eq. (16) add m^6 to m^3."""
        powers = {"product": 3 * len(self.manipulability_mean), "mean": 3}
        if self.reading in powers:
            return f"[m^{powers[self.reading]}]"
        return f"[lengths in {'mm' if self.reading == 'millimetres' else 'm'}]"

    def _objective(self) -> list[str]:
        """Return the lines on objective and products, without those that say nothing in this cell."""
        label = f"  {WHOLE.get(self.reading, f'MMR ({self.reading})')}"
        text = f"mean {self.mmr_mean:.6g}, {self.mmr_min:.6g} to {self.mmr_max:.6g} {self.unit}"
        lines = textwrap.wrap(label.ljust(20) + text, WIDTH, subsequent_indent=" " * 20)
        if self.over_seam != "mean":
            kind = "least of the points" if self.exponent is None else f"soft minimum (p = {self.exponent:g})"
            text = f"  maximised         {kind} {self.objective:.6g}; least along the seam {self.mmr_min_along:.6g}"
            lines += textwrap.wrap(text, WIDTH, subsequent_indent=" " * 20)
        if not math.isnan(self.m_tight_mean):
            lines.append(f"  M_tight, M_loose  mean {self.m_tight_mean:.6g}, {self.m_loose_mean:.6g}")
        elif self.reading != "product":  # without tight robots M_loose is the product
            lines.append(f"  M_loose           mean {self.m_loose_mean:.6g}")
        return lines


def unreachable(
    cell: Cell, at: Sequence[float] | np.ndarray, robot: str, point: int, n_points: int, note: str = ""
) -> Report:
    """Return the report of a placement where one robot cannot reach one seam point.

    Args:
        cell: the cell.
        at: placement of {P} in W, x, y, z [m] and, if given, yaw [rad].
        robot: name of a station or of the positioner.
        point: index of the seam point, of n_points.
        n_points: number of seam points asked for.
        note: more about it, e.g. which joint limit is in the way.
    """
    text = note or "no joint angles within the limits reach the pose the weld asks for"
    s = point / (n_points if cell.seam.closed else n_points - 1)
    violation = Violation("reach", robot, point, math.nan, math.nan, s=s, note=text)
    return Report.without_plan(cell, at, n_points, [violation])


def worst_first(violations: list[Violation] | tuple[Violation, ...]) -> tuple[Violation, ...]:
    """Return one violation for each key, the worst, ordered by severity."""
    kept: dict[tuple[str, ...], Violation] = {}
    for violation in violations:
        if violation.key not in kept or violation.severity > kept[violation.key].severity:
            kept[violation.key] = violation
    return tuple(sorted(kept.values(), key=lambda v: -v.severity))


def plain(value: Any) -> Any:
    """Return a value as JSON takes it: lists for tuples, None for NaN and infinity."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
