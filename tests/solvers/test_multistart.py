"""Many starts: what they find, that processes change nothing, and what a lost one costs."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from nlpweld.solvers import Budget, make_solver
from nlpweld.solvers.multistart import Multistart
from tests.solvers.toys import disc, ripples

LOCAL = {"inner_preset": "plain", "starts": 12}  # from one random point each


def solve(nlp, seed=0, budget=None, **options):
    return make_solver("multistart", **{**LOCAL, **options}).solve(nlp, seed=seed, budget=budget or Budget())


def seeds_of(count, seed=0):
    return [start.seed for start in Multistart(starts=count)._starts(seed, Budget())]


def same(one, other):
    assert np.array_equal(one.x, other.x)
    assert one.status == other.status
    assert one.objective == other.objective
    assert one.starts == pytest.approx(other.starts, abs=0.0, nan_ok=True)
    assert one.evaluations == other.evaluations
    assert one.sharpening == other.sharpening


def test_finds_the_best_of_many_maxima_where_one_start_does_not():
    single = make_solver("ipopt", "plain").solve(ripples(), seed=3, budget=Budget())
    many = solve(ripples(), seed=3, workers=1)
    assert single.objective < 0.9
    assert many.objective == pytest.approx(1.0, abs=1e-6)
    assert many.objective == max(many.starts)
    found = sum(np.array(many.starts) > 0.999)
    assert 1 <= found < len(many.starts) == 12
    assert f"{found} of 12 starts within 0.1 %" in many.message


def test_the_first_start_is_the_inner_solver_s_own_run_on_that_seed():
    single = make_solver("ipopt", "plain").solve(ripples(), seed=5, budget=Budget())
    many = solve(ripples(), seed=5, workers=1)
    assert many.starts[0] == single.objective
    assert len(set(seeds_of(12, 5))) == 12


def test_processes_of_their_own_change_nothing_about_the_answer(tmp_path):
    alone = solve(ripples(), seed=1, workers=1)
    two = solve(ripples(slow_s=0.02, seen=str(tmp_path)), seed=1, workers=2)
    same(alone, two)
    assert alone.message == two.message
    assert len(alone.trace) == len(two.trace)
    assert (np.diff([step.time_s for step in two.trace]) >= 0).all()
    pids = {int(path.name) for path in tmp_path.iterdir()}
    assert len(pids) == 2
    assert not any(alive(pid) for pid in pids)


def test_a_start_that_goes_wrong_or_kills_its_process_is_lost_alone():
    killed, wrong = seeds_of(6)[1], seeds_of(6)[4]
    here = solve(ripples(wrong=wrong), workers=1, starts=6)
    apart = solve(ripples(wrong=wrong, deadly=killed), workers=2, starts=6)
    assert "1 lost: ValueError: a start that cannot be drawn" in here.message
    assert "2 lost: ValueError: a start that cannot be drawn, process ended with -9" in apart.message
    assert np.flatnonzero(np.isnan(here.starts)).tolist() == [4]
    assert np.flatnonzero(np.isnan(apart.starts)).tolist() == [1, 4]
    assert [s for k, s in enumerate(apart.starts) if k not in (1, 4)] == [
        *here.starts[:1],
        *here.starts[2:4],
        here.starts[5],
    ]
    assert apart.status == "SOLVED"


def test_when_every_start_is_lost_the_run_has_failed():
    outcome = solve(ripples(wrong=0), workers=1, starts=1)
    assert outcome.status == "FAILED"
    assert outcome.x is None


def test_nothing_feasible_ends_infeasible_at_the_nearest_miss():
    outcome = solve(ripples(radius=-0.5), workers=1, starts=3)
    assert outcome.status == "INFEASIBLE"
    assert np.isnan(outcome.starts).all()
    assert np.linalg.norm(outcome.x) < 0.05
    assert "0 of 3" in outcome.message


@pytest.mark.parametrize("limit", [4, 90, 1200])
def test_a_budget_of_evaluations_is_dealt_out_and_kept(limit):
    outcome = solve(ripples(), budget=Budget(evaluations=limit), least=30, starts=8, workers=1)
    assert outcome.evaluations <= max(limit, 4)
    assert len(outcome.starts) == {4: 1, 90: 3, 1200: 8}[limit]
    assert ("evaluation limit" in outcome.message) == (limit == 4)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_time_limit_is_everyone_s(workers):
    outcome = solve(ripples(slow_s=0.2), workers=workers, budget=Budget(time_s=2.0))  # three looks or more a start
    assert outcome.status == "TIMEOUT"
    assert outcome.message.startswith("time limit")
    assert len(outcome.starts) == 12
    assert np.isfinite(outcome.starts).sum() < 10


def test_what_cannot_be_rebuilt_is_solved_in_this_process():
    outcome = solve(disc(0.4), workers=2, starts=2)
    assert outcome.status == "SOLVED"


def test_an_inner_solver_that_cannot_take_it_is_told():
    assert "makes no sense" in make_solver("multistart", inner="multistart").unsuitable(disc())
    free = make_solver("multistart", inner="random_search")
    assert free.unsuitable(disc()) is None
    assert len(free.solve(disc(), seed=0, budget=Budget(evaluations=1600)).starts) == 3


SCRIPT = """
from nlpweld.solvers import Budget, make_solver
from tests.solvers.toys import ripples

nlp = ripples(slow_s=60.0, seen={seen!r})
make_solver("multistart", workers=2, inner_preset="plain").solve(nlp, seed=0, budget=Budget())
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_a_run_that_is_stopped(tmp_path, how):
    # a script without a main guard, which spawned processes must not run again
    run = subprocess.Popen([sys.executable, "-c", SCRIPT.format(seen=str(tmp_path))], stderr=subprocess.DEVNULL)
    until(lambda: len(list(tmp_path.iterdir())) == 2)
    run.send_signal(how)
    assert run.wait(20.0) != 0
    pids = [int(path.name) for path in tmp_path.iterdir()]
    until(lambda: not any(alive(pid) for pid in pids))
    assert len(list(tmp_path.iterdir())) == 2


def alive(pid):
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


def until(true, limit_s=20.0):
    end = time.monotonic() + limit_s
    while not true():
        assert time.monotonic() < end
        time.sleep(0.05)
