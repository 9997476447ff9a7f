"""Velocity ellipsoids of the robots and what they have in common: Pan et al., Fig. 3."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

SCALE_M = 0.12  # length drawn for 1 m/s, with joint speeds in the unit ball, where ellipsoids sit at their robots
WIRES = {"rcount": 12, "ccount": 8}
CORES = [f"core_{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]


def drawings(study: Study) -> list[Drawing]:
    """Return the ellipsoids at one centre, and at their robots."""
    return [
        Drawing("fig03a_ellipsoids_common", at_one_centre, ("data/ellipsoids.csv",)),
        Drawing("fig03b_ellipsoids_at_robots", at_robots, ("data/ellipsoids.csv", "data/arms.csv")),
    ]


def at_one_centre(study: Study) -> Figure:
    """Draw all ellipsoids moved to one centre as wires and their common volume as a body."""
    table = study.data("ellipsoids")
    fig = style.figure(84)
    axes = style.space(fig, elevation=20, azimuth=-55)
    u = directions(48, 24)
    radii = [radius(core, u) for core in cores(table)]
    axes.plot_surface(*(np.min(radii, axis=0) * u), color=style.GREY, alpha=0.75, linewidth=0, shade=True)
    for i, (rho, row) in enumerate(zip(radii, table.itertuples(), strict=True)):
        label = f"{style.pretty(row.robot)}, r = {row.ratio:.2f}"
        axes.plot_wireframe(*(rho * u), color=style.SERIES[i], linewidth=0.6, label=label, **WIRES)
    axes.plot([], [], [], color=style.GREY, linewidth=5, label="common volume")
    style.equal_scales(axes)
    for axis in "xyz":
        getattr(axes, f"set_{axis}label")(f"$v_{axis}$ [m/s]")
    axes.set_title(
        f"velocity ellipsoids at the optimum, s = {table['s'].iloc[0]:g}\n(joint speeds in the unit ball, rad/s)",
        loc="left",
    )
    style.legend_below(axes, 2)
    return fig


def at_robots(study: Study) -> Figure:
    """Draw the robots as sticks at one seam point with each ellipsoid, scaled down, at its TCP."""
    table, arms = study.data("ellipsoids"), study.data("arms")
    fig = style.figure(84)
    axes = style.space(fig, elevation=26, azimuth=-62)
    u = directions(48, 24)
    for name, part in arms[~arms["robot"].isin(table["robot"])].groupby("robot"):
        ends = part[["x_m", "y_m", "z_m"]].to_numpy()
        axes.plot(*ends.T, color=style.GREY, linewidth=5 if name == "main_pipe" else 3, alpha=0.6)
    for i, (core, row) in enumerate(zip(cores(table), table.itertuples(), strict=True)):
        arm = arms[arms["robot"] == row.robot]
        _stick(axes, arm, style.SERIES[i], style.pretty(row.robot))
        body = SCALE_M * radius(core, u) * u + np.array([row.x_m, row.y_m, row.z_m])[:, None, None]
        axes.plot_wireframe(*body, color=style.SERIES[i], linewidth=0.4, **WIRES)
    style.equal_scales(axes)
    for axis in "xyz":
        getattr(axes, f"set_{axis}label")(f"${axis}_W$ [m]")
    axes.set_title(
        f"ellipsoids at the TCPs, optimum, s = {table['s'].iloc[0]:g}\n({SCALE_M:g} m drawn for 1 m/s)", loc="left"
    )
    style.legend_below(axes, 3)
    return fig


def cores(table: pd.DataFrame) -> np.ndarray:
    """Return J_v J_v^T of each row, shape (robots, 3, 3) [m^2/rad^2]."""
    return table[CORES].to_numpy().reshape(-1, 3, 3)


def radius(core: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the ellipsoid's extent (u^T core^-1 u)^(-1/2) along directions u (3, ...), shape (...)."""
    return np.einsum("i...,ij,j...->...", u, np.linalg.inv(core), u) ** -0.5


def directions(around: int, down: int) -> np.ndarray:
    """Return unit vectors on a grid over the sphere, shape (3, around + 1, down + 1)."""
    azimuth, polar = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, np.pi, down + 1), indexing="ij")
    return np.stack([np.cos(azimuth) * np.sin(polar), np.sin(azimuth) * np.sin(polar), np.cos(polar)])


def _stick(axes: Any, arm: pd.DataFrame, colour: str, label: str) -> None:
    p = arm.sort_values("link")[["x_m", "y_m", "z_m"]].to_numpy()
    axes.plot(*p.T, color=colour, linewidth=2.2, marker="o", markersize=3, label=label, solid_capstyle="round")
    axes.scatter(*p[0], color=colour, marker="s", s=22, depthshade=False)
