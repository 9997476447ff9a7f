"""A grid of tasks, each in a process of its own, killed when its time is up; records are stored as they come."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import product
from pathlib import Path
from typing import Any

from nlpweld.bench.store import known_record, ready, write_record
from nlpweld.bench.task import Task, failed
from nlpweld.cell.cell import Cell
from nlpweld.solvers import Budget, make_solver

GRACE_S = 30.0  # on top of a task's time budget: start-up, verification
WORKER = [sys.executable, "-m", "nlpweld.bench.worker"]
SINGLE_THREADED = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
Progress = Callable[[dict[str, Any], bool], None]


def grid(
    cells: Sequence[Cell],
    solvers: Sequence[str],
    seeds: Iterable[int],
    formulations: Sequence[str] = ("reduced",),
    budget: Budget | None = None,
    label: str = "",
) -> list[Task]:
    """Return one task for each cell, formulation, solver and seed.

    Args:
        cells: the cells.
        solvers: names, each with an optional preset as ``name:preset``.
        seeds: the seeds.
        formulations: names of formulations.
        budget: limits of each task.
        label: name of the cell's folder, if it is not the cell's own.

    Raises:
        OptionError: no such solver or preset.
    """
    pairs = [(name, preset or "default") for name, _, preset in (solver.partition(":") for solver in solvers)]
    for name, preset in pairs:
        make_solver(name, preset)
    return [
        Task(cell, name, seed, preset, formulation, budget or Budget(), label)
        for cell, formulation, (name, preset), seed in product(cells, formulations, pairs, seeds)
    ]


def run(
    tasks: Sequence[Task], folder: Path, workers: int = 1, progress: Progress | None = None
) -> list[dict[str, Any]]:
    """Run tasks that the folder does not hold yet and return all their records in the order of the tasks.

    Args:
        tasks: what to run.
        folder: the study's folder; records go to its ``records/``.
        workers: tasks under way at once; runtime tables want one.
        progress: called with each record as it arrives, and whether it was already there.

    Raises:
        OutputError: the folder cannot be written; nothing was run.
    """
    ready(folder)
    records: dict[int, dict[str, Any]] = {}
    waiting = []
    for index, task in enumerate(tasks):
        known = known_record(folder, task)
        if known is None:
            waiting.append(index)
            continue
        records[index] = known
        if progress:
            progress(known, True)
    with ThreadPoolExecutor(max_workers=max(1, workers)) as pool:
        futures = {pool.submit(run_apart, tasks[index]): index for index in waiting}
        for future in as_completed(futures):
            index = futures[future]
            records[index] = future.result()
            write_record(folder, tasks[index], records[index])
            if progress:
                progress(records[index], False)
    return [records[index] for index in range(len(tasks))]


def run_apart(task: Task) -> dict[str, Any]:
    """Run one task in a process of its own and return its record."""
    limit = None if task.budget.time_s is None else task.budget.time_s + GRACE_S
    began = time.perf_counter()

    try:
        done = subprocess.run(
            WORKER,
            input=json.dumps(task.to_json()),
            capture_output=True,
            text=True,
            timeout=limit,
            env={**os.environ, **SINGLE_THREADED},
            check=False,
        )
        return json.loads(done.stdout)
    except subprocess.TimeoutExpired:
        return {**failed(task, f"killed after {limit:.0f} s", time.perf_counter() - began), "status": "TIMEOUT"}
    except ValueError:
        tail = " | ".join(done.stderr.strip().splitlines()[-3:])
        return failed(task, f"process ended with {done.returncode}: {tail}", time.perf_counter() - began)
