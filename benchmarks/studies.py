"""How studies scale: time to summarise 10,000 records, and what a second worker brings: ``-m benchmarks.studies``.

Writes results/speed/studies.json. The records are synthetic, with traces of 100 steps; the runs of the second part are
real ones, of which each takes a few seconds. Run it on a machine that does nothing else.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ratios import OUT
from nlpweld.bench.engines import Local
from nlpweld.bench.progress import StudyProgress
from nlpweld.bench.run import grid, run
from nlpweld.cell import load_cell
from nlpweld.records.files import write_record
from nlpweld.records.model import Record, Trace
from nlpweld.report.tables import write_tables
from nlpweld.solvers import Budget

SOLVERS, CELLS, STEPS = 10, 5, 100


def synthetic(solver: int, cell: int, seed: int, rng: np.random.Generator) -> Record:
    """Return the record of a run that was never made."""
    best = np.maximum.accumulate(rng.random(STEPS))
    place = {name: rng.random(STEPS).round(6).tolist() for name in ("x_m", "y_m", "z_m", "yaw_rad")}
    columns = {name: best.tolist() for name in ("best", "mean", "spread")}
    times, value = np.linspace(0.01, 5.0, STEPS), float(best[-1])
    trace = Trace(time_s=times.tolist(), evaluations=list(range(STEPS)), placement=place, **columns)
    held = [
        {"time_s": float(times[i]), "evaluations": i, "claimed": best[i], "objective": best[i], "verified": True}
        for i in (10, 50, 99)
    ]
    whole: dict[str, Any] = {
        "key": "k", "cell": f"cell{cell}", "cell_hash": "h", "formulation": "reduced", "solver": f"solver{solver}",
        "preset": "default", "options": {}, "seed": seed, "budget": {"time_s": 60.0}, "versions": {"nlpweld": "0"},
        "machine": {"system": "s", "processor": "p", "python": "3", "cores": 2}, "status": "SOLVED", "message": "",
        "verified": True, "variables": 3, "placement": {name: v[-1] for name, v in place.items()},
        "claimed_objective": value, "evaluations": STEPS, "build_s": 0.1, "solve_s": 5.0, "wall_s": 6.0,
        "trace": trace.model_dump(), "answers": held,
        "report": {"feasible": True, "mmr_mean": value, "objective": value, "reading": "paper", "violations": []},
    }  # fmt: skip
    return Record.model_validate(whole)


def summary_s(count: int) -> float:
    """Return the time to read records of a folder and write all their tables [s]."""
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for i in range(count):
            seed, rest = divmod(i, SOLVERS * CELLS)
            record = synthetic(rest % SOLVERS, rest // SOLVERS, seed, rng)
            place = f"{record.cell}/reduced/{record.solver}-default/seed{seed:03d}.json"
            write_record(folder / "records" / place, record)
        began = time.perf_counter()
        write_tables(folder)
        return time.perf_counter() - began


def efficiency(runs: int) -> dict[str, float]:
    """Return wall times of the same runs by one and two workers [s], and one's over twice the other's."""
    tasks = grid([load_cell("three_er16")], ["ga"], range(runs), budget=Budget(evaluations=5000))
    taken = {}
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as name, StudyProgress() as watch:
            began = time.perf_counter()
            run(tasks, Path(name), Local(workers), watch)
            taken[workers] = time.perf_counter() - began
    return {"one_worker_s": taken[1], "two_workers_s": taken[2], "efficiency": taken[1] / (2 * taken[2])}


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", type=int, default=10_000, help="synthetic records")
    parser.add_argument("--runs", type=int, default=12, help="runs by one worker and by two")
    chosen = parser.parse_args()
    found = {"records": chosen.records, "summary_s": summary_s(chosen.records), **efficiency(chosen.runs)}
    text = json.dumps({name: round(value, 3) for name, value in found.items()}, indent=1)
    (OUT / "studies.json").write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
