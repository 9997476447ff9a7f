"""Ratios in one process, guarded loosely: never an absolute time, and a factor of two of room."""

import numpy as np
import pytest

from benchmarks.candidates import candidates, copies
from benchmarks.contenders import contender, missing
from benchmarks.timing import Job, interleaved, ratio
from nlpweld.cell import Cell

# half of what was measured, against loops that stop at a point out of reach
LEAST = {
    ("nlpweld_numpy", "random"): 90.0,
    ("nlpweld_numpy", "near"): 160.0,
    ("nlpweld_numba", "random"): 800.0,
    ("nlpweld_numba", "near"): 1600.0,
}
FEW = {"random": 16, "near": 2}
POPULATION = 480


@pytest.mark.parametrize(("engine", "kind"), LEAST)
def test_engines_leave_the_naive_loop_behind(cell: Cell, engine: str, kind: str) -> None:
    if missing(engine):
        pytest.skip(missing(engine))
    few = candidates(cell, kind, FEW[kind])
    many = copies(few, POPULATION // len(few))
    naive, ours = contender("naive", cell), contender(engine, cell)
    taken = interleaved(
        [Job("naive", lambda: naive(few), len(few)), Job("ours", lambda: ours(many), len(many))], rounds=3
    )
    assert ratio(taken["naive"], taken["ours"]) > LEAST[engine, kind]


def test_interleaved_times_are_per_unit_of_work() -> None:
    calls: list[int] = []
    taken = interleaved([Job("a", lambda: calls.append(1), 10)], rounds=4, least_s=1e-4)
    assert taken["a"].shape == (4,)
    assert (taken["a"] > 0).all()
    assert len(calls) > 4


def test_ratio_is_the_median_of_ratios_within_rounds() -> None:
    assert ratio(np.array([1.0, 4.0, 90.0]), np.array([1.0, 2.0, 30.0])) == 2.0
