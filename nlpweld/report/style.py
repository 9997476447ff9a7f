"""How every figure looks: printed 85 or 170 mm wide, readable in grey and by colour-blind eyes."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

WIDTH_IN = 85 / 25.4
DPI = 200
LABELS = 0.06  # share of width and height kept for labels of 3-D axes, which the layout does not see
MANY = 500.0  # span of a logarithmic axis from which decades alone are labelled
ZOOM = 1.05  # of 3-D axes, which leave wide margins

# Okabe and Ito's palette, in an order whose greys differ; robots also differ by line style.
BLUE, ORANGE, GREEN, RED, SKY, PURPLE, YELLOW = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#F0E442",
)  # fmt: skip
GREY, INK = "#8C8C8C", "#222222"
SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED)
LINES = ("-", "--", "-.", (0, (1, 1.2)), (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)))

RC: dict[str, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.handlelength": 2.4,
    "legend.borderpad": 0.3,
    "legend.labelspacing": 0.3,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "figure.dpi": DPI,
    "savefig.dpi": DPI,
    "pdf.fonttype": 42,
    "svg.hashsalt": "nlpweld",
}


def figure(height_mm: float = 60.0, columns: int = 1) -> Figure:
    """Return an empty figure, 85 mm wide for each column; tight_layout and the like are not needed."""
    return Figure(figsize=(columns * WIDTH_IN, height_mm / 25.4), layout="constrained")


def columns_for(series: int) -> int:
    """Return how many columns a figure of so many series takes."""
    return 1 if series <= len(SERIES) else 2


def look(i: int) -> dict[str, Any]:
    """Return colour and line style of series i; 36 of them differ in one or both."""
    return {"color": SERIES[i % len(SERIES)], "ls": LINES[(i + i // len(SERIES)) % len(LINES)]}


def space(fig: Figure, elevation: float = 22.0, azimuth: float = -60.0, **where: Any) -> Any:
    """Return 3-D axes with equal scales, metres and a light grid."""
    layout: Any = fig.get_layout_engine()
    layout.set(rect=(0.0, LABELS, 1.0 - LABELS, 1.0 - LABELS))
    axes: Any = fig.add_subplot(projection="3d", **where)
    axes.view_init(elevation, azimuth)
    axes.set_box_aspect(None, zoom=ZOOM)
    axes.tick_params(pad=-2, labelsize=6.5)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
        axis.pane.set_alpha(0.0)
        axis.labelpad = -4
    return axes


def equal_scales(axes: Any, zoom: float = ZOOM) -> None:
    """Give a metre the same length along all three axes, as far as the data goes."""
    limits = [getattr(axes, f"get_{axis}lim")() for axis in "xyz"]
    axes.set_box_aspect([high - low for low, high in limits], zoom=zoom)


def name_axes(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Label both axes, units included, and set a title."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left")


def plain_log(axis: Any) -> None:
    """Label a logarithmic axis, already drawn on, with plain numbers at 1, 2 and 5, or at 1 over many decades."""
    low, high = sorted(axis.get_view_interval())
    few = low > 0 and high / low < MANY
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def legend_below(axes: Axes, columns: int, **options: Any) -> None:
    """Put the legend under the axes, where it hides nothing."""
    fig = axes.figure
    handles, labels = axes.get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=columns, **options)


def pretty(robot: str) -> str:
    """Return a station's name for people."""
    return robot.replace("_", " ")
