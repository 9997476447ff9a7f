"""Anytime curves: how good the best verified answer was after a given time."""

import numpy as np
import pandas as pd

from nlpweld.stats import PROBLEM, RUN

QUARTILES = (0.25, 0.5, 0.75)
CORNERS = 60  # times of a curve, spread evenly in their logarithm


def anytime(runs: pd.DataFrame, answers: pd.DataFrame, reference: pd.Series) -> pd.DataFrame:
    """Return quartiles over seeds of the regret of the best verified answer held at a time.

    Runs that hold none yet count as infinitely bad, so a median appears once half of the runs hold one.

    Args:
        runs: one row a run, with RUN and ``spent_s``; those without any answer count too.
        answers: verified answers, with RUN, ``time_s`` and ``objective``.
        reference: best objective there is, by (cell, formulation).

    Returns:
        PROBLEM, ``solver``, ``preset``, ``time_s``, ``lower``, ``median``, ``upper`` (regret as a share).
    """
    parts = []
    for key, own in runs.groupby([*PROBLEM, "solver", "preset"]):
        best = reference.get(key[:2], np.nan)
        if not np.isfinite(best):
            continue
        mine = answers.merge(own[RUN], on=RUN)
        times = _times(mine["time_s"].to_numpy(), float(own["spent_s"].max()))
        held = np.stack([_held(mine, seed, times) for seed in own["seed"]])
        regret = (best - held) / abs(best)
        low, middle, high = np.quantile(regret, QUARTILES, axis=0, method="inverted_cdf")
        head = dict(zip([*PROBLEM, "solver", "preset"], key, strict=True))
        parts.append(pd.DataFrame({**head, "time_s": times, "lower": low, "median": middle, "upper": high}))
    columns = [*PROBLEM, "solver", "preset", "time_s", "lower", "median", "upper"]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=columns)


def _times(found: np.ndarray, end: float) -> np.ndarray:
    """Return times from the first answer to the end, evenly spread in their logarithm, answers' own times included."""
    if not len(found):
        return np.array([end])
    first = max(1e-3, float(found.min()))
    return np.unique(np.r_[np.geomspace(first, max(first, end), CORNERS), found])


def _held(answers: pd.DataFrame, seed: int, times: np.ndarray) -> np.ndarray:
    """Return the best objective one run held at each time, minus infinity before its first."""
    own = answers[answers["seed"] == seed].sort_values("time_s")
    best = np.maximum.accumulate(own["objective"].to_numpy(dtype=float))
    index = np.searchsorted(own["time_s"].to_numpy(dtype=float), times, side="right") - 1
    return np.where(index >= 0, best[np.maximum(index, 0)], -np.inf) if len(best) else np.full(len(times), -np.inf)
