"""Records as data frames."""

import numpy as np
import pytest

from nlpweld.errors import OptionError, OutputError
from nlpweld.records.frames import answers_frame, runs_frame, study_records, traces_frame
from tests.records.made import record, report, store


def assert_refused(error, folder, *told):
    with pytest.raises(error) as caught:
        study_records(folder)
    text = str(caught.value)
    assert "\n" not in text
    for part in told:
        assert str(part) in text


def test_one_row_a_run_with_the_reports_numbers():
    runs = runs_frame([record(seed=1, mmr=0.25), record(seed=0, mmr=0.28)])
    assert runs["seed"].tolist() == [0, 1]
    assert runs["mmr_mean"].tolist() == [0.28, 0.25]
    assert runs["singularity_min_welder_m3"].tolist() == [0.4, 0.4]
    assert runs["y_m"].tolist() == [-0.166, -0.166]
    assert runs["spent_s"].tolist() == [2.5, 3.5]


def test_verified_needs_a_report_that_agrees():
    runs = runs_frame([record(report=report(0.3, feasible=False)), record(seed=1, report=None)])
    assert runs["verified"].tolist() == [False, False]


def test_first_violation_is_told():
    violations = ({"constraint": "singularity", "robot": "welder"}, {"constraint": "box", "robot": None})
    runs = runs_frame([record(verified=False, report=report(0.3, False, violations))])
    assert runs["violated"].tolist() == ["singularity welder"]


def test_a_failed_run_is_a_row_without_numbers():
    bare = {"placement": None, "report": None, "trace": {}, "build_s": None, "solve_s": None, "answers": []}
    failed = record(status="FAILED", verified=False, **bare)
    runs = runs_frame([failed])
    assert not runs["verified"][0]
    assert not runs["claimed"][0]
    assert np.isnan([runs["mmr_mean"][0], runs["x_m"][0], runs["solve_s"][0]]).all()
    assert runs["spent_s"][0] == 4.0
    assert traces_frame([failed]).empty
    assert answers_frame([failed]).empty


def test_traces_keep_what_is_not_yet_feasible_as_nan():
    traces = traces_frame([record(mmr=0.3)])
    assert traces["step"].tolist() == list(range(1, 9))
    assert np.isnan(traces["best"][0])
    assert traces["best"][1] == pytest.approx(0.25)
    assert traces["y_m"][7] == pytest.approx(-0.166 + 0.3 / 8)


def test_only_confirmed_answers_count():
    answers = answers_frame([record(seed=0), record(seed=1, verified=False)])
    assert answers["seed"].tolist() == [0]
    assert answers["objective"].tolist() == [0.29]


def test_empty_and_absent_folders_are_named(tmp_path):
    assert_refused(OptionError, tmp_path, tmp_path, "no records", "nlpweld compare")
    assert_refused(OptionError, tmp_path / "nowhere", "nowhere", "no records")


@pytest.mark.parametrize("change", [{"cell_hash": "x"}, {"budget": {"evaluations": 7}}, {"options": {"a": 1}}])
def test_runs_made_under_other_terms_do_not_share_a_row(tmp_path, change):
    store(tmp_path, seed=0)
    path = store(tmp_path, seed=1, **change)
    assert_refused(OutputError, tmp_path, path, next(iter(change)), "seed000.json")


def test_other_solvers_may_have_other_budgets(tmp_path):
    store(tmp_path, solver="ga", budget={"evaluations": 5000})
    store(tmp_path, solver="ipopt", budget={})
    assert len(study_records(tmp_path)) == 2
