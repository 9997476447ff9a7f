"""Fair clocks: every contender in the same process, turn by turn, medians over rounds."""

import gc
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Job:
    """Something to time.

    Attributes:
        name: of the contender.
        run: does the work once.
        work: how many units (candidates, configurations) one run is.
    """

    name: str
    run: Callable[[], object]
    work: int


def interleaved(jobs: Sequence[Job], rounds: int, least_s: float = 0.05) -> dict[str, np.ndarray]:
    """Return the time per unit of every job in every round, shape (rounds,) [s].

    Jobs take turns, so that a busy minute of the machine hits all of them. Each is run once before, which also
    says how often it is repeated within a turn to last ``least_s``.
    """
    repeats = {job.name: _repeats(job, least_s) for job in jobs}
    taken: dict[str, list[float]] = {job.name: [] for job in jobs}
    gc.collect()
    gc.disable()
    try:
        for _ in range(rounds):
            for job in jobs:
                times = repeats[job.name]
                began = time.perf_counter()
                for _ in range(times):
                    job.run()
                taken[job.name].append((time.perf_counter() - began) / (times * job.work))
    finally:
        gc.enable()
    return {name: np.array(t) for name, t in taken.items()}


def ratio(slow: np.ndarray, fast: np.ndarray) -> float:
    """Return how many times faster: the median over rounds of the ratios within one round."""
    return float(np.median(slow / fast))


def one_core() -> bool:
    """Keep this process on one core, where the system can; tell whether it did."""
    if not hasattr(os, "sched_setaffinity"):
        return False
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    return True


def _repeats(job: Job, least_s: float) -> int:
    job.run()  # builds, compiles, fills caches
    began = time.perf_counter()
    job.run()
    return max(1, int(np.ceil(least_s / max(time.perf_counter() - began, 1e-9))))
