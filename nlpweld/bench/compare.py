"""The grid for people: cells and solvers in, a table of verified runs out."""

import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from nlpweld.bench.engines import engine_of
from nlpweld.bench.run import Watcher, grid, run
from nlpweld.cell import Cell
from nlpweld.records.model import Record
from nlpweld.solvers import Budget

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = (
    "cell", "formulation", "solver", "preset", "seed", "status", "verified", "objective", "mmr_mean",
    "claimed_objective", "evaluations", "build_s", "solve_s",
)  # fmt: skip
PLACED = ("x_m", "y_m", "z_m", "yaw_rad")


def compare(
    cells: Cell | Sequence[Cell],
    solvers: Sequence[str],
    seeds: int | Iterable[int] = 1,
    *,
    formulations: Sequence[str] = ("reduced",),
    budget: Budget | None = None,
    out: str | Path | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    watch: Watcher | None = None,
) -> "pd.DataFrame":
    """Run every solver on every cell for every seed, verify each answer, and return one row a run.

    Args:
        cells: one cell or several.
        solvers: names, each with an optional preset as ``name:preset``.
        seeds: how many seeds, counted from 0, or the seeds themselves.
        formulations: names of formulations.
        budget: limits of each run.
        out: folder of the study, which resumes what it already holds; without one, records are not kept.
        workers: runs under way at once; runtime tables want one.
        scheduler: address of a Dask scheduler that has the workers instead, or ``local``.
        watch: told of each record as it arrives.

    Raises:
        OptionError: an unknown solver or preset, or no scheduler there.
        OutputError: the folder cannot be written.
    """
    several = [cells] if isinstance(cells, Cell) else list(cells)
    tasks = grid(several, solvers, range(seeds) if isinstance(seeds, int) else seeds, formulations, budget)
    engine = engine_of(workers, scheduler)
    if out is not None:
        return table(run(tasks, Path(out), engine, watch))
    with tempfile.TemporaryDirectory() as folder:
        return table(run(tasks, Path(folder), engine, watch))


def table(records: Iterable[Record]) -> "pd.DataFrame":
    """Return one row a run; objective and mean MMR are the verifier's, of verified answers."""
    from nlpweld.records.frames import runs_frame

    found = runs_frame(records)
    for name in ("objective", "mmr_mean"):
        found[name] = found[name].where(found["verified"])
    return found[[*COLUMNS, *(name for name in found.columns if name.endswith(PLACED)), "message"]]
