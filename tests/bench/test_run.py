"""The runner: resumes, keeps failures as data, and refuses a folder it cannot write."""

import sys
from dataclasses import replace

import pytest
from filelock import FileLock

from nlpweld.bench import apart
from nlpweld.bench import run as run_module
from nlpweld.bench.compare import compare
from nlpweld.bench.engines import Local
from nlpweld.bench.run import grid, run
from nlpweld.bench.store import LOCK, known_record, record_path
from nlpweld.errors import OptionError, OutputError
from nlpweld.solvers import Budget

SMALL = Budget(evaluations=60)


class Told:
    def __init__(self):
        self.begun, self.known = [], []

    def begin(self, tasks, slots):
        self.begun.append((tasks, slots))

    def told(self, record, known):
        self.known.append(known)


def answers(records):
    return [(r.seed, r.placement, r.status, r.claimed_objective) for r in records]


def test_the_grid_has_every_combination_once(cell):
    tasks = grid([cell], ["ga", "ga:paper", "random_search"], range(4), budget=SMALL)
    assert len({t.place for t in tasks}) == len(tasks) == 12


def test_an_unknown_solver_stops_the_grid_before_anything_runs(cell):
    with pytest.raises(OptionError, match="ipopd"):
        grid([cell], ["random_search", "ipopd"], [0])


def test_what_is_stored_is_not_run_again_and_what_changed_is(cell, tmp_path):
    told = Told()
    tasks = grid([cell], ["random_search"], [0, 1], budget=SMALL)
    first = run(tasks, tmp_path, watch=told)
    again = run(tasks, tmp_path, watch=told)
    assert told.known == [False, False, True, True]
    assert told.begun == [(2, 1), (2, 1)]
    assert first == again
    changed = [replace(t, budget=Budget(evaluations=61)) for t in tasks]
    assert all(known_record(tmp_path, t) is None for t in changed)


def test_two_workers_give_the_records_of_one(cell, tmp_path):
    tasks = grid([cell], ["random_search"], range(3), budget=SMALL)
    one, two = run(tasks, tmp_path / "one"), run(tasks, tmp_path / "two", Local(2))
    assert answers(one) == answers(two)


def test_a_truncated_record_stops_the_study_and_nothing_is_lost(cell, tmp_path):
    [task] = grid([cell], ["random_search"], [0], budget=SMALL)
    run([task], tmp_path)
    path = record_path(tmp_path, task)
    cut = path.read_text()[:100]
    path.write_text(cut)
    with pytest.raises(OutputError, match=r"seed000\.json: digest"):
        run([task], tmp_path)
    assert path.read_text() == cut


@pytest.mark.parametrize(
    ("program", "status", "told"),
    [
        ("import os; os.abort()", "FAILED", "SIGABRT"),
        ("raise MemoryError('no room')", "FAILED", "no room"),
        ("print('{}')", "FAILED", "no record came back"),
        ("import time; time.sleep(60)", "TIMEOUT", "killed"),
    ],
)
def test_a_process_that_dies_or_hangs_is_one_record(cell, tmp_path, monkeypatch, program, status, told):
    monkeypatch.setattr(run_module, "GRACE_S", 1.0)
    monkeypatch.setattr(apart, "WORKER", [sys.executable, "-c", program])
    tasks = grid([cell], ["random_search"], [0], budget=Budget(time_s=0.5))
    [record] = run(tasks, tmp_path)
    assert record.status == status
    assert record.verified is False
    assert told in record.message
    assert record_path(tmp_path, tasks[0]).is_file()


def test_a_failure_is_kept_unless_it_is_to_be_tried_again(cell, tmp_path, monkeypatch):
    tasks = grid([cell], ["random_search"], [0], budget=SMALL)
    with monkeypatch.context() as broken:
        broken.setattr(apart, "WORKER", [sys.executable, "-c", "raise SystemExit(3)"])
        run(tasks, tmp_path)
    assert run(tasks, tmp_path)[0].status == "FAILED"
    assert run(tasks, tmp_path, again=True)[0].status in ("SOLVED", "INFEASIBLE")


def test_an_unwritable_folder_is_refused_before_anything_runs(cell, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError, match="file"):
        run(grid([cell], ["random_search"], [0]), tmp_path / "file" / "study")
    assert (tmp_path / "file").read_text() == "in the way"


def test_two_runners_do_not_share_a_folder(cell, tmp_path):
    (tmp_path / "records").mkdir()
    tasks = grid([cell], ["random_search"], [0], budget=SMALL)
    with FileLock(tmp_path / "records" / LOCK), pytest.raises(OutputError, match="another run"):
        run(tasks, tmp_path)
    assert not list(tmp_path.rglob("*.json"))
    assert len(run(tasks, tmp_path)) == 1


def test_two_runs_that_want_one_record_are_refused(cell, tmp_path):
    tasks = [t for limit in (60, 61) for t in grid([cell], ["ga"], [0], budget=Budget(evaluations=limit))]
    with pytest.raises(OptionError, match="three_er16/reduced/ga-default/seed000; give one of them a label"):
        run(tasks, tmp_path)


def test_compare_gives_one_row_a_run_with_verified_values_only(cell):
    table = compare(cell, ["random_search", "ga"], seeds=2, budget=SMALL)
    assert len(table) == 4
    assert set(table.solver) == {"random_search", "ga"}
    assert (table.mmr_mean.notna() == table.verified).all()
    assert table["x_m"].notna().all()
