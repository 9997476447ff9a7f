"""Solvers side by side, from records alone: quality, time, and progress."""

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlpweld.records.frames import contestants
from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

SPREAD = 0.13  # half width of the jitter that tells runs of one solver apart
ROOM = 1.25  # factor left free below the shortest and above the longest time


def drawings(study: Study) -> list[Drawing]:
    """Return one set of figures for each cell."""
    kinds = {"mmr_by_solver": mmr_by_solver, "solve_time_by_solver": solve_time_by_solver, "progress": progress}
    cells = study.runs["cell"].unique()
    return [
        Drawing(f"{kind}-{cell}", partial(draw, cell=cell), data=partial(drawn, cell=cell, traces=kind == "progress"))
        for cell in cells
        for kind, draw in kinds.items()
    ]


def drawn(study: Study, cell: str, traces: bool) -> pd.DataFrame:
    """Return what a figure of one cell is drawn from: its traces, or its runs."""
    table = study.traces if traces else study.runs
    return table[table["cell"] == cell]


def labelled(table: pd.DataFrame, cell: str) -> pd.DataFrame:
    """Return the rows of one cell with a ``label``: solver, preset, and formulation where there are several."""
    own = table[table["cell"] == cell].copy()
    own["label"] = contestants(own)
    if own["formulation"].nunique() > 1:
        own["label"] += "\n" + own["formulation"]
    return own


def mmr_by_solver(study: Study, cell: str) -> Figure:
    """Draw mean MMR of every run that brought numbers, verified or not, by solver."""
    runs = labelled(study.runs, cell)
    columns = style.columns_for(runs["label"].nunique())
    fig = style.figure(38 + 20 * columns**2, columns)
    axes = fig.add_subplot()
    labels = sorted(runs["label"].unique())
    for i, label in enumerate(labels):
        _strip(axes, i, runs[runs["label"] == label], "objective", style.SERIES[i % len(style.SERIES)])
    _reference(axes, study.baselines, cell)
    axes.margins(y=0.1)
    _solver_axis(axes, runs, labels)
    style.name_axes(axes, "solver (verified of runs)", objective_label(runs, "mean"), cell)
    _legend_of_marks(axes, bool((~runs["verified"] & runs["objective"].notna()).any()))
    return fig


def solve_time_by_solver(study: Study, cell: str) -> Figure:
    """Draw the solve time of every run that ended by itself, on a logarithmic axis."""
    runs = labelled(study.runs, cell)
    columns = style.columns_for(runs["label"].nunique())
    fig = style.figure(38 + 20 * columns**2, columns)
    axes = fig.add_subplot()
    axes.set_yscale("log")
    labels = sorted(runs["label"].unique())
    for i, label in enumerate(labels):
        ended = runs[(runs["label"] == label) & ~runs["status"].isin(["FAILED", "SKIPPED"]) & (runs["solve_s"] > 0)]
        _strip(axes, i, ended, "solve_s", style.SERIES[i % len(style.SERIES)])
    times = runs.loc[runs["solve_s"] > 0, "solve_s"]
    if len(times):  # a single run would leave a logarithmic axis without height
        axes.set_ylim(times.min() / ROOM, times.max() * ROOM)
    style.plain_log(axes.yaxis)
    _solver_axis(axes, runs, labels)
    style.name_axes(axes, "solver (verified of runs)", "solve time, no build [s]", cell)
    _legend_of_marks(axes, not runs["verified"].all())
    return fig


def progress(study: Study, cell: str) -> Figure:
    """Draw the best MMR so far against evaluations of the model: median and quartiles over seeds."""
    traces = labelled(study.traces, cell)
    columns = style.columns_for(traces["label"].nunique())
    fig = style.figure(64, columns)
    axes = fig.add_subplot()
    axes.set_xscale("log")
    for i, (label, steps) in enumerate(traces.groupby("label")):
        grid, best = best_so_far(steps)
        low, middle, high = _quartiles(best)
        axes.fill_between(grid, low, high, color=style.look(i)["color"], alpha=0.2, linewidth=0, step="post")
        axes.step(grid, middle, where="post", label=label, **style.look(i))
    _reference(axes, study.baselines, cell)
    style.plain_log(axes.xaxis)
    label = objective_label(study.runs[study.runs["cell"] == cell], "best", " so far")
    style.name_axes(axes, "evaluations", label, f"{cell}: median, quartiles of seeds")
    style.legend_below(axes, 2 + columns)
    return fig


def best_so_far(steps: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return a grid of evaluations (g,) and each seed's best value there (seeds, g), NaN before the first.

    A run whose answer was not verified has no value at all: its trace is a claim.
    """
    grid = np.unique(steps["evaluations"].to_numpy())
    rows = []
    for _, run in steps.groupby("seed"):
        at = np.searchsorted(run["evaluations"].to_numpy(), grid, side="right") - 1
        best = run["best"].where(run["verified"]).cummax().ffill().to_numpy()
        rows.append(np.where(at >= 0, best[np.maximum(at, 0)], np.nan))
    return grid, np.array(rows)


def _quartiles(best: np.ndarray) -> np.ndarray:
    """Return lower quartile, median and upper quartile over the seeds, shape (3, g).

    A seed without a feasible point yet counts as the worst; where that leaves no value there is NaN.
    """
    filled = np.where(np.isfinite(best), best, -np.inf)
    result = np.quantile(filled, (0.25, 0.5, 0.75), axis=0, method="inverted_cdf")
    result[0] = np.where(np.isfinite(result[0]), result[0], result[np.isfinite(result)].min(initial=np.inf))
    return np.where(np.isfinite(result[1]), result, np.nan)


def objective_label(runs: pd.DataFrame, before: str, after: str = "") -> str:
    """Return what the runs of one cell maximise, with its unit, for an axis.

    Eq. (16) of Pan et al. adds m^6 to m^3, so the unit of length is all there is to say of it.
    """
    readings, over = set(runs["reading"].dropna()), set(runs.get("over_seam", ["mean"]))
    if over != {"mean"}:
        least = "soft least" if over == {"soft_minimum"} else "least"
        before = least if before == "mean" else f"{before} {least}"
    if readings == {"product"}:
        robots = sum(name.startswith("manipulability_mean_") for name in runs.dropna(axis="columns", how="all").columns)
        factors = " ".join(f"w_{i}" for i in range(1, robots + 1)) if robots > 1 else "w"
        return f"{before} ${factors}${after} [m$^{3 * robots}$]"
    return f"{before} MMR{after} [lengths in {'mm' if 'millimetres' in readings else 'm'}]"


def _strip(axes: Axes, place: int, runs: pd.DataFrame, column: str, colour: str) -> None:
    """Draw one solver's runs side by side, unverified ones as crosses, and the median of the verified."""
    offsets = np.linspace(-SPREAD, SPREAD, len(runs)) if len(runs) > 1 else np.zeros(len(runs))
    good = runs["verified"].to_numpy(dtype=bool)
    x, y = place + offsets, runs[column].to_numpy(dtype=float)
    axes.scatter(x[good], y[good], s=13, color=colour, edgecolor=style.INK, linewidth=0.3, zorder=3)
    axes.scatter(x[~good], y[~good], s=16, color=style.RED, marker="x", linewidth=1.0, zorder=4)
    if good.any():
        axes.hlines(np.median(y[good]), place - 0.3, place + 0.3, color=style.INK, linewidth=1.1, zorder=2)


def _solver_axis(axes: Axes, runs: pd.DataFrame, labels: list[str]) -> None:
    counts = runs.groupby("label")["verified"].agg(["sum", "size"])
    # names side by side must not meet
    many = style.columns_for(len(labels)) > 1
    shown = {label: label if many else label.replace("_", "\n").replace(":", ":\n") for label in labels}
    between = " " if many else "\n"
    names = [f"{shown[label]}{between}({counts.loc[label, 'sum']}/{counts.loc[label, 'size']})" for label in labels]
    turned = {"rotation": 40, "ha": "right", "rotation_mode": "anchor"} if many else {}
    axes.set_xticks(range(len(labels)), names, **turned)
    axes.set_xlim(-0.6, len(labels) - 0.4)
    axes.grid(axis="x", visible=False)


def _reference(axes: Axes, baselines: pd.DataFrame, cell: str) -> None:
    """Draw the feasible baselines; a single one is named in the legend, several are named on their lines."""
    own = baselines[(baselines["cell"] == cell) & baselines["feasible"].astype(bool)]
    for _, row in own.iterrows():
        label = row["name"] if len(own) == 1 else None
        axes.axhline(row["objective"], color=style.INK, linestyle=":", linewidth=1.0, label=label)
        if label is None:
            look = {"ha": "right", "va": "bottom", "fontsize": 6.5}
            at = {"xy": (1.0, row["objective"]), "xycoords": ("axes fraction", "data")}
            axes.annotate(row["name"], xytext=(-2, 0), textcoords="offset points", **at, **look)


def _legend_of_marks(axes: Axes, unverified: bool) -> None:
    axes.scatter([], [], s=13, color=style.GREY, edgecolor=style.INK, linewidth=0.3, label="verified run")
    if unverified:
        axes.scatter([], [], s=16, color=style.RED, marker="x", linewidth=1.0, label="not verified")
    axes.plot([], [], color=style.INK, linewidth=1.1, label="median of verified")
    style.legend_below(axes, 2)
