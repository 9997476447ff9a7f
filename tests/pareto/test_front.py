"""Who dominates whom, and hypervolumes worked out by hand."""

import numpy as np
import pytest

from nlpweld.pareto.front import dominated, hypervolumes, non_dominated

VALUES = np.array([[1.0, 3.0], [2.0, 2.0], [1.5, 1.5], [3.0, 1.0], [1.0, 2.0]])


def test_front_keeps_who_is_not_dominated_the_best_objective_first() -> None:
    assert non_dominated(VALUES).tolist() == [3, 1, 0]
    assert not dominated(VALUES[non_dominated(VALUES)], by=VALUES).any()


def test_front_of_nothing_is_empty() -> None:
    assert non_dominated(np.empty((0, 2))).tolist() == []


def test_dominated_needs_no_worse_in_both_and_better_in_one() -> None:
    assert dominated(VALUES, by=VALUES).tolist() == [False, False, True, False, True]
    assert not dominated(VALUES[:1], by=VALUES[:1]).any()
    assert not dominated(VALUES, by=np.empty((0, 2))).any()


def test_hypervolume_is_the_area_of_the_steps() -> None:
    # in the common frame (0, 1), (0.5, 0.5), (1, 0), seen from (-0.1, -0.1): strips of 0.1, 0.5 and 0.5
    steps, ideal = np.array([[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]]), np.array([[3.0, 3.0]])
    area = 0.1 * 1.1 + 0.5 * 0.6 + 0.5 * 0.1
    assert hypervolumes([steps, np.empty((0, 2))]) == pytest.approx([area, 0.0])
    assert hypervolumes([steps, ideal]) == pytest.approx([area, 1.21])
    assert hypervolumes([np.empty((0, 2))] * 2) == [0.0, 0.0]
