"""The workpiece and its seam: Pan et al., Fig. 5 to 8."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from nlpweld.cell.task import Tee
from nlpweld.report import style
from nlpweld.report.figures import Drawing
from nlpweld.report.study import Study

SEAM, PAPER_PLAN = "data/seam.csv", "plans/paper.json"


def drawings(study: Study) -> list[Drawing]:
    """Return the figures of workpiece and seam."""
    curve = partial(space_curve, frame="C", title="seam in the workpiece frame C")
    flat = partial(space_curve, frame="flat", title="weld points, each turned flat\n(origin of C kept, axes of W)")
    base = partial(space_curve, frame="B", title="weld points in the welder's base frame,\npart at Pan et al. C")
    return [
        Drawing("fig05_tee", tee, (SEAM, PAPER_PLAN)),
        Drawing("fig06_seam_in_C", curve, (SEAM,)),
        Drawing("fig07_flat_weld_points", flat, (SEAM,)),
        Drawing("fig08_weld_points_in_welder_base", base, (SEAM,)),
    ]


def tee(study: Study) -> Figure:
    """Draw both pipes as wires and the seam on them."""
    part, seam = study.plan("paper").cell.workpiece, study.data("seam")
    assert isinstance(part, Tee)
    angle, half = np.linspace(0, 2 * np.pi, 33), part.main_length_m / 2
    fig = style.figure(74)
    axes = style.space(fig, elevation=24, azimuth=-52)
    x, a = np.meshgrid(np.linspace(-half, half, 13), angle)
    main = (x, part.main_radius_m * np.cos(a), part.main_radius_m * np.sin(a))
    axes.plot_wireframe(*main, color=style.GREY, linewidth=0.4, label="main pipe")
    p = seam[["x_C_m", "y_C_m", "z_C_m"]].to_numpy()[::3]
    up = np.linspace(0, 1, 7)[:, None]
    top = p[:, 2] + up * (part.branch_top_m - p[:, 2])
    branch = (p[:, 0] + 0 * up, p[:, 1] + 0 * up, top)
    axes.plot_wireframe(*branch, color=style.BLUE, linewidth=0.4, label="branch")
    axes.plot(seam["x_C_m"], seam["y_C_m"], seam["z_C_m"], color=style.RED, linewidth=2.0, zorder=10, label="seam")
    style.equal_scales(axes)
    axes.yaxis.set_major_locator(FixedLocator([-part.main_radius_m, part.main_radius_m]))
    axes.set_title("pipe tee and its saddle seam", loc="left")
    _name(axes, "C")
    style.legend_below(axes, 3)
    return fig


def space_curve(study: Study, frame: str, title: str) -> Figure:
    """Draw the weld points in one frame, coloured by seam parameter, with their shadow on the lowest plane."""
    table = study.data("seam")
    x, y, z = (table[f"{axis}_{frame}_m"].to_numpy() for axis in "xyz")
    fig = style.figure(80)
    axes = style.space(fig)
    floor = z.min() - 0.25 * np.ptp(z)
    axes.plot(x, y, floor, color=style.GREY, linewidth=0.7)
    axes.plot(x, y, z, color=style.INK, linewidth=0.6)
    dots = axes.scatter(
        x[:-1], y[:-1], z[:-1], c=table["s"][:-1], cmap="viridis", s=9, depthshade=False, vmin=0, vmax=1
    )
    axes.scatter(
        x[:1], y[:1], z[:1], marker="*", s=60, color=style.RED, edgecolor=style.INK, linewidth=0.4, depthshade=False
    )
    fig.colorbar(
        dots, ax=axes, location="bottom", shrink=0.7, aspect=30, pad=0.08, label="seam parameter s [turns], star at 0"
    )
    axes.set_title(title, loc="left")
    axes.set_zlim(bottom=floor)
    _name(axes, {"flat": "W", "B": "B"}.get(frame, "C"))
    return fig


def _name(axes: object, frame: str) -> None:
    for axis in "xyz":
        getattr(axes, f"set_{axis}label")(f"${axis}_{frame}$ [m]")
