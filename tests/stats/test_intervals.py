import numpy as np
import pytest

from nlpweld.stats.intervals import ert, ert_interval, interval, share_interval, shifted_geometric_mean


def test_interval_covers_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    samples = rng.exponential(size=(200, 40))
    inside = [low <= 1.0 <= high for low, high in (interval(sample) for sample in samples)]
    assert 0.87 <= np.mean(inside) <= 0.99


def test_interval_of_nothing_one_and_equal_values() -> None:
    assert np.isnan(interval(np.array([]))).all()
    assert np.isnan(interval(np.array([1.0, np.nan]))).all()
    assert interval(np.full(5, 0.3)) == (0.3, 0.3)


def test_interval_is_the_same_each_time() -> None:
    values = np.arange(10.0)
    assert interval(values) == interval(values)


def test_expected_running_time_is_all_time_over_successes() -> None:
    times, reached = np.array([1.0, 2.0, 9.0]), np.array([True, True, False])
    assert ert(times, reached) == pytest.approx(6.0)
    assert ert(times, np.zeros(3, bool)) == np.inf


def test_expected_running_time_agrees_with_restarts_simulated() -> None:
    times, reached = np.array([1.0, 2.0, 9.0, 4.0]), np.array([True, True, False, False])
    rng = np.random.default_rng(3)
    totals = []
    for _ in range(4000):
        total = 0.0
        while True:
            i = rng.integers(4)
            total += times[i]
            if reached[i]:
                break
        totals.append(total)
    assert np.mean(totals) == pytest.approx(float(ert(times, reached)), rel=0.05)


def test_interval_of_expected_running_time_holds_it_and_may_be_open() -> None:
    times, reached = np.linspace(1, 3, 20), np.array([True] * 15 + [False] * 5)
    low, high = ert_interval(times, reached)
    assert low < float(ert(times, reached)) < high < np.inf
    assert ert_interval(times, np.array([True] + [False] * 19))[1] == np.inf
    assert np.isnan(ert_interval(times, np.zeros(20, bool))).all()


def test_wilson_interval_by_hand() -> None:
    z, n, p = 1.959963985, 20, 0.9
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert share_interval(18, 20) == pytest.approx((middle - half, middle + half))
    assert np.isnan(share_interval(0, 0)).all()


def test_shifted_geometric_mean_by_hand() -> None:
    assert shifted_geometric_mean(np.array([1.0, 7.0]), 1.0) == pytest.approx(3.0)  # sqrt(2 * 8) - 1
    assert np.isnan(shifted_geometric_mean(np.array([]), 1.0))
