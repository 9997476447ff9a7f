"""The study of Zhang et al. from start to end: a positioner and one or two robots, runs, tables and figures.

    python experiments/reproduce_positioner.py --out results/positioner

What the folder already holds is not run again.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from positioner_data import along, at_breaks, dense, dense_plan, frame_table, weld_position_table
from positioner_search import box_grid, placement_map, sampled_optimum
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from nlpweld.bench.answer import evaluate_plan
from nlpweld.bench.run import grid, run
from nlpweld.bench.task import Task
from nlpweld.cell import Cell, load_cell
from nlpweld.errors import NlpweldError
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import reduced
from nlpweld.geometry.seam import seam_parameters
from nlpweld.plan import write_text
from nlpweld.report.plots import write_plots
from nlpweld.report.records import AXES
from nlpweld.report.tables import format_summary, write_tables
from nlpweld.solvers import Budget
from nlpweld.verify import Report

DUAL, SINGLE = "dual_welder_positioner", "robot_positioner"
BASELINES = {DUAL: {name: f"Zhang et al. {name}" for name in "ABCD"}, SINGLE: {"nominal": "nominal"}}
WATCHED = "robot_2"  # whose joint speeds Zhang et al. show in Fig. 9
NEAR_M, NEAR_POINTS = 0.05, 41  # half a side of the map near the optimum, at least, and points along a side
NOTE = "best of a grid, polished from its best few points: sampled, not a rigorous bound"
Record = dict[str, Any]
Step = tuple[str, Callable[[], object]]
Shared = dict[str, list[pd.DataFrame]]


@dataclass(frozen=True)
class Size:
    """How much of the study is done.

    Attributes:
        seeds: by solver, how many.
        evaluations: budget of each population run.
        grid_m: step of the grid behind the reference optimum.
        map_m: step of the maps over the whole box.
        dense: seam points where speeds are taken.
    """

    seeds: dict[str, int]
    evaluations: int
    grid_m: float
    map_m: float
    dense: int


# A population of 50 for 40 generations is ample for two variables: the paper cell's 100 generations are for three.
FULL = Size(dict.fromkeys(("ipopt", "ipopt:plain", "ga", "ga:paper", "random_search"), 5), 2000, 0.01, 0.02, 721)
QUICK = Size({"ipopt:plain": 1, "ga": 1, "random_search": 1}, 200, 0.1, 0.1, 145)


def tasks(cells: list[Cell], size: Size) -> list[Task]:
    """Return the runs of the study."""
    found: list[Task] = []
    for solver, seeds in size.seeds.items():
        evaluations = None if solver.startswith("ipopt") else size.evaluations
        found += grid(cells, [solver], range(seeds), budget=Budget(time_s=300.0, evaluations=evaluations))
    return found


@dataclass(frozen=True)
class OneCell:
    """What tables and figures of one cell are made from, step by step below the study's folder."""

    folder: Path
    cell: Cell
    size: Size
    records: list[Record]
    shared: Shared

    @cached_property
    def nlp(self) -> Nlp:
        """The reduced form."""
        return reduced(self.cell)

    def steps(self) -> Iterator[Step]:
        """Yield name and work of every step."""
        for placement, name in BASELINES[self.cell.name].items():
            yield f"{self.cell.name}: {name}", lambda p=placement, n=name: self._baseline(p, n)
        yield f"{self.cell.name}: reference", self._reference
        yield f"{self.cell.name}: along the seam", self._along

    def _baseline(self, placement: str, name: str) -> None:
        at = self.cell.placements[placement]
        plan, report = evaluate_plan(self.nlp, self.cell.coordinates(np.array(at)))
        baseline = {"name": name, "cell": self.cell.name, "placement": list(at), "report": report.to_json()}
        write_text(self.folder / "baselines" / f"{placement}.json", json.dumps(baseline, indent=1) + "\n")
        if plan:
            plan.save(self.folder / "plans" / f"{placement}.json")
            if placement == next(iter(BASELINES[self.cell.name])):
                self._share("weld_positions", weld_position_table(plan, placement))

    def _reference(self) -> None:
        best = sampled_optimum(self.nlp, self.size.grid_m)
        plan, report = evaluate_plan(self.nlp, best.x, best.mode)
        if plan:
            plan.save(self.folder / "plans" / f"reference-{self.cell.name}.json")
        facts = {"grid_step_m": self.size.grid_m, "grid_points": best.grid_points, "grid_best": best.grid_best}
        facts |= {"feasible_share": best.feasible_share, "polish_evaluations": best.polish_evaluations}
        row = {"cell": self.cell.name, **dict(zip(AXES, report.at, strict=True)), **_told(report), **facts}
        self._share("reference", pd.DataFrame([row | {"note": NOTE}]))
        whole = box_grid(self.nlp.lower, self.nlp.upper, self.size.map_m)
        csv(self.folder, f"map-{self.cell.name}", placement_map(self.nlp, self.cell, whole))
        csv(self.folder, f"map_near-{self.cell.name}", placement_map(self.nlp, self.cell, self._near(best.x)))

    def _share(self, name: str, table: pd.DataFrame) -> None:
        self.shared.setdefault(name, []).append(table)

    def _near(self, x: np.ndarray) -> np.ndarray:
        """Return a grid about the reference, wide enough for every verified answer of the solvers."""
        own = [r["placement"] for r in self.records if r["cell"] == self.cell.name and r["verified"]]
        answers = np.array([[place[name] for name in self.nlp.names] for place in own] or [x])
        half = max(1.1 * np.abs(answers - x).max(), NEAR_M)
        low, high = np.maximum(x - half, self.nlp.lower), np.minimum(x + half, self.nlp.upper)
        axes = [np.linspace(lo, hi, NEAR_POINTS) for lo, hi in zip(low, high, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))

    def _along(self) -> None:
        fine, names = dense(self.cell, self.size.dense), list(BASELINES[self.cell.name])
        plans = {name: dense_plan(fine, self.cell.placements[name]) for name in names}
        assert fine.positioner is not None
        table = along(plans[names[0]], fine.positioner.name, "theta")
        s = seam_parameters(self.cell)
        whole = np.append(s, 1.0) if self.cell.seam.closed else s
        csv(self.folder, f"frames-{fine.name}", frame_table(self.cell, whole))
        csv(self.folder, f"table_angles-{fine.name}", table)
        if any(station.name == WATCHED for station in fine.stations):
            speeds = {name: along(plan, WATCHED, "J") for name, plan in plans.items()}
            csv(self.folder, "speeds", stacked(speeds))
            csv(self.folder, "speed_breaks", stacked({name: at_breaks(t, fine) for name, t in speeds.items()}))


def _told(report: Report) -> dict[str, Any]:
    return {"mmr_mean": report.mmr_mean, "mmr_min": report.mmr_min, "verified": report.feasible}


def stacked(tables: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Return tables one under the other with their names in a first column ``placement``."""
    return pd.concat(tables, names=["placement"]).reset_index(level=0).reset_index(drop=True)


def csv(folder: Path, name: str, table: pd.DataFrame, digits: int = 9) -> None:
    """Write ``data/<name>.csv``."""
    write_text(folder / "data" / f"{name}.csv", table.to_csv(index=False, float_format=f"%.{digits}g"))


def gather(folder: Path, shared: Shared) -> None:
    """Write the tables that all cells share."""
    for name, parts in shared.items():
        csv(folder, name, pd.concat(parts, ignore_index=True), digits=12)


def reproduce(folder: Path, workers: int, size: Size, console: Console, figures: bool = True) -> pd.DataFrame:
    """Do the whole study in a folder and return the summary table."""
    cells = [load_cell(name) for name in BASELINES]
    columns = (TextColumn("{task.description:<46}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        records = solved(tasks(cells, size), folder, workers, progress)
        shared: Shared = {}
        steps = [step for cell in cells for step in OneCell(folder, cell, size, records, shared).steps()]
        steps += [("shared tables", lambda: gather(folder, shared)), ("summary", lambda: write_tables(folder))]
        if figures:
            steps.append(("figures", lambda: write_plots(folder)))
        bar = progress.add_task("figure data", total=len(steps))
        for name, work in steps:
            progress.update(bar, description=name)
            work()
            progress.advance(bar)
        progress.update(bar, description="data, tables, figures")
    return write_tables(folder)


def solved(todo: list[Task], folder: Path, workers: int, progress: Progress) -> list[Record]:
    """Run what the folder does not hold yet and return all records."""
    bar = progress.add_task("solving", total=len(todo))

    def told(record: Record, known: bool) -> None:
        what = f"{record['cell']}: {record['solver']}:{record['preset']} {record['seed']}"
        progress.update(bar, advance=1, description=f"{what} {'known' if known else record['status']}")

    records = run(todo, folder, workers, told)
    progress.update(bar, description="runs")
    return records


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/positioner"), help="folder of the study")
    parser.add_argument("--workers", type=int, default=2, help="runs at once")
    parser.add_argument("--quick", action="store_true", help="few seeds, coarse grids: to see that it works")
    parser.add_argument("--no-figures", action="store_true", help="stop after data and tables")
    options = parser.parse_args()
    console = Console(width=None if sys.stdout.isatty() else 100)
    try:
        size = QUICK if options.quick else FULL
        table = reproduce(options.out, options.workers, size, console, not options.no_figures)
    except NlpweldError as error:
        print(error, file=sys.stderr)
        return 2
    console.print(format_summary(table, console.width))
    console.print(f"tables, figures, plans and records: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
