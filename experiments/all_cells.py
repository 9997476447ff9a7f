"""Every solver on every built-in cell, measured by its distance to the reference optimum, each answer verified.

    python experiments/all_cells.py --out results/all_cells

What the folder already holds is not run again. References are those of results/reference; one that was built for
another version of a cell is refused, and so is an answer above its bound.
"""

import sys
from argparse import Namespace
from pathlib import Path

import pandas as pd
from common import main, solved, work
from rich.console import Console

from nlpweld.bench.progress import StudyProgress
from nlpweld.cell import load_cell
from nlpweld.plan import write_text
from nlpweld.records.model import Record
from nlpweld.reference.record import Reference, load_reference, regret
from nlpweld.report.page import write_page
from nlpweld.report.tables import write_tables

REFERENCES = Path(__file__).parents[1] / "results" / "reference"


def references(cells: list[str], folder: Path = REFERENCES) -> dict[str, Reference]:
    """Return the reference of each cell.

    Raises:
        ReferenceFileError: one is missing, or was built for another version of its cell.
    """
    return {name: load_reference(folder / f"{name}.json", load_cell(name)) for name in cells}


def reference_table(known: dict[str, Reference], records: list[Record]) -> pd.DataFrame:
    """Return one row for each reference: its objective, its bound, and how far the best of all runs is below both.

    Raises:
        ReferenceFileError: a verified answer is above the bound.
    """
    rows = []
    for name, reference in known.items():
        values = [r.report["objective"] for r in records if r.cell == name and r.verified and r.report]
        best = max(values, default=float("nan"))
        for value in values:
            regret(value, reference)
        row = {"cell": name, "mmr_mean": reference.objective, "upper_bound": reference.upper_bound}
        row |= {"gap_percent": 100 * reference.gap, "best_of_runs": best}
        rows.append(row | {"best_regret_percent": 100 * (1 - best / reference.objective)})
    return pd.DataFrame(rows)


def study(options: Namespace, console: Console) -> pd.DataFrame:
    """Run what is missing, write tables, figures and page, and return the summary."""
    folder = options.out
    with StudyProgress(console) as watch:
        records = solved("all_cells_quick" if options.quick else "all_cells", folder, options.workers, watch)
        known = references(list(dict.fromkeys(record.cell for record in records)))
        table = reference_table(known, records)
        write_text(folder / "data" / "reference.csv", table.to_csv(index=False, float_format="%.9g"))
        steps = [("tables", lambda: write_tables(folder))]
        if not options.no_figures:
            steps.append(("page", lambda: write_page(folder)))
        work(steps, watch, "tables and page")
    console.print(table.to_string(index=False))
    return write_tables(folder)


if __name__ == "__main__":
    sys.exit(main(study, __doc__, "results/all_cells"))
