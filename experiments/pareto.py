"""More than one aim: fronts of the objective against clearance, least manipulability, joint travel and time, two ways.

    python experiments/pareto.py --out results/pareto

NSGA-II on the exact model beside the epsilon-constraint method with Ipopt; every point drawn is a plan the verifier
accepts, and its values are the verifier's.
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from common import arguments, rounded, told
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.console import Console
from rich.progress import Progress

from nlpweld.cell import Cell, load_cell
from nlpweld.pareto.aims import AIMS, Aim
from nlpweld.pareto.cells import Front, Trade, by_nsga, by_sweep
from nlpweld.pareto.front import dominated, hypervolumes
from nlpweld.plan import write_text
from nlpweld.report.style import BLUE, ORANGE, RC, figure, name_axes

CELLS = ("three_er16", "robot_positioner", "dual_welder_positioner")
METHODS = {"sweep": "epsilon-constraint, Ipopt", "nsga2": "NSGA-II"}
COLUMNS = {  # of the table, and with how many digits
    "cell": None, "aim": None, "method": None, "points": 0, "refused": 0, "behind": 0,
    "objective_best": 5, "objective_best_at": 4, "aim_best": 4, "aim_best_at": 5,
    "regret_percent": 3, "hypervolume": 4, "dominated_percent": 0, "seconds": 1,
}  # fmt: skip


@dataclass(frozen=True)
class Effort:
    """How much goes into a front: levels of a sweep, individuals and generations of NSGA-II, and the seed."""

    levels: int = 9
    population: int = 40
    generations: int = 50
    seed: int = 0


@dataclass(frozen=True)
class Pair:
    """Both fronts of a cell's objective against one aim, by method, and what each took [s]."""

    cell: Cell
    aim: Aim
    fronts: dict[str, Front]
    seconds: dict[str, float]


def pair(cell: Cell, aim: Aim, effort: Effort, told: Callable[[], object] | None = None) -> Pair:
    """Return both fronts of a cell's objective against an aim."""
    fronts, seconds, began = {}, {}, time.perf_counter()
    for method in METHODS:
        trade = Trade(cell, aim)
        if method == "sweep":
            fronts[method] = by_sweep(trade, effort.levels, effort.seed, told)
        else:
            fronts[method] = by_nsga(trade, effort.population, effort.generations, effort.seed, told)
        seconds[method], began = time.perf_counter() - began, time.perf_counter()
    return Pair(cell, aim, fronts, seconds)


def points_table(pairs: list[Pair]) -> pd.DataFrame:
    """Return every point of every front: cell, aim, method, objective, value, level, closest pair and variables."""
    rows = []
    for one in pairs:
        for method, front in one.fronts.items():
            for point in front.points:
                row = {"cell": one.cell.name, "aim": one.aim.name, "method": method, "objective": point.objective}
                row |= {"value": point.value, "level": one.aim.sense * point.level, "closest_pair": point.closest_pair}
                rows.append(row | dict(zip(one.cell.variables, point.x, strict=True)))
    return pd.DataFrame(rows)


def front_table(pairs: list[Pair]) -> pd.DataFrame:
    """Return one row for each front: its ends, what it is worth, and how much of it the other method's dominates.

    Columns: cell, aim, method, points (verified, not dominated), refused (by the verifier, or levels without an
    answer), behind (verified, but dominated by the method's own), objective_best and the aim there, aim_best and the
    objective there, regret_percent of objective_best from the best of both methods in all of the cell's fronts,
    hypervolume (1.21 is an ideal point's; none where both fronts are one point), dominated_percent of its points that
    the other method's dominate, seconds.
    """
    best: dict[str, float] = {}
    for one in pairs:
        found = [point.objective for front in one.fronts.values() for point in front.points]
        best[one.cell.name] = max([best.get(one.cell.name, -np.inf), *found])
    rows = []
    for one in pairs:
        volumes = dict(zip(one.fronts, hypervolumes([front.values for front in one.fronts.values()]), strict=True))
        for method, front in one.fronts.items():
            (other,) = (other for name, other in one.fronts.items() if name != method)
            row = {"cell": one.cell.name, "aim": one.aim.name, "method": method, "points": len(front.points)}
            row |= {"refused": front.refused, "behind": front.behind, "seconds": one.seconds[method]}
            if front.points:
                row |= _ends(front, best[one.cell.name])
                row["dominated_percent"] = 100 * dominated(front.values, other.values).mean()
            alone = all(len(front.points) <= 1 for front in one.fronts.values())  # nothing to trade, no area
            rows.append(row | {"hypervolume": np.nan if alone else volumes[method]})
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _ends(front: Front, best: float) -> dict[str, float]:
    """Return the two ends of a front, and by how much the first is below the best objective there is [%]."""
    first, last = front.points[0], front.points[-1]
    return {
        "objective_best": first.objective, "objective_best_at": first.value,
        "aim_best": last.value, "aim_best_at": last.objective,
        "regret_percent": 100 * (1 - first.objective / best),
    }  # fmt: skip


def markdown(table: pd.DataFrame) -> str:
    """Return the table of fronts in Markdown."""
    return rounded(table, {name: digits for name, digits in COLUMNS.items() if digits is not None})


def draw(points: pd.DataFrame) -> Figure:
    """Return a cell's fronts from their points (:func:`points_table`), one panel for each aim."""
    fig = figure(68.0, columns=2)
    styles = {
        "nsga2": {"marker": "o", "ms": 3, "color": ORANGE, "alpha": 0.7},
        "sweep": {"marker": "D", "ms": 4, "color": BLUE, "markerfacecolor": "none", "markeredgewidth": 1.0},
    }
    panels = fig.subplots(1, len(AIMS), squeeze=False)[0]
    for axes, aim in zip(panels, AIMS.values(), strict=True):
        own = points[points.aim == aim.name]
        for method, style in styles.items():
            front = own[own.method == method]
            axes.plot(front.value, front.objective, linestyle="", label=METHODS[method], **style)
        better = "more is better" if aim.sense > 0 else "less is better"
        alone = len(own) <= len(METHODS)
        name_axes(axes, f"{aim.label}\n({better})", "objective", "one point is best in both" if alone else "")
        if alone:  # differences of two such points are the arithmetic's
            axes.set_xlim(0.5 * own.value.max(), 1.5 * own.value.max())
            axes.set_ylim(0.9 * own.objective.max(), 1.1 * own.objective.max())
        axes.xaxis.set_major_locator(MaxNLocator(3))
    fig.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return fig


def study(folder: Path, cells: list[Cell], effort: Effort, console: Console, figures: bool = True) -> pd.DataFrame:
    """Find all fronts and return their table; data, tables and figures go to the folder."""
    pairs = []
    with Progress(console=console) as bar:
        steps = len(cells) * len(AIMS) * (effort.levels - 1 + effort.generations)
        task = bar.add_task("fronts", total=steps)
        for cell in cells:
            for aim in AIMS.values():
                bar.update(task, description=f"{cell.name}, {aim.name}")
                pairs.append(pair(cell, aim, effort, lambda: bar.advance(task)))
                bar.update(task, completed=len(pairs) * steps / (len(cells) * len(AIMS)))  # fronts of one point
    points = points_table(pairs)
    write_text(folder / "data" / "points.csv", points.to_csv(index=False, float_format="%.7g"))
    table = front_table(pairs)
    write_text(folder / "tables" / "pareto.csv", table.to_csv(index=False, float_format="%.6g"))
    write_text(folder / "tables" / "pareto.md", markdown(table))
    for cell in cells if figures else ():
        (folder / "figures").mkdir(parents=True, exist_ok=True)
        with rc_context(RC):
            draw(points[points.cell == cell.name]).savefig(folder / "figures" / f"pareto_{cell.name}.png")
    return table


def main() -> int:
    """Run the study from the command line."""
    parser = arguments(__doc__, "results/pareto")
    parser.add_argument("--cells", nargs="+", default=list(CELLS), help="names or files of cells")
    parser.add_argument("--levels", type=int, default=Effort.levels, help="answers of a sweep")
    parser.add_argument("--population", type=int, default=Effort.population, help="individuals of NSGA-II")
    parser.add_argument("--generations", type=int, default=Effort.generations, help="generations of NSGA-II")
    parser.add_argument("--seed", type=int, default=Effort.seed, help="seed of both methods")

    def run(chosen: argparse.Namespace, console: Console) -> str:
        effort = Effort(chosen.levels, chosen.population, chosen.generations, chosen.seed)
        return markdown(study(chosen.out, [load_cell(name) for name in chosen.cells], effort, console))

    return told(parser, run)


if __name__ == "__main__":
    sys.exit(main())
