"""The runner: resumes, keeps failures as data, and refuses a folder it cannot write."""

import json
import sys
from dataclasses import replace

import pytest

from nlpweld.bench import run as run_module
from nlpweld.bench.compare import compare
from nlpweld.bench.run import grid, run
from nlpweld.bench.store import known_record, record_path
from nlpweld.errors import OptionError, OutputError
from nlpweld.solvers import Budget

SMALL = Budget(evaluations=60)


def test_the_grid_has_every_combination_once(cell):
    tasks = grid([cell], ["ga", "ga:paper", "random_search"], range(4), budget=SMALL)
    assert len({t.place for t in tasks}) == len(tasks) == 12


def test_an_unknown_solver_stops_the_grid_before_anything_runs(cell):
    with pytest.raises(OptionError, match="ipopd"):
        grid([cell], ["random_search", "ipopd"], [0])


def test_what_is_stored_is_not_run_again_and_what_changed_is(cell, tmp_path):
    told = []
    tasks = grid([cell], ["random_search"], [0, 1], budget=SMALL)
    first = run(tasks, tmp_path, progress=lambda record, known: told.append(known))
    again = run(tasks, tmp_path, progress=lambda record, known: told.append(known))
    assert told == [False, False, True, True]
    assert first == again
    changed = [replace(t, budget=Budget(evaluations=61)) for t in tasks]
    assert all(known_record(tmp_path, t) is None for t in changed)


def test_two_workers_give_the_records_of_one(cell, tmp_path):
    tasks = grid([cell], ["random_search"], range(3), budget=SMALL)
    one, two = run(tasks, tmp_path / "one", 1), run(tasks, tmp_path / "two", 2)
    assert [(r["seed"], r["placement"]) for r in one] == [(r["seed"], r["placement"]) for r in two]


def test_a_truncated_record_is_run_again(cell, tmp_path):
    [task] = grid([cell], ["random_search"], [0], budget=SMALL)
    [whole] = run([task], tmp_path)
    path = record_path(tmp_path, task)
    path.write_text(path.read_text()[:100])
    assert known_record(tmp_path, task) is None
    assert run([task], tmp_path)[0]["placement"] == whole["placement"]
    assert json.loads(path.read_text())["key"] == task.key


@pytest.mark.parametrize(
    ("program", "status", "told"),
    [
        ("import os; os.abort()", "FAILED", "ended with -6"),
        ("raise MemoryError('no room')", "FAILED", "no room"),
        ("import time; time.sleep(60)", "TIMEOUT", "killed"),
    ],
)
def test_a_process_that_dies_or_hangs_is_one_record(cell, tmp_path, monkeypatch, program, status, told):
    monkeypatch.setattr(run_module, "GRACE_S", 1.0)
    monkeypatch.setattr(run_module, "WORKER", [sys.executable, "-c", program])
    tasks = grid([cell], ["random_search"], [0], budget=Budget(time_s=0.5))
    [record] = run(tasks, tmp_path)
    assert record["status"] == status
    assert record["verified"] is False
    assert told in record["message"]
    assert record_path(tmp_path, tasks[0]).is_file()


def test_an_unwritable_folder_is_refused_before_anything_runs(cell, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError, match="file"):
        run(grid([cell], ["random_search"], [0]), tmp_path / "file" / "study")
    assert (tmp_path / "file").read_text() == "in the way"


def test_compare_gives_one_row_a_run_with_verified_values_only(cell):
    table = compare(cell, ["random_search", "ga"], seeds=2, budget=SMALL)
    assert len(table) == 4
    assert set(table.solver) == {"random_search", "ga"}
    assert (table.mmr_mean.notna() == table.verified).all()
