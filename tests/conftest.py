"""The cell of the model, its graphs, and its evaluators."""

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.reduced import reduced


@pytest.fixture(scope="session")
def cell() -> Cell:
    return load_cell("three_er16")


@pytest.fixture(scope="session")
def batch(cell: Cell) -> Batch:
    return Batch(cell)


@pytest.fixture(scope="session")
def any_batch(cell: Cell) -> Batch:
    """The evaluator with all branches open."""
    return Batch(cell.with_(configuration={"shoulder": "any", "elbow": "any"}))


@pytest.fixture(scope="session")
def nlp(cell: Cell) -> Nlp:
    return reduced(cell)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240608)
