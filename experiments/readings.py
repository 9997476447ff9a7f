"""What the objective decides: where the optimum lies by every reading of eq. (16), and what it is worth by the others.

    python experiments/readings.py --out results/readings

Each cell is solved for every objective; answers are verified along the whole seam. The cross table measures every
optimum by every objective, in percent of the best that was found for that one: what it costs to have asked the wrong
question. What the folder already holds is not run again; tables and figure are drawn from its records.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import arguments, told
from rich.console import Console

from nlpweld.bench.answer import evaluate
from nlpweld.bench.engines import Local
from nlpweld.bench.progress import StudyProgress
from nlpweld.bench.run import grid, run
from nlpweld.bench.task import Task
from nlpweld.cell import Cell, load_cell
from nlpweld.cell.cell import VARIABLES
from nlpweld.plan import write_text
from nlpweld.records.model import Record
from nlpweld.report.figures.readings import drawings
from nlpweld.report.plots import write
from nlpweld.report.study import Study
from nlpweld.report.tables import write_tables
from nlpweld.solvers import Budget
from nlpweld.verify import Report
from nlpweld.verify.measures import along_seam, team

READINGS = {
    "three_er16": ("paper", "millimetres", "equal", "harmonic", "sqrt_tight", "product", "mean"),
    "dual_welder_positioner": ("product", "mean"),
    "robot_positioner": ("product",),
}  # each cell's own first
OVER_SEAM: dict[str, dict[str, Any]] = {
    "soft 1": {"over_seam": "soft_minimum", "exponent": 1.0},
    "soft 8": {"over_seam": "soft_minimum", "exponent": 8.0},
    "minimum": {"over_seam": "minimum", "exponent": None},
}
SOLVER = "ipopt"
BUDGET = Budget(time_s=180.0)
NEAR = 1e-3  # share of the best within which a run counts as having found it
AXES = ("x_m", "y_m", "z_m")


@dataclass(frozen=True)
class Asked:
    """One objective of one cell.

    Attributes:
        cell: the cell with that objective.
        name: of the objective: the reading, and what of it over the seam where that is not the mean.
    """

    cell: Cell
    name: str

    @property
    def label(self) -> str:
        """Name of the folder of its records."""
        return f"{self.cell.name}-{self.name.replace(' ', '_')}"


def objectives(cells: tuple[str, ...] = tuple(READINGS)) -> list[Asked]:
    """Return every objective of some cells: all readings' means, and of each cell's own reading the rest."""
    found = []
    for name in cells:
        cell = load_cell(name)
        found += [Asked(cell.with_(objective={"reading": reading}), reading) for reading in READINGS[name]]
        own = READINGS[name][0]
        found += [Asked(cell.with_(objective=fields), f"{own} {over}") for over, fields in OVER_SEAM.items()]
    return found


def tasks(asked: list[Asked], seeds: int) -> list[Task]:
    """Return the runs of the study."""
    return [task for a in asked for task in grid([a.cell], [SOLVER], range(seeds), budget=BUDGET, label=a.label)]


def optimum(asked: Asked, records: list[Record]) -> dict[str, Any]:
    """Return the row of an objective's best verified answer; without one, what there is says so.

    Columns: cell, objective, runs, verified, found (runs within 0.1 % of the best), value and unit, x_m, y_m, z_m,
    yaw_rad, and least MMR at the points and along the whole seam.
    """
    good = [(r.placement, r.report) for r in records if r.verified and r.placement and r.report]
    row: dict[str, Any] = {"cell": asked.cell.name, "objective": asked.name, "runs": len(records)}
    row |= {"verified": len(good)}
    if not good:
        return row
    values = [report["objective"] for _, report in good]
    (place, report), top = good[int(np.argmax(values))], max(values)
    row |= {"found": sum(value > (1 - NEAR) * top for value in values), "value": top}
    return row | place | {name: report[name] for name in ("mmr_min", "mmr_min_along")}


def measured(report: Report, cell: Cell) -> float:
    """Return what a verified placement is worth by a cell's objective, from the verifier's profile over the points."""
    names, profile = [station.name for station in cell.stations], report.profile
    w, ratio = ({name: profile[f"{kind}.{name}"] for name in names} for kind in ("manipulability", "ratio"))
    return along_seam(cell.objective, team(cell, w, ratio))


def crossed(asked: list[Asked], optima: pd.DataFrame, told: Any = None) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the optima with what one verification more says of them, and the cross table, in long form.

    Each optimum is verified again at its placement. Columns of the cross table: cell, optimum_of, measured_by, value,
    share_percent of the best value found for the objective it is measured by; only verified optima are in it.
    """
    rows, reports = [], {}
    for a, (_, row) in zip(asked, optima.iterrows(), strict=True):
        if np.isfinite(row.get("value", np.nan)):
            report = evaluate(a.cell, row[list(VARIABLES)].to_numpy(dtype=float))
            if report.feasible:
                reports[a.cell.name, a.name] = report
        if told:
            told(a)
    optima = optima.assign(unit=[_unit(reports.get((a.cell.name, a.name))) for a in asked])
    for (cell, name), report in reports.items():
        same = [b for b in asked if b.cell.name == cell]
        rows += [
            {"cell": cell, "optimum_of": name, "measured_by": b.name, "value": measured(report, b.cell)} for b in same
        ]
    cross = pd.DataFrame(rows, columns=["cell", "optimum_of", "measured_by", "value"])
    best = optima.set_index(["cell", "objective"])["value"]
    own = [best[cell, by] for cell, by in zip(cross.cell, cross.measured_by, strict=True)]
    return _with_distances(optima), cross.assign(share_percent=100 * cross.value / np.array(own, dtype=float))


def _unit(report: Report | None) -> str:
    return "" if report is None else report.unit.strip("[]")


def _with_distances(optima: pd.DataFrame) -> pd.DataFrame:
    """Return the optima with how far each lies from that of the cell's own objective, which comes first [mm]."""
    place = optima[list(AXES)].astype(float)
    first = place.groupby(optima["cell"]).transform("first")
    return optima.assign(moved_mm=1e3 * np.linalg.norm(place - first, axis=1))


def markdown(optima: pd.DataFrame, cross: pd.DataFrame) -> str:
    """Return both tables in Markdown, the cross table cell by cell."""
    digits = {"value": 5, "x_m": 4, "y_m": 4, "z_m": 4, "moved_mm": 1}
    names = ["cell", "objective", "runs", "verified", "found", "value", "unit", *AXES, "moved_mm", "mmr_min"]
    shown = optima.reindex(columns=[*names, "mmr_min_along"])
    for name in shown.columns[4:]:
        if name != "unit":
            text = "{:.0f}" if name == "found" else f"{{:z.{digits[name]}f}}" if name in digits else "{:.5g}"
            shown[name] = [text.format(v) if pd.notna(v) else "" for v in shown[name]]
    large = optima.get("value", pd.Series(dtype=float)) >= 1e3
    shown.loc[large, "value"] = [f"{v:.6g}" for v in optima.loc[large, "value"]]
    shown["objective"] = [
        f"{name}{'' if verified else ' (no verified answer)'}"
        for name, verified in zip(shown.objective, optima.verified, strict=True)
    ]
    parts = [HEAD, _lines(shown), CROSS]
    for cell, table in cross.groupby("cell", sort=False):
        square = table.pivot(index="optimum_of", columns="measured_by", values="share_percent")
        square = square.reindex(index=table.optimum_of.unique(), columns=table.measured_by.unique())
        square = square.map(lambda share: f"{share:.2f}" if pd.notna(share) else "")
        parts += [f"\n{cell}, optimum of (row), measured by (column):\n\n", _lines(square.reset_index(names=""))]
    return "".join(parts)


HEAD = """Optima by objective; the mean over the seam where nothing else is said. Only answers that are verified along
the whole seam count, and a row without one says so. `value` and `mmr_min` are over the seam's points, `mmr_min_along`
is between them too; they are in the unit of the reading. `moved_mm` is the distance from the optimum of the cell's own
objective.
Most readings of eq. (16) add m^6 to m^3, so their values and optima hold for lengths in metres alone; the row
`millimetres` is the same formula with lengths in mm.

"""
CROSS = """
What each optimum is worth by every objective, in percent of the best verified value by that objective:
"""


def _lines(table: pd.DataFrame) -> str:
    rows = [table.columns, ["---"] * len(table.columns), *table.to_numpy()]
    return "".join(f"| {' | '.join(map(str, row))} |\n" for row in rows)


def study(folder: Path, seeds: int, workers: int, console: Console, **which: Any) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Run what is missing and return optima and cross table, written to the folder with their figure."""
    asked = objectives(**which)
    todo = tasks(asked, seeds)
    with StudyProgress(console) as watch:
        records = run(todo, folder, Local(workers), watch)
        again = watch.bar.add_task("measuring optima by every objective", total=len(asked))
        rows = [optimum(a, [r for r in records if r.cell == a.label]) for a in asked]
        optima, cross = crossed(asked, pd.DataFrame(rows), lambda a: watch.bar.advance(again))
    write_tables(folder)
    for name, table in (("readings", optima), ("cross", cross)):
        write_text(folder / "data" / f"{name}.csv", table.to_csv(index=False, float_format="%.9g"))
    write_text(folder / "tables" / "readings.md", markdown(optima, cross))
    stored = Study(folder)
    for drawing in drawings(stored):
        write(drawing, stored)
    return optima, cross


def main() -> int:
    """Run the study from the command line."""
    parser = arguments(__doc__, "results/readings")
    parser.add_argument("--seeds", type=int, default=3, help="starts of Ipopt for every objective")
    parser.add_argument("--workers", type=int, default=1, help="runs at once")
    return told(parser, lambda chosen, console: markdown(*study(chosen.out, chosen.seeds, chosen.workers, console)))


if __name__ == "__main__":
    sys.exit(main())
