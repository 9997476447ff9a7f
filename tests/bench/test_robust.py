"""Robust answers from solver to verifier: the nominal optimum refused, the robust one verified in every scenario."""

from functools import partial

import pytest

from nlpweld.bench import answer as bench
from nlpweld.bench.answer import evaluate_plan, formulate, solve
from nlpweld.cell import load_cell
from nlpweld.verify import verify_robust


def test_nominal_optimum_is_refused_under_errors_and_the_robust_one_verified(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "verify_robust", partial(verify_robust, extra=2))  # sixteen take their time
    box = {"placement_m": (0.0, 0.0, 0.002), "source": "a test"}
    cell = load_cell("three_er16").with_(seam={"points": 36}, uncertainty=box)
    plain, form = (formulate(cell, name, "numpy") for name in ("reduced", "robust"))
    nominal = solve(plain, "ipopt", scouts=64)
    assert nominal.verified
    _, refused = evaluate_plan(form, nominal.outcome.x)
    assert not refused.feasible
    assert {v.constraint for v in refused.violations} == {"singularity"}

    answer = solve(form, "ipopt", scouts=64)
    worst = answer.report.worst_case
    assert answer.verified
    assert worst.feasible == worst.scenarios == 3 + 2
    assert answer.report.mmr_mean < nominal.report.mmr_mean
    exact = form.evaluate(answer.outcome.x[None]).objective[0]
    assert abs(verify_robust(answer.plan, extra=0).worst_case.mmr_mean.value - exact) < 1e-10
