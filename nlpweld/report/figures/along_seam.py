"""Manipulability and joints along the seam: Pan et al., Fig. 16 to 19."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlpweld.plan import Plan
from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

NEAR_DEG = 30.0  # a joint limit this near a path is drawn
POOR = {
    "near_singular": ("fig18_near_singular", "welder near a singularity along the whole seam"),
    "unsteady": ("fig19_unsteady", "unsteady profile: the widest swing of MMR"),
}


def drawings(study: Study) -> list[Drawing]:
    """Return profiles at the optimum, joints, and the two poor placements."""
    both = ("data/profile_optimum.csv", "data/profile_paper.csv", "plans/optimum.json", "plans/paper.json")
    found = [Drawing("fig16_manipulability", optimum_and_paper, both)]
    if not study.missing(("plans/optimum.json",)):
        stations = [station.name for station in study.plan("optimum").cell.stations]
        found += [
            Drawing(f"fig17{letter}_joints_{name}", partial(joints, robot=name), ("plans/optimum.json",))
            for letter, name in zip("abcdefgh", stations, strict=False)
        ]
    for name, (file, title) in POOR.items():
        needs = ("data/poor_placements.csv", f"data/profile_{name}.csv", f"plans/{name}.json")
        found.append(Drawing(file, partial(poor, name=name, title=title), needs))
    return found


def optimum_and_paper(study: Study) -> Figure:
    """Draw w of each robot, M_tight and M_loose, and MMR along the seam, at the optimum and at the paper's C."""
    fig = style.figure(118)
    upper, lower = fig.subplots(2, 1, sharex=True, sharey=True)
    for axes, name, title in ((upper, "optimum", "optimum"), (lower, "paper", "Pan et al. C")):
        plan, table = study.plan(name), study.data(f"profile_{name}")
        _profile(axes, table, plan)
        axes.set_title(f"{title}, mean MMR {table['mmr'].mean():.4f}\n{_at(plan)}", loc="left")
    _seam_axis(lower)
    upper.set_ylim(0, 1.05 * max(line.get_ydata().max() for ax in (upper, lower) for line in ax.lines[:-1]))
    style.legend_below(upper, 3)
    return fig


def poor(study: Study, name: str, title: str) -> Figure:
    """Draw the profile of a poor placement, with where it is and what it breaks."""
    plan, table = study.plan(name), study.data(f"profile_{name}")
    row = study.data("poor_placements").set_index("name").loc[name]
    fig = style.figure(80)
    axes = fig.add_subplot()
    _profile(axes, table, plan, floor=_floor(study))
    _seam_axis(axes)
    text = f"{title}\n{_at(plan)}\nbreaks: {row['breaks'].replace('_', ' ')}"
    axes.set_title(text, loc="left")
    axes.set_ylim(bottom=0)
    style.legend_below(axes, 3)
    return fig


def joints(study: Study, robot: str) -> Figure:
    """Draw the joint angles of one robot along the seam, and limits that come near."""
    plan = study.plan("optimum")
    station = next(s for s in plan.cell.stations if s.name == robot)
    q = np.degrees(closed(plan.paths[robot]))
    limits = np.degrees(station.robot.limits_rad)
    degrees = np.append(360 * plan.s, 360.0)
    fig = style.figure(70)
    axes = fig.add_subplot()
    for i, path in enumerate(q.T):
        axes.plot(degrees, path, color=style.SERIES[i % 6], linestyle=style.LINES[i % 6], label=f"$q_{i + 1}$")
        for limit in limits[i]:
            if np.abs(path - limit).min() < NEAR_DEG:
                axes.axhline(limit, color=style.SERIES[i % 6], linewidth=0.7, linestyle=":")
                axes.text(361, limit, f" limit $q_{i + 1}$", fontsize=6.5, va="center")
    _seam_axis(axes)
    style.name_axes(axes, "", "joint angle [deg]", f"{style.pretty(robot)} at the optimum")
    axes.set_xlabel(SEAM_LABEL)
    style.legend_below(axes, 6, columnspacing=1.0, handlelength=2.0)
    return fig


def closed(q: np.ndarray) -> np.ndarray:
    """Return joint paths (N + 1, n) that come back to the first point, whole turns away at most."""
    turns = np.round((q[-1] - q[0]) / (2 * np.pi))
    return np.vstack([q, q[0] + 2 * np.pi * turns])


SEAM_LABEL = r"seam angle $\theta$ [deg]"


def _profile(axes: Axes, table: pd.DataFrame, plan: Plan, floor: float | None = None) -> None:
    """Draw all curves of one placement over the seam angle."""
    degrees = np.append(360 * table["s"], 360.0)
    for column, label, colour, line, width in _curves(plan):
        axes.plot(
            degrees,
            np.append(table[column], table[column].iloc[0]),
            color=colour,
            linestyle=line,
            lw=width,
            label=label,
        )
    level = plan.cell.constraints.singularity_floor_m3 if floor is None else floor
    axes.axhline(level, color=style.RED, linewidth=0.7, linestyle=":", label="floor of $w$")
    axes.set_ylabel("$w$ [m$^3$], M, MMR [m$^6$, m$^3$]")


def _curves(plan: Plan) -> list[tuple[str, str, str, Any, float]]:
    """Return column, label, colour, line and width of every curve; with one loose robot, M_loose is its w."""
    stations = plan.cell.stations
    loose = [s.name for s in stations if s.coupling.kind == "loose"]
    curves: list[tuple[str, str, str, Any, float]] = []
    for i, station in enumerate(stations):
        same = " = $M_{loose}$" if loose == [station.name] else ""
        curves.append(
            (f"w_{station.name}_m3", f"$w$ {style.pretty(station.name)}{same}", style.SERIES[i], style.LINES[i], 1.1)
        )
    curves.append(("m_tight", "$M_{tight}$", style.SKY, style.LINES[4], 1.1))
    if len(loose) > 1:
        curves.append(("m_loose", "$M_{loose}$", style.GREY, style.LINES[3], 1.4))
    return [*curves, ("mmr", "MMR", style.INK, "-", 2.0)]


def _floor(study: Study) -> float | None:
    """Return the singularity floor of the cell as it is; the poor placements' own plans have none."""
    if study.missing(("plans/optimum.json",)):
        return None
    return study.plan("optimum").cell.constraints.singularity_floor_m3


def _at(plan: Plan) -> str:
    return f"({', '.join(f'{v + 0.0:.3f}' for v in np.round(plan.placement_m, 3))}) m"


def _seam_axis(axes: Axes) -> None:
    axes.set_xlim(0, 360)
    axes.set_xticks(range(0, 361, 60))
    axes.set_xlabel(SEAM_LABEL)
