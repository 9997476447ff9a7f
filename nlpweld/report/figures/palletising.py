"""Palletising: who moves when (Cao et al. 2012, Fig. 6 and 8), stages over z_max (Fig. 9 to 12), times, solvers."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

VELOCITIES, STAGES, BOXES, RUNS, WALKS = (
    f"data/{name}.csv" for name in ("velocities", "stages", "boxes", "runs", "walks")
)
CYCLES = {"before": "before: B moves three times (Fig. 6)", "after": "after: B moves twice (Fig. 8)"}
PANELS = (
    ("up_s", "$t_1$ [s]", "rise, P0 to P1 (Fig. 9)"),
    ("down_s", "$t_3$ [s]", "drop, P2 to P3 (Fig. 10)"),
    ("lift_s", "$t_M$ [s]", "B between P1 and P2 (Fig. 11)"),
    ("total_s", "$t$ [s]", "whole leg (Fig. 12)"),
)
FOUND_S = 1e-6  # regret within which a solver has found the optimum
LEAST_S = 1e-12  # of a logarithmic axis of regrets: less is rounding
LIMITS = {"A_speed": "$v_A$", "A_acceleration": "$a_A$", "A_jerk": "$j_A$"} | {
    "B_speed": "$v_B$",
    "B_acceleration": "$a_B$",
    "B_jerk": "$j_B$",
}


def drawings(study: Study) -> list[Drawing]:
    """Return the figures of the palletising study; none for a study without its velocities."""
    if study.missing((VELOCITIES,)):
        return []
    return [
        Drawing("fig06_08_velocities", velocities, (VELOCITIES,)),
        Drawing("fig09_12_stages", stages, (STAGES, BOXES)),
        Drawing("box_times", box_times, (BOXES,)),
        Drawing("regret_by_solver", regrets, (RUNS,)),
        Drawing("same_totals", walked, (WALKS,)),
    ]


def velocities(study: Study) -> Figure:
    """Draw the axes' velocities over a leg, before above after."""
    table = study.data("velocities")
    fig = style.figure(105, columns=2)
    grid = fig.subplots(2, 2, sharex=True, sharey="col")
    sides = ((("B_m_s", "B, up"), ("C_m_s", "C, out")), (("A_deg_s", "A, swing"), ("D_deg_s", "D, wrist")))
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    for row, (cycle, title) in zip(grid, CYCLES.items(), strict=True):
        part = table[table["cycle"] == cycle]
        for axes, series, unit in zip(row, sides, ("m/s", "deg/s"), strict=True):
            for i, (column, label) in enumerate(series):
                axes.plot(part["t_s"], part[column], label=label, **style.look(i))
            axes.axhline(0.0, color=style.INK, linewidth=0.5)
            axes.axvline(part["t_s"].max(), color=style.GREY, linewidth=0.8, linestyle=":")
            axes.set_ylabel(f"velocity [{unit}]")
        row[0].set_title(f"{title}, {part['t_s'].max():.3f} s", loc="left")
    for axes in grid[0]:
        axes.legend(loc="upper right")
    return fig


def stages(study: Study) -> Figure:
    """Draw the stages of two boxes' legs over z_max, with the best heights marked."""
    table, boxes = study.data("stages"), study.data("boxes").set_index("box")
    fig = style.figure(110, columns=2)
    panels = fig.subplots(2, 2, sharex=True)
    for axes, (column, label, title) in zip(panels.flat, PANELS, strict=True):
        for i, (box, part) in enumerate(table.groupby("box")):
            best, look = boxes.loc[box], style.look(i)
            name = f"box {box}, layer {best['layer']:.0f} ({best['case']})"
            axes.plot(part["z_max_m"], part[column], label=name, **look)
            span = best[["z_max_m", "z_most_m"]].to_numpy(dtype=float)
            at = np.interp(span, part["z_max_m"], part[column])
            axes.plot(span, at, "o-", color=look["color"], ms=3.5, linewidth=3.0, alpha=0.5)
            if column == "lift_s":
                axes.axhline(part["beside_s"].iloc[0], color=look["color"], linewidth=0.7, linestyle=":")
        style.name_axes(axes, "$z_{max}$ [m]" if axes in panels[-1] else "", label, title)
    panels[1, 0].plot([], [], ":", color=style.GREY, linewidth=0.7, label="slowest of A, C, D")
    panels[1, 0].plot([], [], "o-", color=style.GREY, ms=3.5, linewidth=3.0, alpha=0.5, label="best heights")
    style.legend_below(panels[1, 0], 4)
    return fig


def box_times(study: Study) -> Figure:
    """Draw every box's cycle before and after, and the heights that are best."""
    boxes = study.data("boxes")
    fig = style.figure(95, columns=2)
    upper, lower = fig.subplots(2, 1, sharex=True)
    for shift, column, colour, label in (
        (-0.2, "before_s", style.ORANGE, "before"),
        (0.2, "after_s", style.BLUE, "after"),
    ):
        upper.bar(
            boxes["box"] + shift, boxes[column], width=0.38, color=colour, label=f"{label}, {boxes[column].sum():.3f} s"
        )
    upper.set_ylim(0.0, 1.25 * boxes["before_s"].max())
    upper.legend(loc="upper right", ncols=2)
    style.name_axes(upper, "", "cycle [s]")
    lower.vlines(
        boxes["box"], boxes["z_max_m"], boxes["z_most_m"], color=style.BLUE, linewidth=2.5, label="all as quick"
    )
    lower.plot(boxes["box"], boxes["z_max_m"], "o", color=style.INK, ms=3, label="lowest best height")
    lower.plot(boxes["box"], boxes["z_m"], "_", color=style.ORANGE, ms=7, markeredgewidth=1.5, label="place, $z_3$")
    lower.legend(loc="upper left", ncols=3)
    lower.set_ylim(0.3, 2.15)
    style.name_axes(lower, "box, from below", "height [m]")
    for axes in (upper, lower):
        for layer in boxes.groupby("layer")["box"].max()[:-1]:
            axes.axvline(layer + 0.5, color=style.GREY, linewidth=0.5)
        axes.grid(visible=False, axis="x")
    lower.set_xticks(boxes["box"])
    lower.set_xlim(0.4, boxes["box"].max() + 0.6)
    return fig


def regrets(study: Study) -> Figure:
    """Draw how much longer than the closed form every run of every solver takes, one row a solver."""
    runs = study.data("runs").dropna(subset=["regret_s"])
    runs = runs.assign(shown=runs["regret_s"].clip(lower=LEAST_S))
    order = runs.groupby("solver")["shown"].max().sort_values(ascending=False).index.tolist()
    fig = style.figure(12.0 + 5.0 * len(order) + 14.0)
    axes = fig.add_subplot()
    for i, (case, part) in enumerate(runs.groupby("case", sort=True)):
        rows = part["solver"].map(order.index) + (0.15 if i else -0.15)
        colour = style.SERIES[i]
        axes.plot(part["shown"], rows, "os"[i % 2], ms=3.5, color=colour, mfc="none", label=f"{case}", linestyle="")
    axes.axvline(FOUND_S, color=style.RED, linestyle="--", linewidth=0.8, label="$10^{-6}$ s")
    axes.set_xscale("log")
    axes.set_xlim(LEAST_S / 2, None)
    axes.set_yticks(range(len(order)), [style.pretty(name) for name in order])
    style.name_axes(axes, "time over the closed form [s]", "")
    style.legend_below(axes, 3)
    return fig


def walked(study: Study) -> Figure:
    """Draw limits along walks that keep both totals, as multiples of where they began."""
    table = study.data("walks")
    names = table["walk"].unique()
    fig = style.figure(72, columns=2)
    for axes, name in zip(fig.subplots(1, len(names), sharey=True, squeeze=False)[0], names, strict=True):
        _walk(axes, table[table["walk"] == name], str(name))
    first = fig.axes[0]
    first.set_ylabel("limit, as a multiple of set 1")
    style.legend_below(first, len(LIMITS))
    return fig


def _walk(axes: Axes, part: pd.DataFrame, name: str) -> None:
    for i, (column, label) in enumerate(LIMITS.items()):
        axes.plot(part["step"] / part["step"].max(), part[column] / part[column].iloc[0], label=label, **style.look(i))
    before, after = part["before_s"].iloc[-1], part["after_s"].iloc[-1]
    style.name_axes(axes, "way gone", "", f"{name}: totals stay {before:.3f} s and {after:.3f} s")
