"""The study of Zhang et al. from start to end: a positioner and one or two robots, runs, tables and figures.

    python experiments/reproduce_positioner.py --out results/positioner

What the folder already holds is not run again.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import Step, main, solved, work
from positioner_data import along, at_breaks, dense, dense_plan, frame_table, weld_position_table
from positioner_search import box_grid, placement_map, sampled_optimum
from rich.console import Console

from nlpweld.bench.answer import evaluate_plan
from nlpweld.bench.progress import StudyProgress
from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import reduced
from nlpweld.geometry.seam import seam_parameters
from nlpweld.plan import write_text
from nlpweld.records.frames import AXES
from nlpweld.records.model import Record
from nlpweld.report.plots import write_plots
from nlpweld.report.tables import write_tables
from nlpweld.verify import Report

DUAL, SINGLE = "dual_welder_positioner", "robot_positioner"
BASELINES = {DUAL: {name: f"Zhang et al. {name}" for name in "ABCD"}, SINGLE: {"nominal": "nominal"}}
WATCHED = "robot_2"  # whose joint speeds Zhang et al. show in Fig. 9
NEAR_M, NEAR_POINTS = 0.05, 41  # half a side of the map near the optimum, at least, and points along a side
NOTE = "best of a grid, polished from its best few points: sampled, not a rigorous bound"
Shared = dict[str, list[pd.DataFrame]]


@dataclass(frozen=True)
class Size:
    """How much of the study is done.

    Attributes:
        grid_m: step of the grid behind the reference optimum.
        map_m: step of the maps over the whole box.
        dense: seam points where speeds are taken.
    """

    grid_m: float
    map_m: float
    dense: int


FULL = Size(0.01, 0.02, 721)
QUICK = Size(0.1, 0.1, 145)


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
        own = [r.placement for r in self.records if r.cell == self.cell.name and r.verified and r.placement]
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


def reproduce(options: Namespace, console: Console) -> pd.DataFrame:
    """Do the whole study in a folder and return the summary table."""
    cells, folder, size = [load_cell(name) for name in BASELINES], options.out, QUICK if options.quick else FULL
    with StudyProgress(console) as watch:
        records = solved("positioner_quick" if options.quick else "positioner", folder, options.workers, watch)
        shared: Shared = {}
        steps = [step for cell in cells for step in OneCell(folder, cell, size, records, shared).steps()]
        steps += [("shared tables", lambda: gather(folder, shared)), ("tables", lambda: write_tables(folder))]
        if not options.no_figures:
            steps.append(("figures", lambda: write_plots(folder)))
        work(steps, watch, "data, tables, figures")
    return write_tables(folder)


if __name__ == "__main__":
    sys.exit(main(reproduce, __doc__, "results/positioner"))
