"""The pytest-benchmark suite: ``make bench``. All contenders of a group do the same work on the same placements."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from benchmarks.candidates import SETS, candidates
from benchmarks.contenders import WHAT, contender, missing
from benchmarks.parts import WHAT as PARTS
from benchmarks.parts import parts
from benchmarks.timing import Job
from nlpweld.cell import Cell, load_cell

POPULATION = {"random": 48, "near": 16, "full": 16}  # the loops take 0.1 s a candidate where nothing fails early
RUNS: dict[str, Callable] = {}


@pytest.fixture(scope="module")
def cell() -> Cell:
    """The cell everything is timed on."""
    return load_cell("three_er16")


@pytest.fixture(scope="module")
def jobs(cell: Cell) -> dict[tuple[str, str], Job]:
    """Every part of every contender that has it."""
    return {(part.name, job.name): job for part in parts(cell) for job in part.jobs}


@pytest.mark.parametrize("name", WHAT)
@pytest.mark.parametrize("kind", SETS)
def test_candidates(benchmark: Any, cell: Cell, kind: str, name: str) -> None:
    """Whole candidates."""
    _skip_if_missing(name)
    run = RUNS.setdefault(name, contender(name, cell))
    X = candidates(cell, kind, POPULATION[kind])
    benchmark.group = f"{kind}, {len(X)} candidates"
    run(X[:4])
    mmr, _ = benchmark(run, X)
    assert mmr.shape == (len(X),)


@pytest.mark.parametrize("name", [name for name in WHAT if name != "naive_early"])
@pytest.mark.parametrize("part", PARTS)
def test_parts(benchmark: Any, jobs: dict[tuple[str, str], Job], part: str, name: str) -> None:
    """Single parts; a turn of any contender is brought to the same number of configurations."""
    _skip_if_missing(name)
    job, most = jobs[part, name], max(j.work for (p, _), j in jobs.items() if p == part)
    benchmark.group = f"{part}, {most} configurations"
    times = most // job.work
    job.run()  # builds, compiles, fills caches
    benchmark(lambda: [job.run() for _ in range(times)])
    assert np.isclose(times * job.work, most)


def _skip_if_missing(name: str) -> None:
    reason = missing(name)
    if reason:
        pytest.skip(reason)
