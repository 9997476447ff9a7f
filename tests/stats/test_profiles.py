import numpy as np
import pandas as pd
import pytest

from nlpweld.stats.profiles import data_profile, ecdf, performance_profile, work_table
from nlpweld.stats.targets import hits
from tests.stats.helpers import REFERENCE, answer, run, table

WORK = pd.DataFrame({"a": [1.0, 4.0, np.inf], "b": [2.0, 2.0, np.inf]}, index=["p", "q", "r"])


def share(profile: pd.DataFrame, solver: str, column: str, at: float) -> float:
    own = profile[profile["solver"] == solver]
    return float(own.loc[own[column] <= at, "share"].max())


def test_performance_profile_by_hand() -> None:
    found = performance_profile(WORK)
    assert share(found, "a", "ratio", 1.0) == pytest.approx(1 / 3)
    assert share(found, "a", "ratio", 2.0) == pytest.approx(2 / 3)
    assert share(found, "b", "ratio", 1.9) == pytest.approx(1 / 3)
    assert found["share"].max() == pytest.approx(2 / 3)  # nobody solved the third problem


def test_data_profile_counts_simplex_gradients() -> None:
    found = data_profile(WORK * 40, pd.Series({"p": 3, "q": 1, "r": 1}))
    assert share(found, "a", "gradients", 9.99) == 0.0
    assert share(found, "a", "gradients", 10.0) == pytest.approx(1 / 3)  # 40 evaluations over 3 + 1
    assert share(found, "b", "gradients", 40.0) == pytest.approx(2 / 3)  # 80 over 1 + 1


def test_ecdf_and_work_over_runs_and_targets() -> None:
    runs = table(run("a", 0, 1.999), run("b", 0, None, spent_s=4.0))
    found = hits(runs, table(answer("a", 0, 1.0, 1.985, 10), answer("a", 0, 3.0, 1.999, 30)), REFERENCE)
    found["label"] = found["solver"]
    curve = ecdf(found)
    assert [share(curve, "a", "time_s", t) for t in (0.9, 1.0, 3.0)] == [0.0, 0.5, 1.0]
    assert share(curve, "b", "time_s", 100.0) == 0.0
    work = work_table(found, "evaluations")
    assert work["a"].tolist() == [30.0, 10.0]
    assert np.isinf(work["b"]).all()


def test_problems_that_one_solver_did_not_try_are_left_out_of_profiles() -> None:
    runs = table(run("a", 0, 2.0), run("a", 1, 2.0), run("b", 0, 2.0))
    answers = table(answer("a", 0, 1.0, 2.0), answer("a", 1, 1.0, 2.0), answer("b", 0, 1.0, 2.0))
    found = hits(runs, answers, REFERENCE, [0.01])
    found["label"] = found["solver"]
    assert len(work_table(found, "time_s")) == 1


@pytest.mark.parametrize("kind", ["performance", "data"])
def test_profiles_agree_with_optiprofiler(kind: str) -> None:
    plotting = pytest.importorskip("optiprofiler.plotting")
    rng = np.random.default_rng(7)
    work = rng.integers(1, 200, size=(30, 4)).astype(float)
    work[rng.random(work.shape) < 0.2] = np.nan
    work[0] = np.nan  # a problem nobody solves
    variables = rng.integers(1, 20, size=30)
    if kind == "performance":
        least = np.nanmin(np.where(np.isnan(work), np.inf, work), axis=1)
        ours, column = performance_profile(pd.DataFrame(work).fillna(np.inf)), "ratio"
        theirs = plotting._get_performance_data_profile_axes(work[:, :, None], lambda i, _: least[i])
    else:
        ours, column = data_profile(pd.DataFrame(work).fillna(np.inf), pd.Series(variables)), "gradients"
        theirs = plotting._get_performance_data_profile_axes(work[:, :, None], lambda i, _: variables[i] + 1)
    x, y, _ = theirs
    for solver in range(4):
        for at in np.unique(x[np.isfinite(x)]):
            # theirs are steps too, whose height at a corner is the last one with that abscissa
            known = y[x[:, solver] <= at, solver, 0].max(initial=0.0)
            assert share(ours, solver, column, at + 1e-12) == pytest.approx(known, abs=1e-12)
