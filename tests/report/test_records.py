import json

import numpy as np
import pytest

from nlpweld.bench.task import RECORD_VERSION
from nlpweld.errors import OptionError, OutputError
from nlpweld.report.records import VERSION, load_baselines, load_records, load_traces


def refused(error, folder, *told):
    with pytest.raises(error) as caught:
        load_records(folder)
    text = str(caught.value)
    assert "\n" not in text
    for part in told:
        assert str(part) in text


def test_reader_knows_the_version_the_harness_writes():
    assert VERSION == RECORD_VERSION


def test_one_row_a_run_with_the_reports_numbers(folder, add):
    add(solver="ga", seed=1, mmr=0.25)
    add(solver="ga", seed=0, mmr=0.28)
    runs = load_records(folder)
    assert runs["seed"].tolist() == [0, 1]
    assert runs["mmr_mean"].tolist() == [0.28, 0.25]
    assert runs["singularity_min_welder_m3"].tolist() == [0.4, 0.4]
    assert runs["y_m"].tolist() == [-0.166, -0.166]


def test_verified_needs_a_report_that_agrees(folder, add):
    path = add(seed=0, verified=True)
    whole = json.loads(path.read_text())
    whole["report"]["feasible"] = False
    path.write_text(json.dumps(whole))
    assert load_records(folder)["verified"].tolist() == [False]


def test_first_violation_is_told(folder, add):
    path = add(verified=False)
    whole = json.loads(path.read_text())
    whole["report"]["violations"] = [
        {"constraint": "singularity", "robot": "welder"},
        {"constraint": "box", "robot": None},
    ]
    path.write_text(json.dumps(whole))
    assert load_records(folder)["violated"].tolist() == ["singularity welder"]


def test_a_failed_run_is_a_row_without_numbers(folder, add):
    path = add()
    whole = {
        k: v for k, v in json.loads(path.read_text()).items() if k not in ("placement", "report", "trace", "solve_s")
    }
    path.write_text(json.dumps({**whole, "status": "FAILED", "verified": False}))
    runs = load_records(folder)
    assert not runs["verified"][0]
    assert not runs["claimed"][0]
    assert np.isnan([runs["mmr_mean"][0], runs["x_m"][0], runs["solve_s"][0]]).all()
    assert load_traces(folder).empty


def test_traces_keep_what_is_not_yet_feasible_as_nan(folder, add):
    add(mmr=0.3)
    traces = load_traces(folder)
    assert traces["step"].tolist() == list(range(1, 9))
    assert np.isnan(traces["best"][0])
    assert traces["best"][1] == pytest.approx(0.25)


def test_empty_folder(tmp_path):
    refused(OptionError, tmp_path, tmp_path, "no records", "nlpweld compare")


def test_absent_folder(tmp_path):
    refused(OptionError, tmp_path / "nowhere", "nowhere", "no records")


@pytest.mark.parametrize(
    ("text", "told"),
    [("{", "not JSON"), ("[]", "not a record"), ('{"format": "nlpweld-plan"}', "not a record"), ("\x00", "not JSON")],
)
def test_a_broken_record_is_named(folder, add, text, told):
    path = add(seed=3)
    add(seed=4)
    path.write_text(text)
    refused(OutputError, folder, path, told)


def test_a_record_of_a_newer_version_is_named(folder, add):
    path = add(version=VERSION + 1)
    refused(OutputError, folder, path, "version", "update nlpweld")


def test_a_record_without_its_seed_is_named(folder, add):
    path = add()
    whole = json.loads(path.read_text())
    del whole["seed"]
    path.write_text(json.dumps(whole))
    refused(OutputError, folder, path, "seed: missing")


@pytest.mark.parametrize("name", ["cell_hash", "budget", "options"])
def test_runs_made_under_other_terms_do_not_share_a_row(folder, add, name):
    add(seed=0)
    path = add(seed=1, **{name: "other"})
    refused(OutputError, folder, path, name, "seed000.json")


def test_other_solvers_may_have_other_budgets(folder, add):
    add(solver="ga", budget={"evaluations": 5000})
    add(solver="ipopt", budget={})
    assert len(load_records(folder)) == 2


def test_a_broken_baseline_is_named(folder, add_baseline):
    add_baseline()
    path = next((folder / "baselines").glob("*.json"))
    path.write_text('{"name": "C"}')
    with pytest.raises(OutputError, match=r"paper-three_er16\.json: not a baseline \(missing 'placement'\)"):
        load_baselines(folder)
