"""Redundant answers against the exact inner answer on a grid, at random feasible placements that are held.

    python experiments/oracle.py --out results/freedom

The grid's best path is found by dynamic programming; Ipopt starts from it and from constant angles.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.progress import track

from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.inner import inner
from nlpweld.formulation.redundant import CONTROL_POINTS, Redundant, redundant
from nlpweld.plan import write_text
from nlpweld.solvers import Budget, make_solver

LEVELS = {"three_er16": "spin_yaw", "dual_welder_positioner": "spin", "robot_positioner": "spin"}
HELD = 1e-9  # half width of the box about a held coordinate


def placements(cell: Cell, count: int, seed: int = 0) -> np.ndarray:
    """Return random placements that are feasible with nominal angles, shape (count, d)."""
    rng, batch, found = np.random.default_rng(seed), Batch(cell), np.empty((0, len(cell.variables)))
    while len(found) < count:
        X = rng.uniform(*cell.box, (2000, cell.box.shape[1]))
        found = np.vstack([found, X[batch.evaluate(X).feasible]])
    return found[:count]


def held(cell: Cell, x: np.ndarray) -> Cell:
    """Return the cell with its placement held at x."""
    lower, upper = (cell.placement(x + side * HELD) for side in (-1, 1))
    return cell.with_(search={"lower_m": tuple(lower[:3].tolist()), "upper_m": tuple(upper[:3].tolist())})


def compared(cell: Cell, level: str, x: np.ndarray, seed: int = 0) -> dict[str, float]:
    """Return the grid's value, Ipopt's, and their times at one placement."""
    own = held(cell, x)
    grid = inner(Redundant(Batch(own), level, CONTROL_POINTS), x)
    began = time.perf_counter()
    found = make_solver("ipopt", scouts=64).solve(redundant(own, level=level), seed=seed, budget=Budget())
    row = dict(zip(cell.variables, x.tolist(), strict=True))
    row |= {"grid": grid.value if grid else np.nan, "grid_s": grid.seconds if grid else np.nan}
    row |= {"ipopt": found.objective if found.status == "SOLVED" else np.nan, "ipopt_s": time.perf_counter() - began}
    return row | {"ratio": row["ipopt"] / row["grid"]}


def oracle(count: int, console: Console) -> pd.DataFrame:
    """Return one row for each cell and placement."""
    rows = []
    for name, level in LEVELS.items():
        cell = load_cell(name)
        for x in track(placements(cell, count), description=f"{name}, {level}", console=console):
            rows.append({"cell": name, "level": level, **compared(cell, level, x)})
    return pd.DataFrame(rows)


def main() -> None:
    """Compare from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results/freedom"), help="folder of the study")
    parser.add_argument("--count", type=int, default=20, help="placements of every cell")
    chosen = parser.parse_args()
    table = oracle(chosen.count, Console(stderr=True))
    write_text(chosen.out / "tables" / "oracle.csv", table.to_csv(index=False, float_format="%.6g"))
    print(table.groupby("cell", sort=False).ratio.describe().to_string())


if __name__ == "__main__":
    main()
