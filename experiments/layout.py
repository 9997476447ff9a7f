"""What freely standing robots are worth: bases held, free along x and y, and turned too, each answer verified.

    python experiments/layout.py --out results/layout

What the folder already holds is not run again. Table and figures are drawn from its records. Where all bases are free
and so is the placement, everything may be shifted together, so that where they end is one layout of many.
"""

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from common import arguments, rounded, told
from layout_figure import draw
from matplotlib import rc_context
from rich.console import Console

from nlpweld.bench.engines import Local
from nlpweld.bench.progress import StudyProgress
from nlpweld.bench.run import grid, run
from nlpweld.bench.task import Task
from nlpweld.cell import Cell, load_cell
from nlpweld.plan import write_text
from nlpweld.records.model import Record
from nlpweld.report.style import RC
from nlpweld.report.tables import write_tables
from nlpweld.solvers import Budget

HALF_M, HALF_DEG = 0.2, 30.0  # how far a base may move each way
BUDGET = Budget(time_s=300.0)
NEAR = 1e-3  # share of the best within which a start counts as having found it
TIMES = ("solve_s", "build_s")
MEASURES = ("mmr_mean", "mmr_min", "gain_percent", "found")
COLUMNS = ("cell", "free", "variables", "runs", "verified", *MEASURES, *TIMES, "moves")


@dataclass(frozen=True)
class Case:
    """What is free of a cell's layout.

    Attributes:
        cell: name of a built-in cell.
        free: what the case is called.
        robots: names of the robots whose bases may move.
        turns: whether they may turn too.
    """

    cell: str
    free: str
    robots: tuple[str, ...] = ()
    turns: bool = False

    @property
    def label(self) -> str:
        """Name of the case's folder of records."""
        return f"{self.cell}-{self.free}"


TEAM, PAIR = ("handler_1", "handler_2", "welder"), ("robot_1", "robot_2")
CASES = (
    Case("three_er16", "fixed"),
    Case("three_er16", "handler_1", ("handler_1",)),
    Case("three_er16", "welder", ("welder",)),
    Case("three_er16", "handlers", TEAM[:2]),
    Case("three_er16", "xy", TEAM),
    Case("three_er16", "xy_yaw", TEAM, turns=True),
    Case("dual_welder_positioner", "fixed"),
    Case("dual_welder_positioner", "robot_1", ("robot_1",)),
    Case("dual_welder_positioner", "xy", PAIR),
    Case("dual_welder_positioner", "xy_yaw", PAIR, turns=True),
)


def freed(cell: Cell, robots: tuple[str, ...], turns: bool) -> Cell:
    """Return the cell with the bases of some robots free along x and y, and about z if they turn."""
    data = cell.model_dump(mode="python", exclude_unset=True)
    for station, own in zip(data["stations"], cell.stations, strict=True):
        if own.name in robots:
            (x, y, _), yaw = own.base_position_m, own.base_rpy_deg[2]
            station["layout"] = {"x_m": _about(x, HALF_M), "y_m": _about(y, HALF_M), "source": "chosen for the study"}
            if turns:
                station["layout"]["yaw_deg"] = _about(yaw, HALF_DEG)
    return Cell.model_validate(data)


def _about(middle: float, half: float) -> tuple[float, float]:
    return (round(middle - half, 9), round(middle + half, 9))


def tasks(seeds: int, cases: tuple[Case, ...] = CASES, points: int | None = None) -> list[Task]:
    """Return the runs of the study, at the cells' own seam points or another number of them."""
    todo = []
    for case in cases:
        cell = freed(load_cell(case.cell), case.robots, case.turns)
        cell = cell if points is None else cell.with_(seam={"points": points})
        todo += grid([cell], ["ipopt"], range(seeds), ["reduced"], BUDGET, case.label)
    return todo


def layout_table(cases: tuple[Case, ...], records: list[Record]) -> pd.DataFrame:
    """Return one row for each case: what its best verified answer gives, where bases go, how often it is found.

    Columns: cell, free, variables (their number), runs, verified, mmr_mean, mmr_min, gain_percent over the cell's best
    answer with bases fixed, found (starts within 0.1 % of the best), solve_s and build_s (medians), and moves, each
    base's way along x and y [m] and turn [deg] from where the cell has it.
    """
    rows = []
    for case in cases:
        runs = [record for record in records if record.cell == case.label]
        best, good = best_of(runs), [r.report["mmr_mean"] for r in runs if r.verified and r.report]
        cell = load_cell(case.cell)
        row = {"cell": case.cell, "free": case.free, "runs": len(runs), "verified": len(good)}
        row["variables"] = len(freed(cell, case.robots, case.turns).variables)
        if best:
            row |= {name: (best.report or {})[name] for name in ("mmr_mean", "mmr_min")}
            row |= {"found": sum(mean > (1 - NEAR) * max(good) for mean in good), "moves": moves(cell, best)}
        rows.append(row | {name: _median(getattr(r, name) for r in runs) for name in TIMES})
    table = pd.DataFrame(rows, columns=COLUMNS)
    fixed = table[table.free == "fixed"].set_index("cell").mmr_mean
    return table.assign(gain_percent=100 * (table.mmr_mean / table.cell.map(fixed) - 1))


def best_of(runs: list[Record]) -> Record | None:
    """Return the record of the best verified answer, or None."""
    good = [record for record in runs if record.verified and record.report]
    return max(good, key=lambda record: (record.report or {})["mmr_mean"]) if good else None


def _median(values: Iterable[float | None]) -> float:
    return float(np.median([value for value in values if value is not None] or [np.nan]))


def moves(cell: Cell, record: Record) -> str:
    """Return how far the bases of an answer are from where the cell has them, as text."""
    told = []
    for station in cell.stations:
        at = record.layout.get(station.name)
        if at is not None:
            dx, dy, turn = np.array([at["x_m"], at["y_m"], at["yaw_rad"]]) - station.base
            told.append(f"{station.name} {dx:+.3f} {dy:+.3f} m {np.degrees(turn):+.1f} deg")
    return "; ".join(told)


def markdown(table: pd.DataFrame) -> str:
    """Return the table in Markdown."""
    digits = {"mmr_mean": 5, "mmr_min": 5, "gain_percent": 1, "solve_s": 2, "build_s": 2, "found": 0}
    return rounded(table, digits)


def study(
    folder: Path,
    seeds: int,
    workers: int,
    console: Console,
    cases: tuple[Case, ...] = CASES,
    points: int | None = None,
) -> pd.DataFrame:
    """Run what is missing and return the table; table and figures go to the folder."""
    todo = tasks(seeds, cases, points)
    with StudyProgress(console) as watch:
        records = run(todo, folder, Local(workers), watch)
    write_tables(folder)
    table = layout_table(cases, records)
    write_text(folder / "data" / "box.json", json.dumps({"half_m": HALF_M, "half_deg": HALF_DEG}, indent=1) + "\n")
    write_text(folder / "tables" / "layout.csv", table.to_csv(index=False, float_format="%.6g"))
    write_text(folder / "tables" / "layout.md", markdown(table))
    _figures(folder, cases, records)
    return table


def _figures(folder: Path, cases: tuple[Case, ...], records: list[Record]) -> None:
    """Draw the layout before and after of every cell that has answers with bases fixed and with all free."""
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    best = {case.label: best_of([r for r in records if r.cell == case.label]) for case in cases}
    for name in dict.fromkeys(case.cell for case in cases):
        before, after = best.get(f"{name}-fixed"), best.get(f"{name}-xy")
        if before and after:
            with rc_context(RC):
                draw(load_cell(name), before, after, HALF_M).savefig(folder / "figures" / f"layout_{name}.png")


def main() -> int:
    """Run the study from the command line."""
    parser = arguments(__doc__, "results/layout")
    parser.add_argument("--seeds", type=int, default=6, help="starts of every case")
    parser.add_argument("--workers", type=int, default=1, help="runs at once; times want one")
    return told(parser, lambda chosen, console: markdown(study(chosen.out, chosen.seeds, chosen.workers, console)))


if __name__ == "__main__":
    sys.exit(main())
