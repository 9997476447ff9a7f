"""What errors of the set-up cost: the nominal optimum against the robust one, over the size of the errors."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

TABLE = "data/robust.csv"
ANSWERS = (
    ("nominal", style.ORANGE, "--", "s", "nominal optimum"),
    ("robust ipopt", style.BLUE, "-", "o", "robust optimum, Ipopt"),
    ("robust ga", style.GREEN, ":", "x", "robust optimum, GA"),
)


def drawings(study: Study) -> list[Drawing]:
    """Return the one figure of the robust study; none for a study without its table."""
    return [] if study.missing((TABLE,)) else [Drawing("robust", worst_cases, (TABLE,))]


def worst_cases(study: Study) -> Figure:
    """Draw the worst objective and the worst manipulability over the size of the errors, a column for each cell."""
    table = study.data("robust")
    cells = list(dict.fromkeys(table["cell"]))
    fig = style.figure(105, columns=len(cells))
    grid = fig.subplots(2, len(cells), sharex=True, squeeze=False)
    for (upper, lower), cell in zip(grid.T, cells, strict=True):
        rows = table[table["cell"] == cell]
        _curves(upper, rows, "objective_worst")
        _curves(lower, rows, "w_worst_m3")
        lower.axhline(rows["floor_m3"].iloc[0], color=style.RED, linewidth=0.7, linestyle="-.", label="floor of $w$")
        upper.set_title(style.pretty(cell), loc="left")
        lower.set_xticks(sorted({0.0, *rows["errors"]}))
        lower.set_xlabel("errors of the set-up, times the stated box")
        lower.set_xlim(-0.15, rows["errors"].max() + 0.15)
    grid[0, 0].set_ylabel("worst mean objective")
    grid[1, 0].set_ylabel("least $w$ of any robot [m$^3$]")
    style.legend_below(grid[1, 0], 4)
    return fig


def _curves(axes: Axes, rows: pd.DataFrame, column: str) -> None:
    """Draw a column of every answer from the stated cell on; markers are open where a level is missed."""
    stated = rows[rows["errors"] == 0.0]
    for answer, colour, line, marker, label in ANSWERS:
        found = rows[(rows["answer"] == answer) & (rows["errors"] > 0.0)]
        if found.empty:
            continue
        found = pd.concat([stated, found]).sort_values("errors")
        axes.plot(found["errors"], found[column], color=colour, linestyle=line, label=label)
        for missed, face in (
            (found["feasible"] < found["scenarios"], "white"),
            (found["feasible"] == found["scenarios"], colour),
        ):
            axes.plot(found["errors"][missed], found[column][missed], marker, color=colour, mfc=face, ms=4.5)
