"""Time and peak memory against seam points and candidates: ``python -m benchmarks.scaling``.

Writes results/speed/scaling.csv and results/speed/figures/scaling.png. Every size runs in a process of its own,
because a process's peak memory never comes down.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.contenders import ENGINES, missing
from benchmarks.ratios import OUT

POINTS = (18, 36, 72, 144, 288, 576, 1152)
CANDIDATES = (100, 1_000, 10_000, 100_000)
MANY_POINTS = 128  # candidates, of the set `near`, when points are counted
CHILD = "from benchmarks.scaling import child; child()"


def child() -> None:
    """Evaluate once in this process and print time and memory as JSON; arguments: engine, points, candidates."""
    import resource
    import time

    from benchmarks.candidates import candidates
    from nlpweld.cell import load_cell
    from nlpweld.formulation.batch import Batch

    kind, points, count, group = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    cell = load_cell("three_er16").with_(seam={"points": points})
    batch, X = Batch(cell, engine=kind), candidates(cell, group, count)
    batch.evaluate(candidates(cell, "near", 4))  # compiled before the clock starts
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.perf_counter()
    batch.evaluate(X)
    taken = time.perf_counter() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    unit = 1 if sys.platform == "darwin" else 1024
    print(json.dumps({"time_s": taken, "peak_mb": peak * unit / 1e6, "grown_mb": (peak - before) * unit / 1e6}))


def measure(kind: str, points: int, count: int, group: str) -> dict:
    """Return time and peak memory of one size, measured in a new process."""
    command = [sys.executable, "-c", CHILD, kind, str(points), str(count), group]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{kind}, {points} points, {count} candidates: {done.stderr.strip()}")
    return json.loads(done.stdout.splitlines()[-1])


def rows(most: int) -> list[dict]:
    """Return one row per engine, axis and size, with candidates up to ``most``."""
    found = []
    for name, kind in ENGINES.items():
        if missing(name):
            continue
        sizes = [("points", n, n, MANY_POINTS, "near") for n in POINTS]
        sizes += [("candidates", m, 72, m, "random") for m in CANDIDATES if m <= most]
        for axis, size, points, count, group in sizes:
            if axis == "points" and kind == "numba":
                measure(kind, points, 4, group)  # kernels are compiled for a number of points, once for all processes
            found.append({"engine": kind, "axis": axis, "size": size, "set": group})
            found[-1] |= measure(kind, points, count, group)
    return found


def slopes(table: pd.DataFrame) -> pd.DataFrame:
    """Return the log-log slope of time over each axis, from the upper sizes (the small ones are overhead)."""
    found = []
    for (kind, axis), part in table.groupby(["engine", "axis"]):
        upper = part[part["size"] >= np.median(part["size"])]
        fit = [np.polyfit(np.log(p["size"]), np.log(p["time_s"]), 1)[0] for p in (part, upper)]
        row = {"engine": kind, "axis": axis, "slope": fit[0], "slope_upper": fit[1]}
        found.append(row | {"peak_mb": part.peak_mb.max(), "grown_mb": part.grown_mb.max()})
    return pd.DataFrame(found)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Draw time and peak memory over both axes."""
    from matplotlib import rc_context

    from nlpweld.report.style import LINES, RC, SERIES, figure, name_axes

    with rc_context(RC):
        fig = figure(height_mm=95.0)
        axes = fig.subplots(2, 2, sharex="col", sharey="row")
        for column, axis in enumerate(("points", "candidates")):
            for k, (kind, part) in enumerate(table[table.axis == axis].groupby("engine")):
                style = {
                    "color": SERIES[k],
                    "linestyle": LINES[k],
                    "marker": "os"[k],
                    "markersize": 3,
                    "label": kind,
                }
                axes[0, column].loglog(part["size"], part.time_s, **style)
                axes[1, column].semilogx(part["size"], part.peak_mb, **style)
            name_axes(axes[0, column], "", "time (s)" if column == 0 else "")
            title = "seam points" if axis == "points" else "candidates, 72 points"
            name_axes(axes[1, column], title, "peak memory (MB)" if column == 0 else "")
        _linear(axes[0])
        axes[1, 0].set_ylim(bottom=0)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=3)
        path.parent.mkdir(parents=True, exist_ok=True)
        fig.savefig(path)


def _linear(axes: np.ndarray) -> None:
    """Add a line of slope one to each of the upper axes, through the last point of the first curve."""
    from nlpweld.report.style import GREY

    for ax in axes:
        x, y = ax.lines[0].get_xdata(), ax.lines[0].get_ydata()
        x = np.asarray(x, dtype=float)
        ax.loglog(x, y[-1] * x / x[-1], color=GREY, linewidth=0.8, zorder=0, label="slope 1")


def main(arguments: list[str] | None = None) -> None:
    """Measure, print and write; the command line's arguments by default."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=CANDIDATES[-1], help="candidates at most")
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the results")
    chosen = parser.parse_args(arguments)
    table = pd.DataFrame(rows(chosen.most))
    chosen.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(chosen.out / "scaling.csv", index=False, float_format="%.4g")
    draw(table, chosen.out / "figures" / "scaling.png")
    print(table.to_string(index=False), slopes(table).to_string(index=False), sep="\n\n")


if __name__ == "__main__":
    main()
