"""Plan view of a cell before and after its bases were free to move, from the records of both answers."""

import matplotlib.patches as shape
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from nlpweld.cell import Cell
from nlpweld.formulation.holder import held
from nlpweld.geometry.seam import seam_parameters
from nlpweld.records.model import Record
from nlpweld.report.style import BLUE, GREY, ORANGE, figure, name_axes, pretty

COLUMN_M = 0.2  # radius of a base column as drawn, that of the ER16's body


def draw(cell: Cell, before: Record, after: Record, half_m: float) -> Figure:
    """Return a figure: bases, their way, the boxes they may move in, the workpiece at the first seam point.

    Args:
        cell: the cell as it is stated.
        before: record of the best answer with bases fixed.
        after: record of the best answer with bases free along x and y.
        half_m: how far bases may move each way [m].
    """
    fig = figure(100.0)
    axes = fig.add_subplot()
    for record, colour, name in ((before, GREY, "held"), (after, ORANGE, "free")):
        _work(axes, cell, record, colour)
        mean = (record.report or {})["mmr_mean"]
        axes.plot([], [], color=colour, label=f"workpiece with bases {name}: mean objective {mean:.4f}")
    for station in cell.stations:
        at = after.layout[station.name]
        _base(axes, station.base[:2], np.array([at["x_m"], at["y_m"]]), half_m)
        x, y, _ = station.base
        axes.text(x, y + half_m + 0.08, pretty(station.name), ha="center", fontsize=7)
    axes.plot([], [], "o", color=GREY, markerfacecolor="none", label="base held")
    axes.plot([], [], "o", color=BLUE, alpha=0.3, label="base free; dotted: where its axis may be")
    axes.set_aspect("equal")
    axes.margins(0.06)
    fig.legend(*axes.get_legend_handles_labels(), loc="outside lower center")
    name_axes(axes, "x in m", "y in m")
    return fig


def _base(axes: Axes, start: np.ndarray, end: np.ndarray, half_m: float) -> None:
    """Draw a base column where it was and where it goes, and the box its axis may be in."""
    box = {"facecolor": "none", "edgecolor": BLUE, "linestyle": ":", "linewidth": 0.8}
    axes.add_patch(shape.Rectangle(tuple(start - half_m), 2 * half_m, 2 * half_m, **box))
    axes.add_patch(shape.Circle(tuple(start), COLUMN_M, facecolor="none", edgecolor=GREY))
    axes.add_patch(shape.Circle(tuple(end), COLUMN_M, facecolor=BLUE, alpha=0.3))
    arrow = {"arrowstyle": "-|>", "color": BLUE, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(end), tuple(start), arrowprops=arrow)


def _work(axes: Axes, cell: Cell, record: Record, colour: str) -> None:
    """Draw the outlines of the workpiece's bodies at the first seam point."""
    at = record.placement or {}
    c, s = np.cos(at["yaw_rad"]), np.sin(at["yaw_rad"])
    T_P_C = held(cell, seam_parameters(cell)).T_P_C[0]
    for body in cell.workpiece.bodies:
        ends = np.array([body.start_m, body.end_m]) @ T_P_C[:3, :3].T + T_P_C[:3, 3]
        plan = ends[:, :2] @ np.array([[c, s], [-s, c]]) + [at["x_m"], at["y_m"]]
        axes.add_patch(shape.Polygon(_outline(plan, body.radius_m), facecolor=colour, alpha=0.25, edgecolor=colour))
    axes.plot(at["x_m"], at["y_m"], "+", color=colour)


def _outline(ends: np.ndarray, radius_m: float) -> np.ndarray:
    """Return the outline of a capsule seen from above, ends (2, 2) [m]."""
    angles = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    ring = radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.concatenate([end + ring for end in ends])
    return points[ConvexHull(points).vertices]
