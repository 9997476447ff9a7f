"""The reference optimum of every built-in cell: the best verified answer and a proven bound on all others.

    python experiments/reference.py --out results/reference

Cells whose reference is there are left alone; what was interrupted goes on where it was.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from nlpweld.bench.answer import with_branches
from nlpweld.cell import Cell, load_cell
from nlpweld.errors import NlpweldError, ReferenceFileError
from nlpweld.plan import write_text
from nlpweld.reference.find import Effort, find_reference
from nlpweld.reference.find import Progress as Step
from nlpweld.reference.record import Reference, load_reference

# three_er16 last with all its branches, which are 64 modes
CELLS = {"robot_positioner": None, "dual_welder_positioner": None, "three_er16": None, "three_er16-any": "any"}


def known(path: Path, cell: Cell) -> Reference | None:
    """Return the reference of a file, or None where there is none for this version of the cell."""
    try:
        return load_reference(path, cell)
    except ReferenceFileError:
        return None


def table(references: dict[str, Reference]) -> pd.DataFrame:
    """Return one row for each reference."""
    rows = [
        {
            "cell": name,
            "objective": r.objective,
            "with_margins": r.objective_with_margins,
            "upper_bound": r.upper_bound,
            "gap_percent": 100 * r.gap,
            "gap_with_margins_percent": 100 * r.gap_with_margins,
            "boxes": r.boxes,
            "open_boxes": r.open_boxes,
            "placement": " ".join(f"{v:.4f}" for v in r.placement),
        }
        for name, r in references.items()
    ]
    return pd.DataFrame(rows)


def study(folder: Path, names: list[str], effort: Effort, console: Console) -> dict[str, Reference]:
    """Find what is missing and return all references."""
    found = {}
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description:<24}"),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        for name in names:
            cell, path = with_branches(load_cell(name.removesuffix("-any")), CELLS[name]), folder / f"{name}.json"
            reference = known(path, cell)
            bar = progress.add_task(name, note="known" if reference else "", total=None)

            def told(step: Step, bar: int = bar) -> None:
                done = f"{step.done}" if step.total is None else f"{step.done} of {step.total}"
                progress.update(bar, note=f"{step.step} {done} {step.note}")

            if reference is None:
                began = time.perf_counter()
                reference = find_reference(cell, effort, folder / f"{name}.checkpoint.npz", told)
                reference.save(path)
                console.print(f"{name}: {time.perf_counter() - began:.0f} s")
            progress.update(bar, note=f"gap {100 * reference.gap:.3g} %, {reference.boxes} boxes", total=1, completed=1)
            found[name] = reference
    return found


def main() -> None:
    """Find the references from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/reference"), help="folder of the references")
    parser.add_argument("--cells", nargs="+", choices=CELLS, default=list(CELLS), help="which; all by default")
    parser.add_argument(
        "--gap", type=float, default=Effort.gap, help="share of the objective the bound may be above it"
    )
    parser.add_argument("--boxes", type=int, default=Effort.boxes, help="boxes after which a search ends")
    parser.add_argument("--seed", type=int, default=Effort.seed, help="seed of the search for the best answer")
    chosen = parser.parse_args()
    console = Console(stderr=True)
    effort = replace(Effort(), gap=chosen.gap, boxes=chosen.boxes, seed=chosen.seed)
    try:
        found = study(chosen.out, chosen.cells, effort, console)
        write_text(chosen.out / "reference.csv", table(found).to_csv(index=False, float_format="%.9g"))
        print(table(found).to_string(index=False))
    except NlpweldError as error:
        console.print(f"error: {error}", markup=False, highlight=False)
        sys.exit(2)
    except KeyboardInterrupt:
        console.print("interrupted; the same command goes on from here")
        sys.exit(130)


if __name__ == "__main__":
    main()
