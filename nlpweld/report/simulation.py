"""Figures of a simulation, from the time series it left."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nlpweld.errors import OutputError
from nlpweld.report import style
from nlpweld.report.plots import ENDINGS

TIME = "time [s]"
LEAST = 1e-6  # share of the largest error below which none is drawn


def write_simulation(series: str | Path, folder: str | Path, stem: str = "sim") -> list[Path]:
    """Draw errors, grasps and servo torques of a simulation over time and return the files.

    Args:
        series: the Parquet file it left.
        folder: of the figures.
        stem: how the files' names begin.

    Raises:
        OutputError: there is no time series, it lacks a column, or a figure cannot be written.
    """
    from matplotlib import rc_context

    folder, written = Path(folder), []
    try:
        table = pd.read_parquet(series)
        folder.mkdir(parents=True, exist_ok=True)
        with rc_context(style.RC):
            for name, fig in _figures(table).items():
                for ending in ENDINGS:
                    path = folder / f"{stem}_{name}.{ending}"
                    fig.savefig(path, metadata={"CreationDate": None} if ending == "pdf" else None)
                    written.append(path)
    except OSError as error:
        raise OutputError(f"{folder}: {error.strerror or error}; choose another folder, or simulate again") from None
    except KeyError as error:
        raise OutputError(f"{series}: lacks a column ({error.args[0]}); simulate again") from None
    return written


def _figures(table: pd.DataFrame) -> dict[str, Figure]:
    found = {"errors": errors(table), "servos": servos(table)}
    return found | ({"grasps": grasps(table)} if _names(table, "force_n") else {})


def errors(table: pd.DataFrame) -> Figure:
    """Draw torches off the seam, TCPs off the plan and drifts of grasps, on logarithmic axes."""
    drifts = _names(table, "drift_m")
    fig = style.figure(110 if drifts else 80)
    rows = fig.subplots(3 if drifts else 2, 1, sharex=True)
    _lines(rows[0], table, "seam_error_m", 1e3, "off the seam [mm]", "torch against the weld on the workpiece")
    _lines(rows[1], table, "plan_error_m", 1e3, "off the plan [mm]", "TCP against the plan")
    if drifts:
        _lines(rows[2], table, "drift_m", 1e6, "drift [$\\mu$m]", "carrier against its grasp")
    for axes in rows:
        low, high = _most(axes)
        axes.set_yscale("log")
        axes.set_ylim(max(low, LEAST * high), 2 * high)
    rows[-1].set_xlabel(TIME)
    style.legend_below(rows[1], 3)
    return fig


def grasps(table: pd.DataFrame) -> Figure:
    """Draw force and torque at every grasp, and the internal force, over time."""
    fig = style.figure(80)
    force, torque = fig.subplots(2, 1, sharex=True)
    _lines(force, table, "force_n", 1.0, "force [N]", "at the grasps")
    if "squeeze_n" in table:
        force.plot(table["t_s"], table["squeeze_n"], color=style.INK, lw=0.9, ls=":", label="internal force")
    _lines(torque, table, "torque_nm", 1.0, "torque [N m]", "")
    for axes in (force, torque):
        low, high = _most(axes)
        room = 0.1 * (high - low) + 1e-9
        axes.set_ylim(min(0.0, low - room), high + room)
    torque.set_xlabel(TIME)
    style.legend_below(force, 3)
    return fig


def servos(table: pd.DataFrame) -> Figure:
    """Draw the torque of every servo over time, one row for each station or positioner."""
    movers = list(dict.fromkeys(name.split(".")[0] for name in _names(table, "servo_nm")))
    fig = style.figure(35.0 * len(movers) + 15)
    rows = np.atleast_1d(fig.subplots(len(movers), 1, sharex=True))
    for axes, mover in zip(rows, movers, strict=True):
        joints = [name for name in _names(table, "servo_nm") if name.split(".")[0] == mover]
        for i, name in enumerate(joints):
            axes.plot(
                table["t_s"], table[f"servo_nm.{name}"], label=name.split(".")[1], **(style.look(i) | {"lw": 0.9})
            )
        style.name_axes(axes, "", "torque [N m]", style.pretty(mover))
        _shade(axes, table)
    rows[-1].set_xlabel(TIME)
    style.legend_below(max(rows, key=lambda axes: len(axes.lines)), 6, columnspacing=1.0, handlelength=2.0)
    return fig


def _lines(axes: Axes, table: pd.DataFrame, kind: str, scale: float, label: str, title: str) -> None:
    """Draw one quantity of every station that has it."""
    stations = _names(table, "plan_error_m")
    for name in _names(table, kind):
        values = scale * table[f"{kind}.{name}"]
        axes.plot(table["t_s"], values, label=style.pretty(name), **(style.look(stations.index(name)) | {"lw": 0.9}))
    style.name_axes(axes, "", label, title)
    _shade(axes, table)


def _shade(axes: Axes, table: pd.DataFrame) -> None:
    """Shade when torches weld."""
    on = table["t_s"][table["welding"]]
    if len(on):
        axes.axvspan(on.iloc[0], on.iloc[-1], color=style.GREY, alpha=0.12, lw=0)


def _most(axes: Axes) -> tuple[float, float]:
    """Return between what 99.8 % of what is drawn lies: the jolt of the start would flatten the rest."""
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines])
    low, high = np.nanquantile(values, [0.001, 0.999]) if np.isfinite(values).any() else (0.0, 1.0)
    return float(low), float(high)


def _names(table: pd.DataFrame, kind: str) -> list[str]:
    """Return what columns of a kind are about, in order."""
    return [name.partition(".")[2] for name in table.columns if name.partition(".")[0] == kind]
