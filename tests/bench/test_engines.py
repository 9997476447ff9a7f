"""Where jobs run: the same study here and on Dask, and a scheduler that is not there."""

import sys

import pytest

from nlpweld.bench.engines import OnDask, engine_of
from nlpweld.bench.run import grid, run
from nlpweld.errors import OptionError
from nlpweld.solvers import Budget

distributed = pytest.importorskip("distributed")
TIMES = {"wall_s", "build_s", "solve_s", "trace", "answers", "machine"}


@pytest.mark.filterwarnings("default")  # of Dask's own
def test_a_local_cluster_gives_the_records_of_one_worker(cell, tmp_path):
    tasks = grid([cell], ["random_search"], range(2), budget=Budget(evaluations=60))
    here = run(tasks, tmp_path / "here")
    there = run(tasks, tmp_path / "there", OnDask("local", 2))
    assert [r.model_dump(exclude=TIMES) for r in here] == [r.model_dump(exclude=TIMES) for r in there]


@pytest.mark.filterwarnings("default")
def test_a_scheduler_that_is_not_there_is_named(monkeypatch):
    monkeypatch.setattr("nlpweld.bench.engines.ANSWER_S", 0.5)
    with pytest.raises(OptionError, match=r"--scheduler tcp://127.0.0.1:9: nobody answers .* 'dask scheduler'"):
        engine_of(scheduler="tcp://127.0.0.1:9")


def test_dask_that_is_not_installed_is_said_with_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(OptionError, match=r"pip install 'nlpweld\[dask\]'"):
        engine_of(scheduler="local")
