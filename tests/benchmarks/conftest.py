"""The benchmarks lie beside the package; put the repository's root on the path to import them."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from nlpweld.cell import Cell, load_cell


@pytest.fixture(scope="session")
def cell() -> Cell:
    return load_cell("three_er16")
