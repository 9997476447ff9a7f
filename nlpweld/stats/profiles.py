"""Profiles: what share of the problems a solver has solved within so much work."""

import numpy as np
import pandas as pd

from nlpweld.stats import PROBLEM


def performance_profile(work: pd.DataFrame) -> pd.DataFrame:
    """Return performance profiles (Dolan and More 2002).

    Args:
        work: work of each solver (columns) to solve each problem (rows), infinite where it did not.

    Returns:
        ``solver``, ``ratio`` to the least work any solver took, and the ``share`` of all problems solved within it:
        the corners of a step function, from 1 to the greatest ratio there is. Problems nobody solved count as such.
    """
    values = work.to_numpy(dtype=float)
    least = values.min(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        ratios = np.where(np.isfinite(values), values / least, np.inf)
    return _steps(pd.DataFrame(ratios, columns=work.columns), "ratio", 1.0)


def data_profile(evaluations: pd.DataFrame, variables: pd.Series) -> pd.DataFrame:
    """Return data profiles (More and Wild 2009): work in units of one simplex gradient.

    Args:
        evaluations: evaluations of each solver (columns) to solve each problem (rows), infinite where it did not.
        variables: number of variables of each problem, by the rows' index.

    Returns:
        ``solver``, ``gradients`` (evaluations over variables + 1), ``share`` of the problems solved within them.
    """
    scaled = evaluations.div(variables.reindex(evaluations.index) + 1, axis=0)
    return _steps(scaled, "gradients", 0.0)


def ecdf(hits: pd.DataFrame) -> pd.DataFrame:
    """Return the share of all runs and targets reached within a time (Hansen et al. 2021, COCO).

    Args:
        hits: as from :func:`~nlpweld.stats.targets.hits`, with a ``label`` of the solver.

    Returns:
        ``solver``, ``time_s``, ``share``: the corners of a step function.
    """
    parts = []
    for label, own in hits.groupby("label"):
        times = own["time_s"].where(own["reached"], np.inf).to_frame(name=label)
        parts.append(_steps(times.reset_index(drop=True), "time_s", 0.0))
    return pd.concat(parts, ignore_index=True)


def work_table(hits: pd.DataFrame, column: str) -> pd.DataFrame:
    """Return work of each solver (columns) on each problem, seed and gap (rows), infinite where it missed the target.

    Args:
        hits: as from :func:`~nlpweld.stats.targets.hits`, with a ``label`` of the solver.
        column: ``time_s`` or ``evaluations``.
    """
    reached = hits.assign(work=hits[column].where(hits["reached"], np.inf))
    table = reached.pivot_table(index=[*PROBLEM, "seed", "gap"], columns="label", values="work", aggfunc="first")
    return table.dropna()  # profiles compare solvers on what all of them tried


def _steps(work: pd.DataFrame, name: str, start: float) -> pd.DataFrame:
    finite = work.to_numpy(dtype=float)
    end = finite[np.isfinite(finite)].max(initial=start)
    parts = []
    for solver in work.columns:
        own = np.sort(work[solver].to_numpy(dtype=float))
        x = own[np.isfinite(own)]
        share = np.arange(1, len(x) + 1) / max(1, len(own))
        x, share = np.r_[start, x, end], np.r_[0.0, share, share[-1] if len(share) else 0.0]
        parts.append(pd.DataFrame({"solver": solver, name: x, "share": share}))
    return pd.concat(parts, ignore_index=True)
