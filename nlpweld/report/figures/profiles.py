"""How fast solvers reach verified answers: profiles over a whole study, anytime curves cell by cell."""

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nlpweld.records.frames import contestants
from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study
from nlpweld.stats.targets import GAPS

TARGETS = " and ".join(f"{100 * gap:g} %" for gap in GAPS)
BEST = 1e-6  # regret [%] that everything better is drawn at: a logarithm has no zero


def drawings(study: Study) -> list[Drawing]:
    """Return profiles of the study, where several solvers have runs to compare, and anytime curves of each problem."""
    found = []
    if study.statistics.hits["reached"].any():
        found.append(Drawing("reached_by_time", reached, data=lambda s: s.statistics.reached))
        if study.statistics.times.size and study.statistics.times.shape[1] > 1:
            found.append(Drawing("performance_profile", performance, data=lambda s: s.statistics.performance))
            found.append(Drawing("data_profile", data, data=lambda s: s.statistics.data))
    for cell, formulation in study.statistics.anytime.groupby(["cell", "formulation"]).groups:
        own = partial(_own, cell=cell, formulation=formulation)
        name = f"anytime-{cell}" if formulation == "reduced" else f"anytime-{cell}-{formulation}"
        found.append(Drawing(name, partial(anytime, own=own, title=f"{cell}, {formulation}"), data=own))
    return found


def performance(study: Study) -> Figure:
    """Draw performance profiles (Dolan and More 2002)."""
    return _profile(study.statistics.performance, "ratio", "time over the fastest [1]", "share of problems [1]")


def data(study: Study) -> Figure:
    """Draw data profiles (More and Wild 2009)."""
    return _profile(study.statistics.data, "gradients", "evaluations / (variables + 1) [1]", "share of problems [1]")


def reached(study: Study) -> Figure:
    """Draw the share of runs and targets reached over time."""
    return _profile(study.statistics.reached, "time_s", "build and solve [s]", "share of runs and targets [1]")


def anytime(study: Study, own: partial, title: str) -> Figure:
    """Draw median and quartiles over seeds of the regret of the best verified answer held at a time."""
    curves = own(study)
    curves = curves.assign(label=contestants(curves))
    columns = style.columns_for(curves["label"].nunique())
    fig = style.figure(64, columns)
    axes = fig.add_subplot()
    axes.set_xscale("log")
    axes.set_yscale("log")
    for i, (label, curve) in enumerate(curves.groupby("label")):
        look = style.look(i)
        low, middle, high = (np.maximum(100 * curve[name].to_numpy(), BEST) for name in ("lower", "median", "upper"))
        middle, high = (np.where(np.isfinite(values), values, np.nan) for values in (middle, high))
        axes.step(curve["time_s"], middle, where="post", label=label, **look)
        axes.fill_between(curve["time_s"], low, high, step="post", alpha=0.2, linewidth=0, color=look["color"])
    style.plain_log(axes.xaxis)
    style.plain_log(axes.yaxis)
    style.name_axes(axes, "build and solve [s]", "regret of what is verified [%]", title)
    style.legend_below(axes, 2 + columns)
    return fig


def _own(study: Study, cell: str, formulation: str) -> pd.DataFrame:
    curves = study.statistics.anytime
    return curves[(curves["cell"] == cell) & (curves["formulation"] == formulation)]


def _profile(steps: pd.DataFrame, column: str, x: str, y: str) -> Figure:
    columns = style.columns_for(steps["solver"].nunique())
    fig = style.figure(64, columns)
    axes = fig.add_subplot()
    axes.set_xscale("log")
    for i, (label, own) in enumerate(steps.groupby("solver")):
        own = own[own[column] > 0.0]
        axes.step(own[column], own["share"], where="post", label=label, **style.look(i))
    axes.set_ylim(-0.02, 1.02)
    style.plain_log(axes.xaxis)
    style.name_axes(axes, x, y, f"to a verified answer within {TARGETS}")
    style.legend_below(axes, 2 + columns)
    return fig
