"""All ratios in one process: ``python -m benchmarks.ratios``.

Writes results/speed/speed.csv, speed.md and machine.json.
"""

import argparse
import json
import os
import platform
import warnings
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks import cold, solvers, tables
from benchmarks.candidates import SETS, candidates, copies
from benchmarks.contenders import ENGINES, WHAT, contender, missing
from benchmarks.parts import parts
from benchmarks.peak import instructions, peak_per_s
from benchmarks.timing import Job, interleaved, one_core, ratio
from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.stage import Stage

OUT = Path("results/speed")
BASE = {"random": 64, "near": 4, "full": 4}  # candidates of the contenders that loop
POPULATION = 1024  # candidates of the engines: the same ones, copied, so that the mix is the same
PACKAGES = ("casadi", "numpy", "numba", "pin", "coal", "EAIK", "python-fcl", "pymoo")


def candidate_rows(cell: Cell, peak: float, rounds: int) -> list[dict]:
    """Return one row per set and contender: candidates a second, and ratios to naive loop and peers."""
    names = [name for name in WHAT if not missing(name)]
    runs = {name: contender(name, cell) for name in names}
    bound_s = full_instructions(cell) * cell.seam.points / peak
    rows = []
    for kind in SETS:
        few = candidates(cell, kind, BASE[kind])
        many = copies(few, POPULATION // len(few))
        jobs = [_job(name, runs[name], many if name in ENGINES else few) for name in names]
        taken = interleaved(jobs, rounds)
        rows += compared("candidate", kind, "candidate", taken, bound_s if kind == "full" else None)
    return rows


def _job(name: str, run: Callable[[np.ndarray], object], X: np.ndarray) -> Job:
    return Job(name, lambda: run(X), len(X))


def part_rows(cell: Cell, peak: float, rounds: int) -> list[dict]:
    """Return one row per part and contender: time per configuration, ratios, and share of the machine's peak."""
    rows = []
    for part in parts(cell):
        taken = interleaved(part.jobs, rounds, least_s=0.02)
        rows += compared("part", part.name, "configuration", taken, part.instructions / peak)
    return rows


def compared(section: str, what: str, unit: str, taken: dict[str, np.ndarray], bound_s: float | None) -> list[dict]:
    """Return rows of medians and of ratios taken round by round."""
    rows = []
    for name, seconds in taken.items():
        median = float(np.median(seconds))
        row: dict[str, Any] = {"section": section, "what": what, "contender": name, "unit": unit, "median_s": median}
        row |= {"fastest_s": float(seconds.min()), "slowest_s": float(seconds.max()), "per_s": 1 / median}
        for other in ("naive", "naive_early", "peers"):
            row[f"times_{other}"] = ratio(taken[other], seconds) if other in taken else float("nan")
        row["bound_s"] = bound_s if bound_s is not None else float("nan")
        row["share_of_peak"] = row["bound_s"] / median
        rows.append(row)
    return rows


def full_instructions(cell: Cell) -> int:
    """Return the arithmetic instructions of one seam point when nothing is left out."""
    stage = Stage(cell)
    graphs = [*stage.grips, *stage.limbs, *stage.meetings.values(), stage.work, *stage.heights]
    return sum(instructions(graph) for graph in graphs)


def machine(peak: float, how: str, pinned: bool) -> dict:
    """Return what the figures were measured on."""
    found: dict[str, str | None] = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "held_to_one_core": pinned,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": found,
        "peak_multiply_adds_per_s": peak,
        "peak_measured_by": how,
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor()


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="rounds of every comparison")
    parser.add_argument("--seeds", type=int, default=5, help="seeds of the solvers; 0 leaves them out")
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the results")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", DeprecationWarning)
    cell, pinned = load_cell("three_er16"), one_core()
    peak, how = peak_per_s()
    rows = candidate_rows(cell, peak, chosen.rounds) + part_rows(cell, peak, chosen.rounds)
    rows += solvers.rows(cell, range(chosen.seeds)) + cold.rows()
    chosen.out.mkdir(parents=True, exist_ok=True)
    table, about = pd.DataFrame(rows), machine(peak, how, pinned)
    table.to_csv(chosen.out / "speed.csv", index=False, float_format="%.4g")
    (chosen.out / "machine.json").write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    text = tables.markdown(table, about, full_instructions(cell))
    (chosen.out / "speed.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
