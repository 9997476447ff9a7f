"""The cooperative workspace, seen: slices of S with MMR, the first constraint that fails, and where solvers went."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

AXES = ("x_m", "y_m", "z_m")
# Light tints under the solvers' marks; hatches tell them apart in grey.
FAILING = {"reach": "#E4E4E4", "joint_limit": "#CFE3F2", "singularity": "#FBE3C0", "clearance": "#F3CFDD"}
HATCHES = {"reach": "", "joint_limit": "////", "singularity": "....", "clearance": "\\\\\\\\"}
KINDS = {"": "slice of S through the optimum", "near_": "slice of S near the optimum"}
PLOT_MM, BELOW_MM = 66.0, 54.0  # width of the map itself; height of title, colour bar and legend
PLANS = ("plans/optimum.json", "plans/paper.json")
PATHS = ("data/ga_individuals.csv", "data/ipopt_path.csv")


def drawings(study: Study) -> list[Drawing]:
    """Return a slice of S across each axis, whole and near the optimum."""
    return [
        Drawing(
            f"map_{kind}{held[0]}",
            partial(slice_of_s, held=held, kind=kind),
            (f"data/map_{kind}{held[0]}.csv", *PLANS, *PATHS),
        )
        for held in AXES
        for kind in KINDS
    ]


def slice_of_s(study: Study, held: str, kind: str) -> Figure:
    """Draw one slice through the optimum, with the GA's individuals and Ipopt's path projected on it."""
    table = study.data(f"map_{kind}{held[0]}")
    across, up = (name for name in AXES if name != held)
    window = [(table[name].min(), table[name].max()) for name in (across, up)]
    height = PLOT_MM * np.ptp(window[1]) / np.ptp(window[0])
    fig = style.figure(min(height, 100.0) + BELOW_MM)
    axes = fig.add_subplot()
    tints(axes, table, across, up)
    mesh = value_mesh(axes, table, across, up)
    fig.colorbar(
        mesh, ax=axes, location="bottom", shrink=0.8, aspect=36, label="mean MMR where feasible [m$^6$ + m$^3$]"
    )
    _marks(axes, study, across, up)
    axes.set_aspect("equal")
    axes.set(xlim=window[0], ylim=window[1])
    axes.grid(visible=False)
    axes.locator_params(nbins=7)
    title = f"{KINDS[kind]}, {held[0]} = {round(table[held].iloc[0], 3) + 0.0:.3f} m"
    style.name_axes(axes, f"{across[0]} of the part [m]", f"{up[0]} of the part [m]", title)
    _legend(fig, axes, table)
    return fig


def _grid(table: pd.DataFrame, across: str, up: str, column: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the two coordinates and a column as a matrix with rows along ``up``."""
    matrix = table.pivot(index=up, columns=across, values=column)
    return matrix.columns.to_numpy(), matrix.index.to_numpy(), matrix.to_numpy()


def tints(axes: Axes, table: pd.DataFrame, across: str, up: str) -> None:
    """Colour and hatch a map by the first constraint that fails."""
    codes = {name: float(i) for i, name in enumerate(FAILING)}
    x, y, code = _grid(table.assign(code=table["first_failing"].map(codes)), across, up, "code")
    colours = ListedColormap(list(FAILING.values()))
    axes.pcolormesh(x, y, code, cmap=colours, vmin=-0.5, vmax=len(codes) - 0.5, shading="nearest", rasterized=True)
    for name, i in codes.items():
        if HATCHES[name] and (code == i).any():
            inside = axes.contourf(
                x, y, (code == i).astype(float), levels=[0.5, 1.5], colors="none", hatches=[HATCHES[name]]
            )
            inside.set_edgecolor("#B5B5B5")
            inside.set_linewidth(0.0)


def value_mesh(axes: Axes, table: pd.DataFrame, across: str, up: str) -> Any:
    """Colour a map by the objective where it is feasible, and return what a colour bar needs."""
    value = table["mmr"].where(table["first_failing"] == "feasible")
    x, y, mmr = _grid(table.assign(value=value), across, up, "value")
    return axes.pcolormesh(x, y, mmr, cmap="viridis", shading="nearest", rasterized=True)


def _marks(axes: Axes, study: Study, across: str, up: str) -> None:
    """Mark the GA's individuals, Ipopt's path, the paper's C and the optimum."""
    swarm, path = study.data("ga_individuals"), study.data("ipopt_path")
    axes.scatter(swarm[across], swarm[up], s=0.8, color=style.INK, alpha=0.35, linewidth=0, rasterized=True)
    axes.plot(path[across], path[up], color="white", linewidth=2.2)
    axes.plot(path[across], path[up], color=style.RED, linewidth=1.1, marker="o", markersize=2.2, label="Ipopt's path")
    names = {"x_m": 0, "y_m": 1, "z_m": 2}
    for plan, marker, size, label in (("paper", "D", 5, "Pan et al. C"), ("optimum", "*", 9, "optimum")):
        p = study.plan(plan).placement_m[[names[across], names[up]]]
        axes.plot(
            *p, marker=marker, markersize=size, color="white", markeredgecolor=style.INK, linestyle="none", label=label
        )


def _legend(fig: Figure, axes: Axes, table: pd.DataFrame) -> None:
    handles, _ = axes.get_legend_handles_labels()
    handles.insert(0, axes.plot([], [], ".", color=style.INK, markersize=3, label="GA's individuals")[0])
    handles += failing_patches(table)
    fig.legend(handles=handles, loc="outside lower center", ncols=2)


def failing_patches(table: pd.DataFrame) -> list[Patch]:
    """Return one legend entry for each constraint that fails first somewhere on a map."""
    present = [name for name in FAILING if (table["first_failing"] == name).any()]
    shared = {"edgecolor": "#B5B5B5", "linewidth": 0}
    return [
        Patch(facecolor=FAILING[n], hatch=HATCHES[n], label=f"fails: {n.replace('_', ' ')}", **shared) for n in present
    ]
