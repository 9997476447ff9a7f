"""The study of Pan et al. from start to end: runs, verification, tables and figures.

    python experiments/reproduce_paper.py --out results/paper

What the folder already holds is not run again.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import Step, main, solved, work
from paper_data import arm_table, ellipsoid_table, ga_individuals, ipopt_path, profile_table, seam_table, welder
from paper_search import Profiles, near_singular, slice_map, unsteady, without_floor, worst_placements
from rich.console import Console

from nlpweld.bench.answer import evaluate_plan, with_branches
from nlpweld.bench.progress import StudyProgress
from nlpweld.cell import Cell, load_cell
from nlpweld.errors import NlpweldError
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import reduced
from nlpweld.plan import Plan, write_text
from nlpweld.records.frames import AXES
from nlpweld.records.model import Record
from nlpweld.report.plots import write_plots
from nlpweld.report.tables import write_tables
from nlpweld.solvers import Budget
from nlpweld.verify import Report, verify

CELL, ANY = "three_er16", "three_er16-any"
PAPER = "Pan et al. C"
MAPS = {"": np.inf, "near_": 0.22}  # whole slices of S, and what is within so many metres of the optimum
ELLIPSOID_POINT = 0  # the seam point of Fig. 3


@dataclass(frozen=True)
class Size:
    """How much of the study is done.

    Attributes:
        evaluations: budget of the population run whose individuals are drawn.
        map_points: grid points along each side of a map.
        scan: candidates of the scans for poor placements.
    """

    evaluations: int
    map_points: int
    scan: int


FULL = Size(5000, 80, 4096)
QUICK = Size(600, 12, 256)


@dataclass(frozen=True)
class Data:
    """What figures are drawn from, made step by step below the study's folder."""

    folder: Path
    cell: Cell
    size: Size
    records: list[Record]

    def steps(self) -> Iterator[Step]:
        """Yield name and work of every step."""
        nlp, paper = reduced(self.cell), np.array(self.cell.placements["paper"])
        best = self._best(CELL)
        if not best:
            raise NlpweldError(f"{self.folder}: no run of {CELL} was verified; see what 'nlpweld tables' makes of it")
        optimum = _placement(best)
        yield "the paper's C", lambda: self._paper(nlp, paper, CELL)
        yield "the paper's C, all branches", lambda: self._paper(reduced(with_branches(self.cell, "any")), paper, ANY)
        yield "optimum", lambda: self._optimum(nlp, optimum)
        if best_any := self._best(ANY):
            any_nlp, at = reduced(with_branches(self.cell, "any")), _placement(best_any)
            yield "optimum, all branches", lambda: self._plan("optimum_any", *evaluate_plan(any_nlp, at))
        yield "solvers' paths", lambda: self._paths(nlp, optimum)
        for axis, name in enumerate(AXES):
            yield f"map, {name[0]} held", lambda axis=axis: self._map(nlp, optimum, axis)
        yield "poor placements", self._poor

    def _best(self, label: str) -> Record | None:
        good = [r for r in self.records if r.cell == label and r.verified and r.report]
        return max(good, key=lambda r: (r.report or {})["mmr_mean"], default=None)

    def _paper(self, nlp: Nlp, at: np.ndarray, label: str) -> None:
        plan, report = evaluate_plan(nlp, at)
        stem = "paper" if label == CELL else "paper_any"
        baseline = {"name": PAPER, "cell": label, "placement": at.tolist(), "report": report.to_json()}
        write_text(self.folder / "baselines" / f"{stem}.json", json.dumps(baseline, indent=1) + "\n")
        self._plan(stem, plan, report)
        if label == CELL and plan:
            self._csv("seam", seam_table(plan))

    def _optimum(self, nlp: Nlp, at: np.ndarray) -> None:
        plan, report = evaluate_plan(nlp, at)
        self._plan("optimum", plan, report)
        if plan:
            self._csv("arms", arm_table(plan, ELLIPSOID_POINT))
            self._csv("ellipsoids", ellipsoid_table(plan, report, ELLIPSOID_POINT))

    def _paths(self, nlp: Nlp, optimum: np.ndarray) -> None:
        own = [r for r in self.records if r.cell == CELL]
        seed = median_seed([r for r in own if r.solver == "ga" and r.preset == "default"])
        self._csv("ga_individuals", ga_individuals(nlp, seed, Budget(self.size.evaluations)).assign(seed=seed))
        self._csv("ipopt_path", ipopt_path([r for r in own if r.preset == "plain"], optimum))

    def _map(self, nlp: Nlp, optimum: np.ndarray, axis: int) -> None:
        for kind, within_m in MAPS.items():
            self._csv(f"map_{kind}{AXES[axis][0]}", slice_map(nlp, optimum, axis, self.size.map_points, within_m))

    def _poor(self) -> None:
        profiles = Profiles(without_floor(self.cell))
        nlp, rows = reduced(profiles.cell), []
        found = worst_placements(profiles, {"near_singular": near_singular, "unsteady": unsteady}, self.size.scan)
        for name, at in found.items():
            plan, report = evaluate_plan(nlp, at)
            self._plan(name, plan, report)
            rows.append({"name": name, **dict(zip(AXES, at, strict=True)), **self._verdict(plan, report)})
        self._csv("poor_placements", pd.DataFrame(rows))

    def _verdict(self, plan: Plan | None, report: Report) -> dict[str, Any]:
        """Return a poor placement's numbers and what it breaks in the cell as it is, floor included."""
        broken = verify(Plan(self.cell, plan.placement_m, plan.s, plan.paths, plan.branches)) if plan else report
        w = report.profile[f"manipulability.{welder(self.cell).name}"]
        numbers = {"mmr_mean": report.mmr_mean, "mmr_min": report.mmr_min, "mmr_max": report.mmr_max}
        numbers |= {"w_welder_min_m3": w.min(), "w_welder_max_m3": w.max(), "clearance_m": report.clearance_m}
        return numbers | {"breaks": ", ".join(dict.fromkeys(v.constraint for v in broken.violations)) or "nothing"}

    def _plan(self, name: str, plan: Plan | None, report: Report) -> None:
        if plan:
            plan.save(self.folder / "plans" / f"{name}.json")
            self._csv(f"profile_{name}", profile_table(report))

    def _csv(self, name: str, table: pd.DataFrame) -> None:
        write_text(self.folder / "data" / f"{name}.csv", table.to_csv(index=False, float_format="%.9g"))


def _placement(record: Record) -> np.ndarray:
    assert record.placement is not None
    return np.array([record.placement[name] for name in AXES])


def median_seed(records: list[Record]) -> int:
    """Return the seed of the run whose best MMR is the (lower) median of its kind."""
    ranked = sorted(records, key=lambda r: (r.claimed_objective or -np.inf, r.seed))
    return ranked[(len(ranked) - 1) // 2].seed


def reproduce(options: Namespace, console: Console) -> pd.DataFrame:
    """Do the whole study in a folder and return the summary table."""
    cell, folder, size = load_cell(CELL), options.out, QUICK if options.quick else FULL
    with StudyProgress(console) as watch:
        records = solved("paper_quick" if options.quick else "paper", folder, options.workers, watch)
        steps = list(Data(folder, cell, size, records).steps())
        steps.append(("tables", lambda: write_tables(folder)))
        if not options.no_figures:
            steps.append(("figures", lambda: write_plots(folder, watch.bar.console.print)))
        work(steps, watch, "data, tables, figures")
    return write_tables(folder)


if __name__ == "__main__":
    sys.exit(main(reproduce, __doc__, "results/paper"))
