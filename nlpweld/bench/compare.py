"""The grid for people: cells and solvers in, a table of verified runs out."""

import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nlpweld.bench.run import Progress, grid, run
from nlpweld.cell import Cell
from nlpweld.solvers import Budget

if TYPE_CHECKING:
    import pandas as pd


def compare(
    cells: Cell | Sequence[Cell],
    solvers: Sequence[str],
    seeds: int | Iterable[int] = 1,
    *,
    formulations: Sequence[str] = ("reduced",),
    budget: Budget | None = None,
    out: str | Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> "pd.DataFrame":
    """Run every solver on every cell for every seed, verify each answer, and return one row a run.

    Args:
        cells: one cell or several.
        solvers: names, each with an optional preset as ``name:preset``.
        seeds: how many seeds, counted from 0, or the seeds themselves.
        formulations: names of formulations.
        budget: limits of each run.
        out: folder of the study, which resumes what it already holds; without one, records are not kept.
        workers: runs under way at once.
        progress: called with each record and whether it was already there.

    Raises:
        OptionError: an unknown solver or preset.
        OutputError: the folder cannot be written.
    """
    import pandas as pd

    several = [cells] if isinstance(cells, Cell) else list(cells)
    tasks = grid(several, solvers, range(seeds) if isinstance(seeds, int) else seeds, formulations, budget)
    if out is not None:
        return pd.DataFrame([row(r) for r in run(tasks, Path(out), workers, progress)])
    with tempfile.TemporaryDirectory() as folder:
        return pd.DataFrame([row(r) for r in run(tasks, Path(folder), workers, progress)])


def row(record: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one record; MMR is the verifier's, and only of verified answers."""
    report = record.get("report") or {}
    head = {key: record[key] for key in ("cell", "formulation", "solver", "preset", "seed", "status", "verified")}
    place = record.get("placement") or {}
    return {
        **head,
        "mmr_mean": report.get("mmr_mean") if record["verified"] else None,
        "claimed_objective": record.get("claimed_objective"),
        **place,
        "evaluations": record.get("evaluations"),
        "build_s": record.get("build_s"),
        "solve_s": record.get("solve_s"),
        "message": record["message"],
    }
