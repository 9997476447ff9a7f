"""A timed plan over its cycle: the torch's speed, and how much of their speed limits the joints use."""

import io
from itertools import pairwise

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlpweld.plan import Plan
from nlpweld.report import style
from nlpweld.timeline import Timeline

SAMPLES = 4000
LEAST = 0.01  # [% of limit], where the axis begins
SHADES = ("#EDEDED", "#FFFFFF")


def png(plan: Plan, torch_speed: np.ndarray) -> bytes:
    """Return the figure of :func:`timeline` as a PNG file."""
    buffer = io.BytesIO()
    with matplotlib.rc_context(style.RC):
        timeline(plan, torch_speed).savefig(buffer, format="png")
    return buffer.getvalue()


def timeline(plan: Plan, torch_speed: np.ndarray) -> Figure:
    """Draw the torch's speed, and below it, for everything that moves, the joint whose speed is nearest its limit.

    Args:
        plan: a timed plan.
        torch_speed: instants [s] and speeds [m/s] along the seam, as the verifier found them, shape (2, K).

    Raises:
        PlanError: the plan is not timed.
    """
    line = plan.needed_timeline
    t = np.unique(np.concatenate([np.linspace(0, line.duration_s, SAMPLES), line.t_s]))
    fig = style.figure(110, columns=2)
    upper, lower = fig.subplots(2, 1, sharex=True, height_ratios=(1, 2))
    upper.plot(torch_speed[0], 1e3 * torch_speed[1], color=style.INK)
    style.name_axes(upper, "", "torch speed [mm/s]", f"{plan.cell.name}: cycle {t[-1]:.2f} s")
    rates = line.at(t, 1)
    for i, (name, limits) in enumerate(_speed_limits(plan).items()):
        used = 100 * np.abs(rates[name]) / limits
        lower.plot(t, np.maximum(used.max(axis=1), LEAST), label=style.pretty(name), **style.look(i))
    style.name_axes(lower, "time [s]", "joint speed [% of limit]", "the joint of each robot that is nearest its limit")
    lower.set_yscale("log")
    lower.set_ylim(LEAST, 120.0)
    upper.set_ylim(bottom=0)
    for axes in (upper, lower):
        _shade(axes, line)
    lower.set_xlim(0, float(t[-1]))
    style.legend_below(lower, 4)
    return fig


def _speed_limits(plan: Plan) -> dict[str, np.ndarray]:
    """Return the speed limits of all joints by name, each of shape (n,) [rad/s]."""
    robots = {station.name: station.robot for station in plan.cell.stations}
    robots |= {plan.cell.positioner.name: plan.cell.positioner.robot} if plan.cell.positioner else {}
    return {name: robot.drive_limits[0] for name, robot in robots.items()}


def _shade(axes: Axes, timeline_: Timeline) -> None:
    """Shade every other phase, and name those that are wide enough."""
    ends = [0.0, *(until for _, until in timeline_.phases)]
    for k, ((begin, end), (name, _)) in enumerate(zip(pairwise(ends), timeline_.phases, strict=True)):
        axes.axvspan(begin, end, color=SHADES[k % 2], lw=0, zorder=0)
        if end - begin > 0.1 * timeline_.duration_s:
            axes.text(
                (begin + end) / 2, 0.97, name, transform=axes.get_xaxis_transform(), ha="center", va="top", fontsize=7
            )
