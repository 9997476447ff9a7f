"""Two solvers over the same seeds: whose answers are better, and whether that can be chance."""

from itertools import combinations

import numpy as np
import pandas as pd
from scipy import stats

from nlpweld.stats import PROBLEM

NOTHING = 1e-12  # differences of regret below this are ties


def paired(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the comparison of every two solvers over the runs both made: the same problem and the same seed.

    A run without a verified answer is worse than any with one; two without are a tie. Wilcoxon's signed-rank test takes
    ranks of the differences, so how much worse does not matter. Over all pairs the p-values are corrected by Benjamini
    and Yekutieli (2001), which holds however the comparisons depend on each other, as these do.

    Args:
        runs: one row a run, with PROBLEM, ``label`` (of the solver), ``seed`` and ``regret`` (NaN without an answer).

    Returns:
        ``a``, ``b``, ``pairs``, ``a_better``, ``b_better``, ``ties``, ``median_difference`` of the regret of a less
        that of b over the runs both answered, ``p`` and ``p_corrected``; NaN where there are too few differences.
    """
    wide = runs.pivot_table(index=[*PROBLEM, "seed"], columns="label", values="regret", dropna=False, aggfunc="first")
    made = runs.assign(made=1.0).pivot_table(index=[*PROBLEM, "seed"], columns="label", values="made")
    rows = [_row(a, b, wide, made) for a, b in combinations(sorted(runs["label"].unique()), 2)]
    table = pd.DataFrame(
        rows, columns=["a", "b", "pairs", "a_better", "b_better", "ties", "median_difference", "p", "p_corrected"]
    )
    tested = table["p"].notna()
    if tested.any():
        corrected = stats.false_discovery_control(table.loc[tested, "p"].to_numpy(), method="by")
        table.loc[tested, "p_corrected"] = corrected
    return table


def _row(a: str, b: str, wide: pd.DataFrame, made: pd.DataFrame) -> dict[str, object]:
    both = (made[a] == 1.0) & (made[b] == 1.0)
    left, right = wide[a].reindex(made.index)[both], wide[b].reindex(made.index)[both]
    worst = 2.0 * np.nanmax([1.0, *left.abs(), *right.abs()])
    difference = (left.fillna(worst) - right.fillna(worst)).to_numpy()
    answered = (left - right).dropna()
    counts = {
        "a_better": int((difference < -NOTHING).sum()),
        "b_better": int((difference > NOTHING).sum()),
    }
    ties = int(both.sum()) - sum(counts.values())
    middle = float(answered.median()) if len(answered) else np.nan
    row = {"a": a, "b": b, "pairs": int(both.sum()), **counts, "ties": ties, "median_difference": middle}
    return row | {"p": _wilcoxon(difference), "p_corrected": np.nan}


def _wilcoxon(difference: np.ndarray) -> float:
    moved = np.where(np.abs(difference) > NOTHING, difference, 0.0)
    if len(moved) < 2:
        return np.nan
    if not moved.any():
        return 1.0
    return float(stats.wilcoxon(moved, zero_method="zsplit", method="approx").pvalue)
