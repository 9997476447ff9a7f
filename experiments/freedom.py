"""What the freedom of a weld is worth: every cell, reduced and redundant, each answer verified along the whole seam.

    python experiments/freedom.py --out results/freedom

What the folder already holds is not run again. The table is drawn from its records.
"""

import sys
from argparse import Namespace
from typing import Any

import numpy as np
import pandas as pd
from common import main, rounded, solved
from rich.console import Console

from nlpweld.bench.progress import StudyProgress
from nlpweld.plan import write_text
from nlpweld.records.model import Record
from nlpweld.report.tables import write_tables

NEAR = 1e-3  # share of the best within which a start counts as having found it


def freedom_table(records: list[Record]) -> pd.DataFrame:
    """Return one row for each cell and formulation: what its best verified answer gives, and how often it is found.

    Columns: cell, formulation, runs, verified, mmr_mean, mmr_min, gain_percent over the cell's best reduced answer,
    joint_step_deg (longest from point to point), found (starts within 0.1 % of the best), solve_s and build_s
    (medians).
    """
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        groups.setdefault((record.cell, record.formulation), []).append(record)
    cells = list(dict.fromkeys(cell for cell, _ in groups))
    ordered = sorted(groups.items(), key=lambda group: cells.index(group[0][0]))  # a cell's rows together
    rows = [{"cell": cell, "formulation": form, **_row(runs)} for (cell, form), runs in ordered]
    columns = ["cell", "formulation", "runs", "verified", "mmr_mean", "mmr_min", "joint_step_deg", "found"]
    table = pd.DataFrame(rows, columns=[*columns, "solve_s", "build_s"])
    plain = table[table.formulation == "reduced"].set_index("cell").mmr_mean
    table.insert(6, "gain_percent", 100 * (table.mmr_mean / table.cell.map(plain) - 1))
    return table


def _row(runs: list[Record]) -> dict[str, Any]:
    """Return what the runs of one cell and formulation gave."""
    good = [r.report for r in runs if r.verified and r.report]
    row: dict[str, Any] = {"runs": len(runs), "verified": len(good)}
    if good:
        best = max(good, key=lambda report: report["mmr_mean"])
        row |= {"mmr_mean": best["mmr_mean"], "mmr_min": best["mmr_min"]}
        row["joint_step_deg"] = float(np.degrees(best["joint_step_rad"]))
        row["found"] = sum(r["mmr_mean"] > (1 - NEAR) * best["mmr_mean"] for r in good)
    ended = [r for r in runs if r.build_s is not None and r.solve_s is not None]
    times = {name: [getattr(r, name) for r in ended] or [np.nan] for name in ("solve_s", "build_s")}
    return row | {name: float(np.median(values)) for name, values in times.items()}


def markdown(table: pd.DataFrame) -> str:
    """Return the table in Markdown."""
    digits = {"mmr_mean": 5, "mmr_min": 5, "gain_percent": 1, "joint_step_deg": 2, "solve_s": 2, "build_s": 2}
    return rounded(table, {**digits, "found": 0})


def study(options: Namespace, console: Console) -> pd.DataFrame:
    """Run what is missing, write the table of freedom, and return the summary."""
    with StudyProgress(console) as watch:
        records = solved("freedom_quick" if options.quick else "freedom", options.out, options.workers, watch)
    table = freedom_table(records)
    write_text(options.out / "tables" / "freedom.csv", table.to_csv(index=False, float_format="%.6g"))
    write_text(options.out / "tables" / "freedom.md", markdown(table))
    console.print(markdown(table))
    return write_tables(options.out)


if __name__ == "__main__":
    sys.exit(main(study, __doc__, "results/freedom"))
