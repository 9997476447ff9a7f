import numpy as np
import pandas as pd
import pytest

from nlpweld.stats.targets import hits, regrets
from tests.stats.helpers import REFERENCE, answer, run, table


@pytest.fixture
def study() -> tuple[pd.DataFrame, pd.DataFrame]:
    runs = table(run("a", 0, 1.999), run("a", 1, 1.9), run("b", 0, None, spent_s=7.0, evaluations=70))
    answers = table(
        answer("a", 0, 1.0, 1.9, 10), answer("a", 0, 3.0, 1.985, 30), answer("a", 0, 5.0, 1.999, 50),
        answer("a", 1, 2.0, 1.9, 20),
    )  # fmt: skip
    return runs, answers


def test_first_answer_within_the_gap_counts(study: tuple) -> None:
    found = hits(*study, REFERENCE, [0.01, 0.001]).set_index(["gap", "solver", "seed"])
    assert found.loc[(0.01, "a", 0), ["reached", "time_s", "evaluations"]].tolist() == [True, 3.0, 30.0]
    assert found.loc[(0.001, "a", 0), ["reached", "time_s", "evaluations"]].tolist() == [True, 5.0, 50.0]


def test_runs_that_miss_have_spent_all_they_had(study: tuple) -> None:
    found = hits(*study, REFERENCE, [0.01]).set_index(["solver", "seed"])
    assert found.loc[("a", 1), ["reached", "time_s", "evaluations"]].tolist() == [False, 10.0, 100.0]
    assert found.loc[("b", 0), ["reached", "time_s", "evaluations"]].tolist() == [False, 7.0, 70.0]


def test_problems_without_reference_are_left_out(study: tuple) -> None:
    assert hits(*study, pd.Series({("other", "reduced"): 2.0})).empty


def test_regret_is_of_verified_answers_alone(study: tuple) -> None:
    runs = study[0].assign(objective=[1.999, 1.9, 1.95])  # the last is a claim nobody verified
    assert regrets(runs, REFERENCE).tolist() == pytest.approx([0.0005, 0.05, np.nan], nan_ok=True)
