import numpy as np
import pandas as pd
import pytest
from scipy import stats

from nlpweld.stats.pairs import paired
from tests.stats.helpers import run, table


def runs(**regrets: list[float]) -> pd.DataFrame:
    rows = [run(s, seed, 1.0) | {"regret": r} for s, all_ in regrets.items() for seed, r in enumerate(all_)]
    return table(*rows)


def test_counts_and_p_value_by_hand() -> None:
    a, b = [0.1, 0.2, 0.3, 0.4, 0.5, 0.2], [0.2, 0.4, 0.6, 0.8, 1.0, 0.2]
    row = paired(runs(a=a, b=b)).iloc[0]
    assert row[["pairs", "a_better", "b_better", "ties"]].tolist() == [6, 5, 0, 1]
    assert row["median_difference"] == pytest.approx(-0.25)
    assert row["p"] == pytest.approx(stats.wilcoxon(np.subtract(a, b), zero_method="zsplit", method="approx").pvalue)


def test_a_run_without_answer_is_worse_than_any_with_one() -> None:
    row = paired(runs(a=[np.nan, 0.5, np.nan], b=[0.9, np.nan, np.nan])).iloc[0]
    assert row[["a_better", "b_better", "ties"]].tolist() == [1, 1, 1]
    assert np.isnan(row["median_difference"])


def test_only_seeds_that_both_made_are_compared() -> None:
    assert paired(runs(a=[0.1, 0.2, 0.3], b=[0.2, 0.3]))["pairs"].tolist() == [2]


def test_same_answers_are_no_difference() -> None:
    row = paired(runs(a=[0.1, 0.2], b=[0.1, 0.2])).iloc[0]
    assert row["p"] == 1.0
    assert row["ties"] == 2


def test_many_comparisons_are_corrected() -> None:
    rng = np.random.default_rng(1)
    found = paired(runs(**{name: list(rng.random(12)) for name in "abcdefgh"}))
    assert len(found) == 28
    assert (found["p"] < 0.1).any()  # chance alone finds something
    assert (found["p_corrected"] > 0.1).all()
    assert (found["p_corrected"] >= found["p"]).all()


def test_one_pair_of_runs_is_not_tested() -> None:
    assert paired(runs(a=[0.1], b=[0.2]))[["p", "p_corrected"]].isna().all().all()
