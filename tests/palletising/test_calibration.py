"""Table 1 of Cao et al. by three sets of limits, limits found again from the totals, and what those leave open."""

import numpy as np
import pytest

from nlpweld.palletising import PalletTask, load_pallet_task, palletize
from nlpweld.palletising.calibration import (
    NAMES,
    Grid,
    calibrated,
    combinations,
    limits_of,
    one_way,
    sensitivity,
    totals,
    walk,
)

PLANNED_S = (107.854, 91.850)  # Cao et al., Table 1
SET_2 = {
    "A": {"speed_deg_s": 145.0, "acceleration_deg_s2": 354.0, "jerk_deg_s3": 3540.0},
    "B": {"acceleration_m_s2": 7.26, "jerk_m_s3": 72.6},
}
SET_3 = {
    "A": {"speed_deg_s": 145.0, "acceleration_deg_s2": 524.0, "jerk_deg_s3": 5240.0},
    "B": {"speed_m_s": 1.2, "acceleration_m_s2": 4.193, "jerk_m_s3": 83.86},
}


@pytest.fixture(scope="module")
def task() -> PalletTask:
    return load_pallet_task()


def both(task: PalletTask) -> tuple[float, float]:
    found = palletize(task)
    return found.totals_s["before"], found.totals_s["after"]


@pytest.mark.parametrize("axes", [{}, SET_2, SET_3], ids=["set 1", "set 2", "set 3"])
def test_table_1_comes_out_within_a_twentieth_of_a_percent(task: PalletTask, axes: dict) -> None:
    found = palletize(task.with_(axes=axes))
    assert both(task.with_(axes=axes)) == pytest.approx(PLANNED_S, rel=5e-4)
    assert found.saving_percent == pytest.approx(14.84, abs=0.02)
    assert len(found.boxes) == 25


def test_totals_are_those_that_were_calibrated(task: PalletTask) -> None:
    assert task.stated is not None
    assert task.stated.planned_s == PLANNED_S
    assert both(task) == pytest.approx((107.85926, 91.85560), abs=1e-5)
    assert both(task.with_(pallet={"yaw_deg": 90.0})) == pytest.approx((107.851, 91.842), abs=1e-3)
    assert both(task.with_(stack={"reference_m": 0.1}))[1] == pytest.approx(91.877, abs=1e-3)
    assert both(task.with_(stack={"reference_m": 0.2}))[1] == pytest.approx(91.923, abs=1e-3)
    assert both(task.with_(cycle={"z_a_m": 1.6}))[1] == pytest.approx(91.864, abs=1e-3)


def test_one_way_on_slower_limits_takes_as_long(task: PalletTask) -> None:
    single = one_way(task)
    assert single.legs == 1
    assert (single.axes.A.speed_deg_s, single.axes.B.acceleration_m_s2, single.axes.B.jerk_m_s3) == (60.0, 1.26, 12.6)
    assert both(single) == pytest.approx(both(task), rel=1e-13)
    assert both(task.with_(cycle={"reading": "one_way"}))[0] == pytest.approx(both(task)[0] / 2)


def test_limits_are_found_again_from_the_totals(task: PalletTask) -> None:
    found = calibrated(task, PLANNED_S, Grid((120.0, 145.0, 20.0), (1.5,), (10.0,), (10.0, 20.0)))
    rows = found.set_index(["A_speed", "B_jerk_per_s"])
    set_1, set_2 = rows.loc[(120.0, 20.0)], rows.loc[(145.0, 10.0)]
    assert (set_1.A_acceleration, set_1.B_acceleration) == pytest.approx((500.0, 5.04), rel=1e-3)
    assert (set_2.A_acceleration, set_2.B_acceleration) == pytest.approx((354.0, 7.26), rel=1e-3)
    assert set_2.A_jerk == pytest.approx(10 * set_2.A_acceleration)
    solved = found[found.solved]
    assert len(solved) == 4  # an axis that swings at 20 deg/s is too slow
    np.testing.assert_allclose(totals(task, solved[list(NAMES)].to_numpy()), [PLANNED_S] * 4, atol=1e-8)


def test_batches_of_limits_are_those_one_by_one(task: PalletTask) -> None:
    rows = limits_of(task) * np.array([[1.0], [1.1], [0.7]])
    one_by_one = [totals(task, row) for row in rows]
    np.testing.assert_allclose(totals(task, rows), one_by_one, rtol=1e-14)
    assert one_by_one[0] == pytest.approx(both(task), rel=1e-14)


def test_two_combinations_make_the_totals(task: PalletTask) -> None:
    lofty = task.with_(stack={"layers": 3}, cycle={"z_a_m": 5.0})  # every box on its plateau
    assert set(palletize(lofty).boxes.case) == {"plateau"}
    held, (before, after) = combinations(lofty), both(lofty)
    legs = 2 * 15
    assert before == pytest.approx(legs * held["leg_s"], rel=1e-13)
    assert before - after == pytest.approx(legs * held["braking_s"], rel=1e-12)
    assert (held["braking_s"], combinations(task)["leg_s"]) == pytest.approx((0.3204, 2.1572), abs=1e-4)


def test_two_totals_say_two_things_of_twelve_limits(task: PalletTask) -> None:
    slopes = sensitivity(task)
    assert np.linalg.matrix_rank(slopes, tol=1e-3) == 2
    assert (slopes[:, 6:] == 0.0).all()
    assert (slopes[:, [0, 1, 2, 4, 5]] < 0.0).all()
    per_limit = np.diff(totals(task, limits_of(task) * np.exp([[-1e-3], [1e-3]])), axis=0)[0] / 2e-3
    assert slopes.sum(axis=1) == pytest.approx(per_limit, rel=1e-3)


def test_limits_that_differ_by_thirds_keep_both_totals(task: PalletTask) -> None:
    gone = walk(task, {"A_speed": 1.3, "B_speed": 1.4}, steps=2)
    assert gone.A_speed.iloc[-1] == pytest.approx(156.0)
    assert gone.B_speed.iloc[-1] == pytest.approx(2.1)
    assert gone.A_acceleration.iloc[-1] < 400.0
    np.testing.assert_allclose(gone[["before_s", "after_s"]], [both(task)] * 3, atol=1e-9)
