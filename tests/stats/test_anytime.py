import numpy as np
import pytest

from nlpweld.stats.anytime import anytime
from tests.stats.helpers import REFERENCE, answer, run, table


def test_median_regret_appears_when_half_of_the_runs_hold_an_answer() -> None:
    runs = table(*(run("a", seed, 1.9) for seed in range(3)), run("a", 3, None))
    answers = table(
        answer("a", 0, 1.0, 1.0), answer("a", 0, 4.0, 1.9), answer("a", 1, 2.0, 1.8), answer("a", 2, 3.0, 1.6)
    )
    curve = anytime(runs, answers, REFERENCE).set_index("time_s")
    assert curve.loc[1.0, "lower"] == pytest.approx(0.5)
    assert np.isinf(curve.loc[1.0, "median"])
    assert curve.loc[2.0, "median"] == pytest.approx(0.5)  # regrets 0.1 and 0.5, and two without an answer
    assert curve.loc[3.0, "median"] == pytest.approx(0.2)  # 0.1, 0.2, 0.5 and none
    assert np.isinf(curve.loc[2.0, "upper"])
    assert curve.loc[4.0, "upper"] == pytest.approx(0.2)  # 0.05, 0.1, 0.2 and none
    assert curve.index.max() == 10.0


def test_a_worse_answer_later_does_not_count_against_a_run() -> None:
    answers = table(answer("a", 0, 1.0, 1.9), answer("a", 0, 2.0, 1.0))
    curve = anytime(table(run("a", 0, 1.0)), answers, REFERENCE).set_index("time_s")
    assert curve.loc[2.0, "median"] == pytest.approx(0.05)


def test_no_reference_no_curve() -> None:
    assert anytime(table(run("a", 0, 1.0)), table(answer("a", 0, 1.0, 1.9)), REFERENCE.iloc[:0]).empty
