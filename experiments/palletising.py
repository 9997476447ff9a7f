"""Table 1 of Cao et al. (2012): 25 boxes before and after, every solver on z_max, and what the totals tell of limits.

    python experiments/palletising.py --out results/palletising

The paper prints no limit of any axis. Those of ``cao_25_boxes`` are calibrated on its two planned totals; this study
reproduces the totals, solves for the limits again on a grid of speeds and jerks, and shows that many others do as well.
Runs of solvers that the folder already holds are not made again.
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import arguments, told
from rich.console import Console

from nlpweld.bench.progress import StudyProgress
from nlpweld.palletising import PalletTask, load_pallet_task, palletize
from nlpweld.palletising.calibration import (
    NAMES,
    SAME_S,
    Grid,
    calibrated,
    combinations,
    limits_of,
    one_way,
    sensitivity,
    walk,
)
from nlpweld.palletising.curves import over_height, velocities
from nlpweld.palletising.nlp import height_nlp
from nlpweld.palletising.totals import solved
from nlpweld.plan import write_text
from nlpweld.report.figures.palletising import drawings
from nlpweld.report.markup import markdown
from nlpweld.report.plots import write
from nlpweld.report.study import Study
from nlpweld.solvers import Budget, make_solver, solver_names

LEFT_OUT = ("multistart",)  # Ipopt again, from more starts, in processes that take longer to begin than to solve
BOXES = (1, 16, 21, 23)  # a wide plateau, a crossing, a narrow plateau, a crossing
BUDGET = Budget(evaluations=2000)
BOX_COLUMNS = ("box", "layer", "swing_s", "reach_s", "wrist_s", "before_s", "after_s", "z_max_m", "z_most_m", "case")
NEAR_S = 1e-6  # what counts as having found the closed form's time
SMALL = Grid((120.0, 145.0), (1.5,), (10.0,), (10.0, 20.0))
SETS = {
    "set 1": {},
    "set 2": {
        "A": {"speed_deg_s": 145.0, "acceleration_deg_s2": 354.0, "jerk_deg_s3": 3540.0},
        "B": {"acceleration_m_s2": 7.26, "jerk_m_s3": 72.6},
    },
    "set 3": {
        "A": {"speed_deg_s": 145.0, "acceleration_deg_s2": 524.0, "jerk_deg_s3": 5240.0},
        "B": {"speed_m_s": 1.2, "acceleration_m_s2": 4.193, "jerk_m_s3": 83.86},
    },
}  # of limits of A and B
WALKS = {"faster": {"A_speed": 1.3, "B_speed": 1.4}, "slower": {"A_speed": 0.9, "B_speed": 0.85}}


def readings(task: PalletTask) -> dict[str, PalletTask]:
    """Return the task, and what the paper leaves open done otherwise, by name."""
    return {
        "set 1, as in the task file": task,
        "set 2": task.with_(axes=SETS["set 2"]),
        "set 3": task.with_(axes=SETS["set 3"]),
        "set 1, one way, v/2 a/4 j/8": one_way(task),
        "set 1, each axis by itself": task.with_(cycle={"synchronised": False}),
        "set 1, pallet's long side along y": task.with_(pallet={"yaw_deg": 90.0}),
        "set 1, along y, turned the other way": task.with_(pallet={"yaw_deg": -90.0}),
        "set 1, places 0.1 m higher": task.with_(stack={"reference_m": 0.1}),
        "set 1, places 0.2 m higher": task.with_(stack={"reference_m": 0.2}),
        "set 1, z_a 1.6 m": task.with_(cycle={"z_a_m": 1.6}),
        "set 1, z_a 3 m": task.with_(cycle={"z_a_m": 3.0}),
        "set 1, boxes picked crosswise": task.with_(pick={"yaw_deg": 90.0}),
    }


def swept(tasks: dict[str, PalletTask], paper_s: tuple[float, float]) -> pd.DataFrame:
    """Return one row a reading: before_s, after_s, saving_percent, and by how much both are off the paper's [%]."""
    rows = []
    for name, task in tasks.items():
        found = palletize(task)
        before, after = found.totals_s["before"], found.totals_s["after"]
        row = {"reading": name, "before_s": before, "after_s": after, "saving_percent": found.saving_percent}
        row |= {
            "before_off_percent": 100 * (before / paper_s[0] - 1),
            "after_off_percent": 100 * (after / paper_s[1] - 1),
        }
        rows.append(row | combinations(task))
    return pd.DataFrame(rows)


def table_1(task: PalletTask) -> pd.DataFrame:
    """Return Table 1 beside what is computed: totals, per box, and saving; the robot's run times are stated facts."""
    assert task.stated is not None
    assert task.stated.run_s is not None
    found, count = palletize(task), len(task.places_m)
    planned, run = np.array(task.stated.planned_s), np.array(task.stated.run_s)
    here = np.array([found.totals_s["before"], found.totals_s["after"]])
    lines = {
        "planned, Cao et al.": planned,
        "planned, here": here,
        "run on the robot, Cao et al.": run,
    }
    rows = [
        {
            "time": name,
            "before_s": t[0],
            "after_s": t[1],
            "saving_percent": 100 * (1 - t[1] / t[0]),
            "before_per_box_s": t[0] / count,
            "after_per_box_s": t[1] / count,
        }
        for name, t in lines.items()
    ]
    for name, t in (("here less planned", here - planned), ("run less planned, Cao et al.", run - planned)):
        per_box = {"before_per_box_s": t[0] / count, "after_per_box_s": t[1] / count}
        rows.append({"time": name, "before_s": t[0], "after_s": t[1], **per_box})
    return pd.DataFrame(rows)


def run_solvers(
    task: PalletTask, boxes: tuple[int, ...], seeds: int, known: pd.DataFrame, told: Callable[[str], object]
) -> pd.DataFrame:
    """Return one row a run of a solver on a box, made here or already known for this very task.

    Columns: task (hash), solver, box (from 1), seed, case, regret_s (of the whole cycle, from the closed form's),
    off_m (z_max from the range of best heights), above_lowest_m, evaluations, solve_s, or skipped, the reason.
    """
    best = palletize(task).boxes
    have = {(r.task, r.solver, r.box, r.seed): r._asdict() for r in known.itertuples(index=False)}
    rows = []
    for solver in solver_names():
        for box in boxes if solver not in LEFT_OUT else ():
            for seed in range(seeds):
                key = (task.content_hash, solver, box, seed)
                row = dict(zip(("task", "solver", "box", "seed"), key, strict=True))
                rows.append(have[key] if key in have else row | _run(task, solver, box, seed, best.loc[box - 1]))
                told(f"{solver} on box {box}, seed {seed}")
    return pd.DataFrame(rows)


def _run(task: PalletTask, solver: str, box: int, seed: int, best: pd.Series) -> dict[str, Any]:
    made = make_solver(solver)
    reason = made.unsuitable(height_nlp(task, box - 1))
    if reason:
        return {"skipped": reason}
    found = solved(task, box - 1, made, seed, BUDGET)
    z = found["solver_z_m"]
    off = max(best.z_max_m - z, z - best.z_most_m, 0.0)
    row = {"case": best.case, "regret_s": found["solver_s"] - best.after_s, "off_m": off}
    return row | {"above_lowest_m": z - best.z_max_m, **{name: found[name] for name in ("evaluations", "solve_s")}}


def solver_table(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row a solver: runs, how many are within 1e-6 s, regret, distances, and what a run took."""
    rows = []
    for solver, own in runs[runs.regret_s.notna()].groupby("solver"):
        regret = own.regret_s.clip(lower=0.0)
        row: dict[str, Any] = {"solver": solver, "runs": len(own), "within 1e-6 s": int((regret <= NEAR_S).sum())}
        row |= {
            "median_regret_s": regret.median(),
            "worst_regret_s": regret.max(),
            "worst_off_mm": 1e3 * own.off_m.max(),
        }
        row |= {
            "least_above_lowest_mm": 1e3 * own.above_lowest_m.min(),
            "most_above_lowest_mm": 1e3 * own.above_lowest_m.max(),
        }
        rows.append(row | {"evaluations": own.evaluations.mean(), "solve_s": own.solve_s.median()})
    return pd.DataFrame(rows).sort_values(["worst_regret_s", "solver"], ignore_index=True)


def identifiable(task: PalletTask) -> pd.DataFrame:
    """Return the slopes of both totals in the logarithm of every limit, and their singular directions.

    Rows: limits by name, then singular values; columns: limit, before_s, after_s, direction_1, direction_2.
    """
    slopes = sensitivity(task)
    _, values, directions = np.linalg.svd(slopes)
    columns = {"limit": NAMES, "value": limits_of(task), "before_s": slopes[0], "after_s": slopes[1]}
    table = pd.DataFrame({**columns, "direction_1": directions[0], "direction_2": directions[1]})
    table.loc[len(table)] = ["singular value", np.nan, np.nan, np.nan, *values]
    return table


def walks(task: PalletTask, steps: int) -> pd.DataFrame:
    """Return walks along limits that keep both totals, one after the other."""
    parts = [walk(task, factors, steps).assign(walk=name, step=range(steps + 1)) for name, factors in WALKS.items()]
    return pd.concat(parts, ignore_index=True)


def study(
    folder: Path, seeds: int, console: Console, quick: bool = False, figures: bool = True
) -> dict[str, pd.DataFrame]:
    """Make all tables, write them with their figures, and return them by name."""
    task = load_pallet_task()
    assert task.stated is not None
    planned = task.stated.planned_s
    boxes = BOXES[:2] if quick else BOXES
    grid = SMALL if quick else Grid()
    file = folder / "data" / "runs.csv"
    known = pd.read_csv(file, dtype={"task": str}) if file.is_file() else pd.DataFrame()
    found: dict[str, pd.DataFrame] = {}
    with StudyProgress(console) as watch:
        names = [name for name in solver_names() if name not in LEFT_OUT]
        bar = watch.bar.add_task("solvers on z_max", total=len(names) * len(boxes) * seeds)
        found["runs"] = run_solvers(
            task, boxes, seeds, known, lambda what: watch.bar.update(bar, advance=1, description=what)
        )
        steps: list[tuple[str, Callable[[], pd.DataFrame]]] = [
            ("table_1", lambda: table_1(task)),
            ("boxes", lambda: palletize(task).boxes),
            ("readings", lambda: swept(readings(task), planned)),
            ("grid", lambda: calibrated(task, planned, grid)),
            ("identifiable", lambda: identifiable(task)),
            ("walks", lambda: walks(task, 2 if quick else 10)),
            ("velocities", lambda: velocities(task, BOXES[1] - 1, float(_best(task, BOXES[1]).z_max_m))),
            ("stages", lambda: pd.concat([over_height(task, b - 1).assign(box=b) for b in BOXES[:2]])),
        ]
        bar = watch.bar.add_task("tables", total=len(steps))
        for name, make in steps:
            watch.bar.update(bar, description=name)
            found[name] = make()
            watch.bar.advance(bar)
    for name, table in found.items():
        write_text(folder / "data" / f"{name}.csv", table.to_csv(index=False, float_format="%.12g"))
    write_text(folder / "tables" / "palletising.md", report(found))
    stored = Study(folder)
    for drawing in drawings(stored) if figures else ():
        write(drawing, stored)
    return found


def _best(task: PalletTask, box: int) -> pd.Series:
    return palletize(task).boxes.loc[box - 1]


def report(found: dict[str, pd.DataFrame]) -> str:
    """Return all tables in Markdown, each under a line that says what it is."""
    grid, walked = found["grid"], found["walks"]
    good, axes = grid[grid.solved], list(NAMES[:6])
    kept = (walked.groupby("walk")[["before_s", "after_s"]].agg(np.ptp)).to_numpy().max()
    ranges = pd.DataFrame({"limit": axes, "least": good[axes].min().to_numpy(), "most": good[axes].max().to_numpy()})
    ends = walked.groupby("walk", sort=False).tail(1)
    skipped = found["runs"].get("skipped", pd.Series(dtype=object)).dropna()
    parts = [
        "# Palletising: Table 1 of Cao et al. (2012)\n\nTotals of 25 boxes. Limits of the axes are calibrated.\n",
        _text(found["table_1"], 3),
        "\nThe robot's own run takes some 0.2 s a box longer than planned, before and after alike.\n"
        "\n## Box by box\n\nTimes of A, C and D on one leg, of the cycle there and back, and the lowest and highest "
        "best z_max.\n",
        _text(found["boxes"][list(BOX_COLUMNS)], 4),
        "\n## Every solver on z_max\n\nRegret is the time of a box's whole cycle over the closed form's. Best heights "
        "are a range on a plateau: `worst_off_mm` counts from that range, the last distances from its lowest height.\n",
        _text(solver_table(found["runs"]), 4),
        *(f"\nSkipped: {reason}\n" for reason in skipped.unique()),
        "\n## What the paper leaves open\n",
        _text(found["readings"], 4),
        f"\n## Calibration\n\n{len(good)} of {len(grid)} combinations of speeds and jerk over acceleration have "
        f"accelerations of A and B under which both planned totals come out within {SAME_S:g} s:\n",
        _text(ranges, 5),
        "\n## What two totals identify\n\nSlopes of both totals [s] in the logarithm of each limit, and the two "
        "directions they hold; ten of twelve are free. C and D are never the slowest.\n",
        _text(found["identifiable"], 4),
        f"\nLimits at the ends of two walks that keep both totals within {kept:.1g} s:\n",
        _text(ends[["walk", *axes, "before_s", "after_s"]], 6),
    ]
    return "".join(parts)


def _text(table: pd.DataFrame, digits: int) -> str:
    """Return a table in Markdown, numbers with so many digits after the point, small ones as powers of ten."""

    def shown(value: Any) -> str:
        if isinstance(value, str):
            return value
        if pd.isna(value):
            return ""
        if float(value) == round(float(value)) and abs(value) < 1e6:
            return f"{value:.0f}"
        return f"{value:.2g}" if abs(value) < 10.0**-digits else f"{value:.{digits}f}"

    return "\n" + markdown(table.map(shown))


def main() -> int:
    """Run the study from the command line."""
    parser = arguments(__doc__, "results/palletising")
    parser.add_argument("--seeds", type=int, default=5, help="seeds of every solver")
    parser.add_argument("--quick", action="store_true", help="two boxes, a small grid: to see that it works")
    parser.add_argument("--no-figures", action="store_true", help="stop after data and tables")

    def text(chosen: argparse.Namespace, console: Console) -> str:
        return report(study(chosen.out, chosen.seeds, console, chosen.quick, not chosen.no_figures))

    return told(parser, text)


if __name__ == "__main__":
    sys.exit(main())
