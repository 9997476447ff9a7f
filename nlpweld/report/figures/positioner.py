"""A positioner and the robots that weld on it: Zhang et al., Fig. 1, 7 and 9, and maps over where it stands."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.figures.comparison import labelled, objective_label
from nlpweld.report.figures.workspace import failing_patches, tints, value_mesh
from nlpweld.report.study import Study

FRAMES, SPEEDS, BREAKS = "data/frames-", "data/speeds.csv", "data/speed_breaks.csv"
POSITIONS, REFERENCE = "data/weld_positions.csv", "data/reference.csv"
EVERY, ARM = 6, 0.28  # weld frames drawn: one in so many points; length of an axis, as a share of the seam's width
SEAM_LABEL, ARC = "arc length along the seam [mm]", "arc_mm"
SEAM_NAMES = {"main": "main seam", "second": "second seam"}
MARKERS = "osv^P"
MAP_MM, BELOW_MM = 138.0, 42.0  # width of both panels of a map together; height of labels, bars and legend
BAR = 18  # length of a colour bar over its thickness, for a square map
OUTLINE = [withStroke(linewidth=1.8, foreground=style.INK)]


def drawings(study: Study) -> list[Drawing]:
    """Return frames, speeds, table angles, weld angles and maps; none for a study without a positioner."""
    if study.missing((REFERENCE,)):
        return []
    cells = study.data("reference")["cell"].tolist()
    found = [
        Drawing("fig09_joint_speeds", speeds, (SPEEDS, BREAKS)),
        *(Drawing(f"fig07_weld_frames-{c}", partial(frames, cell=c), (f"{FRAMES}{c}.csv",)) for c in cells),
        *(Drawing(f"weld_angles-{c}", partial(angles, cell=c), (POSITIONS,)) for c in cells),
        *(Drawing(f"table_angles-{c}", partial(table_angles, cell=c), (f"data/table_angles-{c}.csv",)) for c in cells),
    ]
    for c in cells:
        needs = (f"data/map-{c}.csv", f"data/map_near-{c}.csv", REFERENCE)
        found.append(Drawing(f"placement_map-{c}", partial(placements, cell=c), needs))
    return found


def frames(study: Study, cell: str) -> Figure:
    """Draw the seams in C with the axes of their weld frames {p} (Zhang et al., Fig. 7)."""
    table = study.data(f"frames-{cell}")
    extent = np.ptp(table[["x_m", "y_m", "z_m"]].to_numpy(), axis=0)
    fig = style.figure(84)
    axes = style.space(fig)
    if extent[2] > extent[0]:
        axes.view_init(24, -58, vertical_axis="x")  # a trough open upwards
    for i, (name, seam) in enumerate(table.groupby("seam", sort=False)):
        axes.plot(seam["x_m"], seam["y_m"], seam["z_m"], color=style.INK, ls=style.LINES[i], label=_seam_name(name))
        axes.scatter(*seam[["x_m", "y_m", "z_m"]].iloc[0], color=style.INK, marker="o", s=18, depthshade=False)
    _triads(axes, table, ARM * extent[extent > 0.0].min())
    style.equal_scales(axes, zoom=1.2)
    axes.yaxis.set_major_locator(MaxNLocator(2))
    for axis in "xyz":
        getattr(axes, f"set_{axis}label")(f"${axis}_C$ [m]")
    axes.set_title("seams in the workpiece frame C\nwith weld frames {p}, dot at s = 0", loc="left")
    style.legend_below(axes, 2)
    return fig


def _triads(axes: Any, table: pd.DataFrame, length_m: float) -> None:
    """Draw the axes of some weld frames of each seam."""
    some = table[table.groupby("seam").cumcount() % EVERY == 0]
    p = some[["x_m", "y_m", "z_m"]].to_numpy()
    labels = {"x": "$x_p$, along the seam", "y": "$y_p$", "z": "$z_p$, root to cap"}
    for (axis, label), colour in zip(labels.items(), (style.RED, style.GREEN, style.BLUE), strict=True):
        u = some[[f"{axis}_{i}" for i in (1, 2, 3)]].to_numpy()
        axes.quiver(*p.T, *u.T, length=length_m, color=colour, lw=0.9, arrow_length_ratio=0.25, label=label)


def speeds(study: Study) -> Figure:
    """Draw the joint speeds of one robot along the seam at every placement, and where they break (Fig. 9)."""
    table, breaks = study.data("speeds"), study.data("speed_breaks")
    fig = style.figure(112, columns=2)
    panels = fig.subplots(2, 2, sharex=True, sharey=True)
    for axes, (name, own) in zip(panels.flat, table.groupby("placement"), strict=True):
        _speed_lines(axes, own, breaks[breaks["placement"] == name])
        axes.set_title(f"{name}{_where(study, name)}", loc="left")
    for axes in panels[-1]:
        axes.set_xlabel(SEAM_LABEL)
    for axes in panels[:, 0]:
        axes.set_ylabel("joint speed [deg/s]")
    _times(panels[0], table)
    rate = table[ARC].iloc[-1] / table["time_s"].iloc[-1]
    fig.suptitle(
        f"robot 2, joint speeds about the DH axes, welding at {rate:g} mm/s; dotted: line meets arc", fontsize=8
    )
    style.legend_below(panels[0, 0], 6)
    return fig


def _speed_lines(axes: Axes, table: pd.DataFrame, breaks: pd.DataFrame) -> None:
    """Draw every joint's speed, each piece of the seam carried on to its breaks."""
    joints = [name for name in table.columns if name.startswith("J") and name.endswith("_deg_s")]
    for i, joint in enumerate(joints):
        look = {"color": style.SERIES[i], "linestyle": style.LINES[i], "linewidth": 1.1}
        for k, piece in table.groupby("piece"):
            before = breaks[(breaks["side"] == "after")].iloc[k - 1 : k] if k else breaks.iloc[:0]
            after = breaks[breaks["side"] == "before"].iloc[k : k + 1]
            line = pd.concat([part[[ARC, joint]] for part in (before, piece, after) if len(part)])
            axes.plot(line[ARC], line[joint], label=joint.partition("_")[0] if k == 0 else None, **look)
    _mark_breaks(axes, breaks[ARC].unique())
    axes.set_xlim(table[ARC].iloc[0], table[ARC].iloc[-1])


def _mark_breaks(axes: Axes, where: np.ndarray, label: str | None = None) -> None:
    for i, x in enumerate(where):
        axes.axvline(x, color=style.INK, linestyle=":", linewidth=0.8, zorder=1, label=None if i else label)


def _where(study: Study, placement: str) -> str:
    """Return where a named placement is, if a baseline says so."""
    named = study.baselines["name"].str.split().str[-1] == placement
    rows = study.baselines[named].iterrows()
    return "".join(f": HD {row['x_m']:g} m, FB {row['y_m']:g} m".replace("-", "\N{MINUS SIGN}") for _, row in rows)


def _times(panels: np.ndarray, table: pd.DataFrame) -> None:
    """Put the time on a second axis above panels."""
    rate = table[ARC].iloc[-1] / table["time_s"].iloc[-1]
    for axes in panels:
        above = axes.secondary_xaxis("top", functions=(lambda x: x / rate, lambda t: t * rate))
        above.set_xlabel("time [s]")
        above.spines["top"].set_visible(True)


def table_angles(study: Study, cell: str) -> Figure:
    """Draw both angles of the positioner along the seam, counted as Zhang et al. do (eq. 6)."""
    table = study.data(f"table_angles-{cell}")
    fig = style.figure(64)
    axes = fig.add_subplot()
    names = [name for name in table.columns if name.startswith("theta") and name.endswith("_deg")]
    for i, name in enumerate(names):
        axes.plot(table[ARC], table[name], color=style.SERIES[i], ls=style.LINES[i], label=rf"$\theta_{name[5]}$")
    ends = table.groupby("piece")[ARC].agg(["min", "max"])
    _mark_breaks(axes, (ends["max"].to_numpy()[:-1] + ends["min"].to_numpy()[1:]) / 2, "line meets arc")
    axes.set_xlim(table[ARC].iloc[0], table[ARC].iloc[-1])
    axes.set_yticks(range(*_span(table[names].to_numpy(), 90)))
    _times(np.array([axes]), table)
    style.name_axes(axes, SEAM_LABEL, "positioner angle [deg]")
    style.legend_below(axes, 3)
    return fig


def _span(values: np.ndarray, step: int) -> tuple[int, int, int]:
    """Return start, stop and step of a range of multiples of a step that holds all values."""
    return int(np.floor(values.min() / step)) * step, int(np.ceil(values.max() / step)) * step + 1, step


def angles(study: Study, cell: str) -> Figure:
    """Draw slope and rotation of every seam while it is welded, and its position after ISO 6947."""
    table = study.data("weld_positions")
    table = table[table["cell"] == cell]
    fig = style.figure(62)
    axes = fig.add_subplot()
    for i, (name, seam) in enumerate(table.groupby("seam", sort=False)):
        position = "/".join(seam["iso"].unique())
        for j, angle in enumerate(("rotation", "slope")):
            look = {"color": style.SERIES[2 * i + j], "linestyle": style.LINES[2 * i + j]}
            axes.plot(seam["s"], seam[f"{angle}_deg"], label=f"{angle}, {_seam_name(name)} ({position})", **look)
    axes.set(xlim=(0, 1), ylim=(-15, 195), yticks=range(0, 181, 45))
    style.name_axes(axes, "seam parameter s [share of the length]", "angle of the weld [deg]")
    axes.set_title(f"how the welds lie, placement {table['placement'].iloc[0]}", loc="left")
    style.legend_below(axes, 1)
    return fig


def placements(study: Study, cell: str) -> Figure:
    """Draw the objective over (HD, FB), whole and near the reference, with placements and verified answers."""
    parts = study.data(f"map-{cell}"), study.data(f"map_near-{cell}")
    shapes = [np.ptp(part["x_m"]) / np.ptp(part["y_m"]) for part in parts]
    fig = style.figure(MAP_MM / sum(shapes) + BELOW_MM, columns=2)
    panels = fig.subplots(1, 2, width_ratios=shapes)
    for axes, part, title in zip(panels, parts, ("whole box", "near the reference"), strict=True):
        _one_map(fig, axes, part, objective_label(study.runs[study.runs["cell"] == cell], "mean"))
        _placement_marks(axes, study, cell)
        style.name_axes(axes, "HD [m]", "FB [m]", title)
    handles, _ = panels[0].get_legend_handles_labels()
    fig.legend(handles=[*handles, *failing_patches(parts[0])], loc="outside lower center", ncols=5)
    return fig


def _one_map(fig: Figure, axes: Axes, table: pd.DataFrame, label: str) -> None:
    tints(axes, table, "x_m", "y_m")
    mesh, ratio = value_mesh(axes, table, "x_m", "y_m"), np.ptp(table["x_m"]) / np.ptp(table["y_m"])
    bar = fig.colorbar(mesh, ax=axes, location="bottom", shrink=0.9, aspect=BAR * ratio, label=label)
    bar.ax.locator_params(nbins=5)
    axes.set(xlim=_window(table["x_m"]), ylim=_window(table["y_m"]), aspect="equal")
    axes.locator_params(nbins=5)
    axes.grid(visible=False)


def _placement_marks(axes: Axes, study: Study, cell: str) -> None:
    """Mark verified answers by solver, the baselines by the last word of their names, and the reference."""
    runs = labelled(study.runs, cell)
    for i, (label, own) in enumerate(runs[runs["verified"]].groupby("label")):
        look = {"marker": MARKERS[i % len(MARKERS)], "facecolor": "none", "edgecolor": style.RED, "linewidth": 0.9}
        axes.scatter(own["x_m"], own["y_m"], s=14 + 8 * i, label=label, zorder=4, **look)
    own = study.baselines[study.baselines["cell"] == cell]
    look = {"marker": "D", "color": "white", "edgecolor": style.INK, "linewidth": 0.7}
    axes.scatter(own["x_m"], own["y_m"], s=20, zorder=5, label=_baseline_label(own["name"]), **look)
    name = {"fontsize": 8, "fontweight": "bold", "color": "white", "path_effects": OUTLINE, "annotation_clip": True}
    for _, row in own.iterrows():
        at, offset = (row["x_m"], row["y_m"]), {"xytext": (4, 4), "textcoords": "offset points"}
        axes.annotate(row["name"].split()[-1], at, **offset, **name)
    best = study.data("reference").set_index("cell").loc[cell]
    look = {"marker": "+", "markersize": 10, "markeredgewidth": 1.1, "color": style.INK, "linestyle": "none"}
    axes.plot(best["x_m"], best["y_m"], label="reference (sampled)", zorder=6, **look)


def _baseline_label(names: pd.Series) -> str:
    """Return one legend entry for several baselines, e.g. ``Zhang et al. A, B``."""
    first = names.iloc[0].rpartition(" ")[0]
    return f"{first} {', '.join(name.split()[-1] for name in names)}".strip()


def _window(values: pd.Series) -> tuple[float, float]:
    return values.min(), values.max()


def _seam_name(name: str) -> str:
    return SEAM_NAMES.get(name, f"seam {style.pretty(name)}")
