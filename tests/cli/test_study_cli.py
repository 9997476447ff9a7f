"""Studies on the command line: from a file, and what is wrong in one line with status 2."""

import json

import pytest
from filelock import FileLock

from nlpweld.bench import engines
from tests.bench.here import run_here
from tests.records.made import store

STUDY = """title = "small"
[[runs]]
cells = ["robot_positioner"]
solvers = ["random_search"]
seeds = 2
evaluations = 200
label = "coarse"
"""


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "run_apart", run_here)
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def refused(call, *arguments):
    code, out, err = call(*map(str, arguments))
    assert code == 2
    assert out == ""
    assert len(err.strip().splitlines()) == 1
    return err


def test_a_study_file_runs_resumes_and_becomes_tables_and_a_page(call, study, tmp_path):
    out = tmp_path / "out"
    code, told, _ = call("compare", "--study", str(study), "--out", str(out), "--json")
    assert code == 0
    assert json.loads(told)["runs"] == 2
    before = {path: path.stat().st_mtime_ns for path in (out / "records").rglob("*.json")}
    call("compare", "--study", str(study), "--out", str(out))
    assert {path: path.stat().st_mtime_ns for path in (out / "records").rglob("*.json")} == before
    assert (out / "records.parquet").is_file()
    assert (out / "tables" / "statistics.md").is_file()
    code, told, _ = call("report", str(out), "--json")
    assert code == 0
    assert "coarse" in (out / "report.html").read_text()


def test_cells_and_a_study_or_neither(call, study, tmp_path):
    assert "either" in refused(call, "compare", "--out", tmp_path / "out")
    assert "either" in refused(call, "compare", "three_er16", "--study", study, "--out", tmp_path / "out")


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("robot_positioner", "robot_positoner", "did you mean 'robot_positioner'"),
        ("random_search", "random_serch", "did you mean 'random_search'"),
        ("evaluations", "evaluation", "runs.1.evaluation: unknown field"),
        ("[[runs]]", "[[runs", "not TOML"),
    ],
)
def test_what_is_wrong_with_a_study_file_is_one_line(call, study, tmp_path, old, new, told):
    study.write_text(STUDY.replace(old, new))
    assert told in refused(call, "compare", "--study", study, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_no_such_study_file(call, tmp_path):
    assert "cannot be read" in refused(call, "compare", "--study", tmp_path / "none.toml", "--out", tmp_path / "out")


def test_an_edited_record_is_one_line(call, tmp_path):
    path = store(tmp_path)
    path.write_text(path.read_text().replace('"seed": 0', '"seed": 1'))
    for command in ("tables", "plots", "report"):
        assert "edited or cut" in refused(call, command, tmp_path)


def test_two_runners_on_one_folder(call, study, tmp_path):
    (tmp_path / "out" / "records").mkdir(parents=True)
    with FileLock(tmp_path / "out" / "records" / ".lock"):
        assert "another run" in refused(call, "compare", "--study", study, "--out", tmp_path / "out")


@pytest.mark.filterwarnings("default")
def test_a_scheduler_that_is_not_there(call, study, tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "ANSWER_S", 0.5)
    told = refused(call, "compare", "--study", study, "--out", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9")
    assert "nobody answers" in told
