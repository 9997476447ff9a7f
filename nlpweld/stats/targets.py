"""When a run first held a verified answer within a gap of the reference optimum."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from nlpweld.stats import PROBLEM, RUN

GAPS = (0.01, 0.001)  # shares of the reference objective


def hits(runs: pd.DataFrame, answers: pd.DataFrame, reference: pd.Series, gaps: Iterable[float] = GAPS) -> pd.DataFrame:
    """Return when each run first held a verified answer at most a gap below the reference.

    A run that never did has spent all its time on the gap; its time and evaluations are those at its end.

    Args:
        runs: one row a run, with columns RUN, ``spent_s`` (build and solve) and ``evaluations``.
        answers: verified answers a run held on its way and at its end, with columns RUN, ``time_s``, ``evaluations``
            and ``objective``.
        reference: best objective there is, by (cell, formulation).
        gaps: shares of the reference.

    Returns:
        One row for each run and gap: RUN, ``gap``, ``reached``, ``time_s``, ``evaluations``. Runs of problems without
        a reference are left out.
    """
    known = _with_reference(runs, reference)
    good = _with_reference(answers, reference)
    return pd.concat([_at(known, good, gap) for gap in gaps], ignore_index=True)


def regrets(runs: pd.DataFrame, reference: pd.Series) -> pd.Series:
    """Return by what share of the reference each run's verified objective falls short; NaN where nothing is verified.

    Args:
        runs: one row a run, with PROBLEM, ``objective`` and ``verified``.
        reference: best objective there is, by (cell, formulation).
    """
    best = pd.MultiIndex.from_frame(runs[PROBLEM]).map(reference)
    best = pd.Series(np.asarray(best, dtype=float), index=runs.index)
    return ((best - runs["objective"]) / best.abs()).where(runs["verified"])


def _with_reference(table: pd.DataFrame, reference: pd.Series) -> pd.DataFrame:
    best = np.asarray(pd.MultiIndex.from_frame(table[PROBLEM]).map(reference), dtype=float)
    return table.assign(best=best)[np.isfinite(best)]


def _at(runs: pd.DataFrame, answers: pd.DataFrame, gap: float) -> pd.DataFrame:
    good = answers[answers["objective"] >= answers["best"] - gap * answers["best"].abs()]
    first = good.sort_values("time_s").drop_duplicates(RUN)[[*RUN, "time_s", "evaluations"]]
    told = runs[[*RUN, "spent_s", "evaluations"]].merge(first, on=RUN, how="left", suffixes=("_end", ""))
    reached = told["time_s"].notna()
    told["time_s"] = told["time_s"].where(reached, told["spent_s"])
    told["evaluations"] = told["evaluations"].where(reached, told["evaluations_end"])
    return told[RUN].assign(gap=gap, reached=reached, time_s=told["time_s"], evaluations=told["evaluations"])
