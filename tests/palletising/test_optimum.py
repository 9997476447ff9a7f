"""The closed form of z_max against brute force, case by case, and the pieces it stands on."""

import numpy as np
import pytest

from nlpweld.motion import Limits, s_curve
from nlpweld.palletising.cycle import after
from nlpweld.palletising.optimum import CASES, free_height, least_move, optimum, unbraked_time
from tests.palletising.helpers import random_legs

Z_A = 2.55


@pytest.fixture(scope="module")
def many():
    legs = random_legs(np.random.default_rng(7), 1000)
    return legs, optimum(legs, Z_A)


def test_every_case_occurs(many) -> None:
    _, best = many
    assert (np.bincount(best.case, minlength=4) > 20).all()


def test_no_height_of_a_fine_grid_is_quicker(many) -> None:
    legs, best = many
    grid = legs.lowest_m + (Z_A - legs.lowest_m) * np.linspace(0.0, 1.0, 301)[:, None] ** 2
    quickest = after(legs, grid).total_s.min(axis=0)
    assert (best.time_s <= quickest + 1e-12).all()
    near = after(legs, np.clip(best.z_max_m + np.linspace(-1e-4, 1e-4, 41)[:, None], legs.lowest_m, Z_A)).total_s
    assert (best.time_s <= near.min(axis=0) + 1e-12).all()


def test_it_is_the_lowest_of_the_best_heights_and_the_range_ends_where_it_says(many) -> None:
    legs, best = many
    below = best.z_max_m - 0.005
    lower = below >= legs.lowest_m
    assert lower.sum() > 300
    slower = after(legs, np.maximum(below, legs.lowest_m)).total_s - best.time_s
    assert (slower[lower] > 0.0).all()
    assert (after(legs, best.z_most_m).total_s <= best.time_s + 1e-11).all()
    above = best.z_most_m + 1e-3
    higher = above <= Z_A
    assert (after(legs, np.minimum(above, Z_A)).total_s - best.time_s)[higher].min() > 1e-9
    assert (best.z_most_m - best.z_max_m)[best.case == CASES.index("plateau")].max() > 0.1


def test_cases_are_told_by_when_the_others_arrive(many) -> None:
    legs, best = many
    gap = after(legs, best.z_max_m).lift_s - legs.beside_s
    by_case = [gap[best.case == case] for case in range(4)]
    assert (by_case[0] >= 0.0).all()
    assert (by_case[1] <= 0.0).all()
    assert (by_case[2] <= 0.0).all()
    assert np.abs(by_case[3]).max() < 1e-11  # where it rises steeply, a bit of z is much
    assert (free_height(legs)[best.case == 2] > Z_A).all()


def test_the_least_move_passes_as_early_as_any_and_a_shorter_one_later() -> None:
    rng = np.random.default_rng(3)
    limits = Limits(*10.0 ** rng.uniform(-1.0, 2.0, (3, 3000)))
    passed = 10.0 ** rng.uniform(-4.0, 1.5, 3000)
    least = least_move(passed, limits)
    own, longer, shorter = (
        s_curve(factor * least, limits).time_at(np.minimum(passed, factor * least)) for factor in (1.0, 3.0, 0.98)
    )
    np.testing.assert_allclose(own, longer, rtol=1e-13)
    np.testing.assert_allclose(unbraked_time(passed, limits), longer, rtol=1e-13)
    valid = 0.98 * least >= passed
    assert valid.mean() > 0.5
    assert (shorter[valid] > own[valid]).all()


def test_nothing_to_pass_is_passed_at_once() -> None:
    limits = Limits(1.0, 2.0, 30.0)
    assert least_move(np.array([0.0]), limits)[0] == 0.0
    assert unbraked_time(np.array([0.0]), limits)[0] == 0.0
