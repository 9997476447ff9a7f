"""Statistics of a study, from records made by hand."""

import numpy as np
import pandas as pd
import pytest

from nlpweld.records.frames import answers_frame, runs_frame
from nlpweld.report.markup import latex, markdown
from nlpweld.report.statistics import Statistics, as_text
from tests.records.made import record

NONE = pd.Series(dtype=float)


def statistics(*records, stated=NONE):
    return Statistics(runs_frame(records), answers_frame(records), stated)


def held(time_s, objective, verified=True):
    return {"time_s": time_s, "evaluations": int(10 * time_s), "claimed": objective, "objective": objective,
            "verified": verified}  # fmt: skip


@pytest.fixture
def study():
    """Two honest solvers and one that lies, three seeds each; the last run of ga is not good enough for 1 %."""
    ga = [record("ga", k, 0.29 - 0.01 * (k == 2), answers=[held(1.0 + k, 0.29 - 0.01 * (k == 2))]) for k in range(3)]
    ipopt = [record("ipopt", k, 0.30, answers=[held(0.2, 0.2985), held(0.5, 0.30)]) for k in range(3)]
    liar = [record("liar", k, 9.0, verified=False) for k in range(3)]
    return statistics(*ga, *ipopt, *liar, stated=pd.Series({"three_er16": 0.2915}))


def row(table, solver):
    return table.set_index("solver").loc[solver]


def test_shares_tell_claims_from_what_was_verified(study):
    assert row(study.solvers, "liar")[["solved", "verified", "success_share", "correct_share"]].tolist() == [3, 0, 0, 0]
    assert np.isnan(row(study.solvers, "liar")["objective_mean"])
    assert row(study.solvers, "ipopt")["correct_share"] == 1.0
    assert row(study.solvers, "ipopt")["correct_share_low"] == pytest.approx(0.4385, abs=1e-4)


def test_regret_is_from_the_stated_optimum_or_else_from_the_best_that_was_verified(study):
    assert study.reference.tolist() == [0.2915]
    assert list(study.reference_kind.values()) == ["stated reference"]
    assert row(study.solvers, "ipopt")["regret_median_percent"] == pytest.approx(100 * (1 - 0.30 / 0.2915))
    other = Statistics(study.runs, study.answers, NONE)
    assert other.reference.tolist() == [0.30]
    assert list(other.reference_kind.values()) == ["best verified of this study"]


def test_expected_running_time_by_hand():
    first = [record("ga", k, v, answers=[held(1.0 + k, v)]) for k, v in enumerate((0.30, 0.299, 0.25))]
    ga = row(statistics(*first).solvers, "ga")
    # runs take 2.5, 3.5 and 4.5 s; two reach 1 % after 1 and 2 s, one reaches 0.1 % after 1 s
    assert ga["ert_1_percent_s"] == pytest.approx((1.0 + 2.0 + 4.5) / 2)
    assert ga["ert_0.1_percent_s"] == pytest.approx(1.0 + 3.5 + 4.5)


def test_failures_count_as_their_limit_in_mean_times():
    good = record("ga", 0, build_s=1.0, solve_s=2.0, budget={"time_s": 63.0})
    bad = record("ga", 1, verified=False, budget={"time_s": 63.0})
    assert row(statistics(good, bad).solvers, "ga")["sgm_s"] == pytest.approx(np.sqrt(4.0 * 64.0) - 1.0)


def test_pairs_and_profiles_know_who_was_better(study):
    pair = study.pairs.set_index(["a", "b"]).loc[("ga", "ipopt")]
    assert pair[["pairs", "a_better", "b_better"]].tolist() == [3, 0, 3]
    best = study.performance.groupby("solver")["share"].max()
    assert best["ipopt"] == 1.0
    assert best["liar"] == 0.0


def test_tables_of_text_leave_unknown_numbers_out(study):
    text = as_text(study.solvers).set_index("solver")
    assert text.loc["liar", "objective, mean"] == ""
    assert text.loc["liar", "ERT to 1 % [s]"].startswith("∞")
    assert text.loc["ipopt", "objective, mean"] == "0.30000"
    assert "nan" not in markdown(as_text(study.solvers))
    assert r"$\infty$" in latex(as_text(study.solvers))
