"""What the objective decides: optima by every reading, measured by every other, and where they lie."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

OPTIMA, CROSS = "data/readings.csv", "data/cross.csv"
ROW_MM, ROOM_MM = 8.5, 26.0  # height of a row of a cross table, and of its labels and title
DARK = 0.45  # share of the colour scale from below which numbers are written in white
MARKERS = "osv^PDXh*<"
FULL = 99.95  # from which one decimal shows 100
SPAN_M = 0.01  # of an axis at least: less is a solver's rounding
TOGETHER_MM = 2.0  # optima nearer than this are one mark


def drawings(study: Study) -> list[Drawing]:
    """Return the cross tables with their placements; none for a study without them."""
    return [] if study.missing((OPTIMA, CROSS)) else [Drawing("readings", readings, (OPTIMA, CROSS))]


def readings(study: Study) -> Figure:
    """Draw for each cell what every verified optimum is worth by every objective, and the placements beside it."""
    optima, cross = study.data("readings"), study.data("cross")
    cells = cross["cell"].unique()
    heights = [ROW_MM * cross.loc[cross["cell"] == cell, "optimum_of"].nunique() + ROOM_MM for cell in cells]
    fig = style.figure(sum(heights), columns=2)
    grid = fig.add_gridspec(len(cells), 2, width_ratios=(1.35, 1.0), height_ratios=heights)
    for i, cell in enumerate(cells):
        part = cross[cross["cell"] == cell]
        names = part["optimum_of"].unique().tolist()
        _table(fig.add_subplot(grid[i, 0]), part, names, str(cell))
        found = optima[(optima["cell"] == cell) & optima["objective"].isin(names)]
        _places(fig.add_subplot(grid[i, 1]), found)
    return fig


def _table(axes: Axes, part: pd.DataFrame, names: list[str], cell: str) -> None:
    """Write the shares of a cross table into coloured squares, the worst of the cell darkest."""
    square = part.pivot(index="optimum_of", columns="measured_by", values="share_percent")
    by = part["measured_by"].unique().tolist()
    values = square.reindex(index=names, columns=by).to_numpy()
    low = min(float(np.nanmin(values)), 99.0)
    axes.imshow(values, cmap="cividis", vmin=low, vmax=100.0, aspect="auto")
    for (i, j), value in np.ndenumerate(values):
        ink = "white" if (value - low) / (100.0 - low) < DARK else style.INK
        axes.text(j, i, f"{value:.1f}" if value < FULL else "100", ha="center", va="center", color=ink, fontsize=6)
    axes.set_xticks(range(len(by)), by, rotation=40, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(names)), names)
    axes.grid(visible=False)
    style.name_axes(axes, "measured by [% of the best by that]", "optimum of", cell)


def _places(axes: Axes, found: pd.DataFrame) -> None:
    """Mark the optima in the plane of the two coordinates that differ most; equal ones share a mark."""
    spread = found[["x_m", "y_m", "z_m"]].std().sort_values(ascending=False)
    across, up = sorted(spread.index[:2])
    marked: list[tuple[np.ndarray, list[str]]] = []
    for _, row in found.iterrows():
        place = row[["x_m", "y_m", "z_m"]].to_numpy(dtype=float)
        near = [names for at, names in marked if 1e3 * np.linalg.norm(at - place) < TOGETHER_MM]
        near[0].append(row["objective"]) if near else marked.append((place, [row["objective"]]))
    axis = ["x_m", "y_m", "z_m"]
    for i, (place, names) in enumerate(marked):
        at = place[axis.index(across)], place[axis.index(up)]
        colour, marker = style.SERIES[i % len(style.SERIES)], MARKERS[i % len(MARKERS)]
        axes.plot(*at, ls="none", marker=marker, color=colour, ms=5, label=",\n".join(names))
    axes.margins(0.12)
    for low_high, setter in ((axes.get_xlim(), axes.set_xlim), (axes.get_ylim(), axes.set_ylim)):
        middle, half = sum(low_high) / 2, max(low_high[1] - low_high[0], SPAN_M) / 2
        setter(middle - half, middle + half)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    style.name_axes(axes, f"{across[0]} [m]", f"{up[0]} [m]", "where they lie")
    axes.legend(fontsize=5.5, loc="upper left", bbox_to_anchor=(1.0, 1.02), handlelength=1.0, borderaxespad=0.2)
