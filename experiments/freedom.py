"""What the freedom of a weld is worth: every cell, reduced and redundant, each answer verified along the whole seam.

    python experiments/freedom.py --out results/freedom

What the folder already holds is not run again. The table is drawn from its records.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from nlpweld.bench.run import grid, run
from nlpweld.bench.task import Task
from nlpweld.cell import load_cell
from nlpweld.errors import NlpweldError
from nlpweld.plan import write_text
from nlpweld.report.tables import write_tables
from nlpweld.solvers import Budget

CELLS = ("three_er16", "dual_welder_positioner", "robot_positioner")
FORMULATIONS = ("reduced", "full", "redundant_spin", "redundant_spin_yaw", "redundant")
WITHOUT_YAW = ("dual_welder_positioner", "robot_positioner")  # a positioner leaves none, so that level is spin's
SOLVER = {"full": "ipopt:full"}
BUDGET = Budget(time_s=180.0)
NEAR = 1e-3  # share of the best within which a start counts as having found it
Record = dict[str, Any]


def tasks(seeds: int, cells: tuple[str, ...] = CELLS, formulations: tuple[str, ...] = FORMULATIONS) -> list[Task]:
    """Return the runs of the study."""
    return [
        task
        for name in cells
        for formulation in formulations
        if not (formulation == "redundant_spin_yaw" and name in WITHOUT_YAW)
        for task in grid([load_cell(name)], [SOLVER.get(formulation, "ipopt")], range(seeds), [formulation], BUDGET)
    ]


def freedom_table(records: list[Record]) -> pd.DataFrame:
    """Return one row for each cell and formulation: what its best verified answer gives, and how often it is found.

    Columns: cell, formulation, runs, verified, mmr_mean, mmr_min, gain_percent over the cell's best reduced answer,
    joint_step_deg (longest from point to point), found (starts within 0.1 % of the best), solve_s and build_s
    (medians).
    """
    rows = []
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        groups.setdefault((record["cell"], record["formulation"]), []).append(record)
    for (cell, formulation), runs in groups.items():
        good = [r["report"] for r in runs if r["verified"]]
        row = {"cell": cell, "formulation": formulation, "runs": len(runs), "verified": len(good)}
        if good:
            best = max(good, key=lambda report: report["mmr_mean"])
            row |= {"mmr_mean": best["mmr_mean"], "mmr_min": best["mmr_min"]}
            row["joint_step_deg"] = float(np.degrees(best["joint_step_rad"]))
            row["found"] = sum(r["mmr_mean"] > (1 - NEAR) * best["mmr_mean"] for r in good)
        for name in ("solve_s", "build_s"):
            row[name] = float(np.median([r[name] for r in runs if name in r] or [np.nan]))
        rows.append(row)
    columns = ["cell", "formulation", "runs", "verified", "mmr_mean", "mmr_min", "joint_step_deg", "found"]
    table = pd.DataFrame(rows, columns=[*columns, "solve_s", "build_s"])
    plain = table[table.formulation == "reduced"].set_index("cell").mmr_mean
    table.insert(6, "gain_percent", 100 * (table.mmr_mean / table.cell.map(plain) - 1))
    return table


def markdown(table: pd.DataFrame) -> str:
    """Return the table in Markdown."""
    shown = table.copy()
    digits = {"mmr_mean": 5, "mmr_min": 5, "gain_percent": 1, "joint_step_deg": 2, "solve_s": 2, "build_s": 2}
    for name, places in digits.items():
        shown[name] = [f"{v:.{places}f}" if np.isfinite(v) else "" for v in table[name]]
    shown["found"] = ["" if pd.isna(v) else f"{v:.0f}" for v in table.found]
    lines = ["| " + " | ".join(shown.columns) + " |", "|" + "---|" * len(shown.columns)]
    return "\n".join([*lines, *("| " + " | ".join(map(str, row)) + " |" for row in shown.to_numpy())]) + "\n"


def study(folder: Path, seeds: int, workers: int, console: Console, **which: Any) -> pd.DataFrame:
    """Run what is missing and return the table, written to the folder's tables."""
    todo = tasks(seeds, **which)
    columns = (TextColumn("{task.description:<58}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task("solving", total=len(todo))

        def told(record: Record, known: bool) -> None:
            what = f"{record['cell']} {record['formulation']} seed {record['seed']}"
            progress.update(bar, advance=1, description=f"{what} {'known' if known else record['status']}")

        records = run(todo, folder, workers, told)
    write_tables(folder)
    table = freedom_table(records)
    write_text(folder / "tables" / "freedom.csv", table.to_csv(index=False, float_format="%.6g"))
    write_text(folder / "tables" / "freedom.md", markdown(table))
    return table


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/freedom"), help="folder of the study")
    parser.add_argument("--seeds", type=int, default=10, help="starts of every formulation")
    parser.add_argument("--workers", type=int, default=1, help="runs at once; times want one")
    chosen = parser.parse_args()
    console = Console(stderr=True)
    try:
        print(markdown(study(chosen.out, chosen.seeds, chosen.workers, console)))
    except NlpweldError as error:
        console.print(f"error: {error}", markup=False, highlight=False)
        sys.exit(2)


if __name__ == "__main__":
    main()
