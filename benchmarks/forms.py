"""Time and peak memory of the formulations against seam points: ``python -m benchmarks.forms``.

Writes results/speed/forms.csv and results/speed/figures/forms.png. Every size runs in a process of its own. What is
timed is Ipopt: a few iterations at one sharpness from one start, build apart, on the fastest engine installed.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import pandas as pd

from benchmarks.ratios import OUT
from benchmarks.scaling import slopes

FORMS = ("reduced", "full", "redundant_spin", "redundant")
POINTS = (36, 72, 144, 288, 576, 1152)
CHILD = "from benchmarks.forms import child; child()"
FEW = {"descents": 1, "sharpenings": 1, "scouts": 16, "max_iter": 12}


def child() -> None:
    """Solve a little in this process and print time, iterations and memory as JSON; arguments: form, points."""
    import resource
    import time

    from nlpweld.bench.answer import formulate
    from nlpweld.cell import load_cell
    from nlpweld.solvers import Budget, make_solver

    form, points = sys.argv[1], int(sys.argv[2])
    cell = load_cell("three_er16").with_(seam={"points": points})
    nlp = formulate(cell, form)
    assert nlp.prepare is not None
    nlp.prepare()
    nlp.starts(0, 4)  # imports what draws starts before the clock runs
    solver = make_solver("ipopt", **FEW)
    began = time.perf_counter()
    outcome = solver.solve(nlp, seed=1, budget=Budget())
    taken = time.perf_counter() - began - outcome.build_s
    iterations = int(outcome.message.split(" iterations")[0].split()[-1])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e6
    found = {"time_s": taken / max(1, iterations), "build_s": outcome.build_s, "iterations": iterations}
    print(json.dumps(found | {"variables": len(nlp.names), "peak_mb": peak, "grown_mb": 0.0}))


def rows(forms: tuple[str, ...], points: tuple[int, ...]) -> list[dict]:
    """Return one row per formulation and number of points; time is that of one iteration."""
    found = []
    for form in forms:
        for count in points:
            command = [sys.executable, "-c", CHILD, form, str(count)]
            for _ in range(2):  # the first may compile
                done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise RuntimeError(f"{form}, {count} points: {done.stderr.strip()[-500:]}")
            row = {"engine": form, "axis": "points", "size": count}
            found.append(row | json.loads(done.stdout.splitlines()[-1]))
    return found


def draw(table: pd.DataFrame, path: Path) -> None:
    """Draw time of an iteration, build time and peak memory over seam points."""
    from matplotlib import rc_context

    from nlpweld.report.style import LINES, RC, SERIES, figure, name_axes, plain_log

    panels = {"time_s": "one iteration (s)", "build_s": "build (s)", "peak_mb": "peak memory (MB)"}
    with rc_context(RC):
        fig = figure(height_mm=150.0)
        axes = fig.subplots(3, 1, sharex=True)
        for ax, (column, label) in zip(axes, panels.items(), strict=True):
            for k, (form, part) in enumerate(table.groupby("engine", sort=False)):
                style = {"color": SERIES[k], "linestyle": LINES[k], "marker": "osv^"[k], "markersize": 3}
                ax.loglog(part["size"], part[column], label=form, **style)
            name_axes(ax, "seam points" if column == "peak_mb" else "", label)
            plain_log(ax.yaxis)
        plain_log(axes[-1].xaxis)
        axes[-1].set_xticks(sorted(table["size"].unique()))
        fig.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
        path.parent.mkdir(parents=True, exist_ok=True)
        fig.savefig(path)


def main(arguments: list[str] | None = None) -> None:
    """Measure, print and write; the command line's arguments by default."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=POINTS[-1], help="seam points at most")
    parser.add_argument("--forms", default=",".join(FORMS), help="formulations")
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the results")
    chosen = parser.parse_args(arguments)
    table = pd.DataFrame(rows(tuple(chosen.forms.split(",")), tuple(n for n in POINTS if n <= chosen.most)))
    chosen.out.mkdir(parents=True, exist_ok=True)
    table.drop(columns=["axis", "grown_mb"]).to_csv(chosen.out / "forms.csv", index=False, float_format="%.4g")
    draw(table, chosen.out / "figures" / "forms.png")
    print(table.to_string(index=False), slopes(table).to_string(index=False), sep="\n\n")


if __name__ == "__main__":
    main()
