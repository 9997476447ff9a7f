"""How the genetic algorithm converges: Pan et al., Fig. 13 to 15."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

NEEDS = ("data/ga_individuals.csv", "plans/paper.json")
FAINT = {"linewidth": 0.5, "alpha": 0.45}


def drawings(study: Study) -> list[Drawing]:
    """Return the three figures of convergence."""
    return [
        Drawing("fig13_best_individual", best_individual, NEEDS),
        Drawing("fig14_fitness", fitness, NEEDS),
        Drawing("fig15_mean_distance", mean_distance, NEEDS),
    ]


def _generations(study: Study) -> tuple[pd.DataFrame, int]:
    """Return the traces of the paper cell's default GA, all seeds, and the seed that is shown bold."""
    cell = study.plan("paper").cell.name
    traces = study.traces
    own = traces[(traces["cell"] == cell) & (traces["solver"] == "ga") & (traces["preset"] == "default")]
    return own, int(study.data("ga_individuals")["seed"].iloc[0])


def best_individual(study: Study) -> Figure:
    """Draw the coordinates of the best individual over the generations, and the paper's C as marks on the right."""
    traces, bold = _generations(study)
    paper = study.plan("paper").placement_m
    fig = style.figure(64)
    axes = fig.add_subplot()
    for i, (axis, name) in enumerate(zip("xyz", ("x_m", "y_m", "z_m"), strict=True)):
        colour, line = style.SERIES[i], style.LINES[i]
        _seeds(axes, traces, bold, name, colour, line, f"${axis}$")
        axes.plot(
            1.03, paper[i], marker="<", color=colour, clip_on=False, transform=axes.get_yaxis_transform(), markersize=5
        )
    axes.plot([], [], marker="<", color=style.GREY, linestyle="none", label="Pan et al. C")
    style.name_axes(axes, "generation", "best individual in W [m]", _title("best individual", traces, bold))
    style.legend_below(axes, 4)
    return fig


def fitness(study: Study) -> Figure:
    """Draw best and mean fitness over the generations."""
    traces, bold = _generations(study)
    fig = style.figure(62)
    axes = fig.add_subplot()
    _seeds(axes, traces, bold, "best", style.BLUE, "-", "best so far")
    _seeds(axes, traces, bold, "mean", style.ORANGE, "--", "mean of the feasible")
    style.name_axes(axes, "generation", "fitness: mean MMR [m$^6$ + m$^3$]", _title("fitness", traces, bold))
    axes.legend(loc="lower right")
    return fig


def mean_distance(study: Study) -> Figure:
    """Draw the mean distance between individuals over the generations."""
    traces, bold = _generations(study)
    fig = style.figure(62)
    axes = fig.add_subplot()
    _seeds(axes, traces.assign(spread_mm=1e3 * traces["spread_m"]), bold, "spread_mm", style.BLUE, "-", f"seed {bold}")
    axes.set_yscale("log")
    style.plain_log(axes.yaxis)
    style.name_axes(axes, "generation", "mean distance [mm]", _title("distance between individuals", traces, bold))
    return fig


def _seeds(axes: Axes, traces: pd.DataFrame, bold: int, column: str, colour: str, line: object, label: str) -> None:
    """Draw one column of every seed's trace faintly and of one seed in bold."""
    for seed, run in traces.groupby("seed"):
        if seed != bold:
            axes.plot(run["step"], run[column], color=colour, **FAINT)
    run = traces[traces["seed"] == bold]
    axes.plot(run["step"], run[column], color=colour, linestyle=line, linewidth=1.5, label=label)
    axes.set_xlim(1, max(2, int(np.max(traces["step"]))))


def _title(what: str, traces: pd.DataFrame, bold: int) -> str:
    return f"GA, {what}\nseed {bold} bold, {traces['seed'].nunique() - 1} more seeds faint"
