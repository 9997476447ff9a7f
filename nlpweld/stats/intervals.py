"""Bootstrap confidence intervals of quality and time, and of shares."""

from collections.abc import Callable

import numpy as np
from scipy import stats

Interval = tuple[float, float]
LEVEL = 0.95
RESAMPLES = 2000
SEED = 20120  # of every bootstrap, so that a table is the same each time it is made


def interval(values: np.ndarray, statistic: Callable[..., np.ndarray] = np.mean, level: float = LEVEL) -> Interval:
    """Return the percentile bootstrap interval of a statistic of values, shape (n,).

    With one value there is no spread to resample, and with none no statistic: both give NaN. Values that are all the
    same give themselves.

    Args:
        values: the sample; NaN is left out.
        statistic: takes values and ``axis``.
        level: confidence level.
    """
    values = np.asarray(values, dtype=float)
    values = values[~np.isnan(values)]
    if len(values) < 2:
        return np.nan, np.nan
    if np.ptp(values) == 0.0:
        return float(values[0]), float(values[0])
    return _resampled((values,), statistic, level)


def ert(times: np.ndarray, reached: np.ndarray, axis: int = -1) -> np.ndarray:
    """Return the expected running time: all time spent, over the number of runs that reached the target.

    That is how long independent restarts take on average (Hansen et al. 2021, COCO); infinite where none reached it.

    Args:
        times: time to the target, or what a run spent in vain, shape (..., n).
        reached: whether a run reached it, shape (..., n).
        axis: of the runs.
    """
    count = np.sum(reached, axis=axis)
    with np.errstate(divide="ignore"):
        return np.where(count > 0, np.sum(times, axis=axis) / count, np.inf)


def ert_interval(times: np.ndarray, reached: np.ndarray, level: float = LEVEL) -> Interval:
    """Return the percentile bootstrap interval of the expected running time; runs are drawn with their success.

    The upper end is infinite where more than a small share of the resamples hold no success.
    """
    if len(times) < 2 or not np.any(reached):
        return np.nan, np.nan
    return _resampled((np.asarray(times, float), np.asarray(reached, float)), ert, level)


def share_interval(count: int, of: int, level: float = LEVEL) -> Interval:
    """Return Wilson's interval of a share, NaN of nothing."""
    if of == 0:
        return np.nan, np.nan
    found = stats.binomtest(count, of).proportion_ci(level, method="wilson")
    return float(found.low), float(found.high)


def shifted_geometric_mean(times: np.ndarray, shift: float) -> float:
    """Return ``exp(mean(log(times + shift))) - shift`` [s]; the shift keeps tiny times from deciding (Mittelmann).

    Args:
        times: times [s], failures at the limit.
        shift: positive [s].
    """
    times = np.asarray(times, dtype=float)
    return float(np.exp(np.mean(np.log(times + shift))) - shift) if len(times) else np.nan


def _resampled(data: tuple[np.ndarray, ...], statistic: Callable[..., np.ndarray], level: float) -> Interval:
    """Return the percentile interval of a statistic of arrays (n,) that are drawn together."""
    rng = np.random.default_rng(SEED)
    index = rng.integers(len(data[0]), size=(RESAMPLES, len(data[0])))
    drawn = statistic(*(values[index] for values in data), axis=-1)
    low, high = np.quantile(drawn, [(1 - level) / 2, (1 + level) / 2], method="inverted_cdf")
    return float(low), float(high)
