"""The comparison with the grid's exact answer at held placements."""

import sys
from pathlib import Path

import numpy as np

from nlpweld.cell import load_cell
from nlpweld.formulation.batch import Batch

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))

from oracle import compared, held, placements


def test_placements_are_feasible_and_the_same_for_a_seed() -> None:
    cell = load_cell("robot_positioner")
    X = placements(cell, 7)
    assert X.shape == (7, 2)
    assert Batch(cell).evaluate(X).feasible.all()
    assert (placements(cell, 7) == X).all()


def test_held_cell_stays_at_the_placement() -> None:
    cell = load_cell("robot_positioner")
    lower, upper = held(cell, np.array([0.1, -1.1])).box
    assert np.abs(np.array([lower, upper]) - [0.1, -1.1]).max() < 2e-9
    assert (lower < upper).all()


def test_ipopt_reaches_the_grids_answer_at_a_held_placement() -> None:
    found = compared(load_cell("robot_positioner"), "spin", np.array([0.0, -1.0]))
    assert 0.55 < found["grid"] < 0.6
    assert found["ratio"] > 0.99
