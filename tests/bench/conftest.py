import pytest

from nlpweld.bench.task import Task
from nlpweld.cell import load_cell
from nlpweld.solvers import Budget


@pytest.fixture(scope="session")
def cell():
    return load_cell("three_er16").with_(seam={"points": 12})


@pytest.fixture
def task(cell):
    return Task(cell, "random_search", 0, budget=Budget(evaluations=200))
