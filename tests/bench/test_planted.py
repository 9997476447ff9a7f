"""Solvers that lie, crash, hang and eat memory cost one record each, and nothing else."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from nlpweld import solvers
from nlpweld.bench import run as run_module
from nlpweld.bench.engines import Local
from nlpweld.bench.run import run
from nlpweld.bench.task import Task
from nlpweld.cell import load_cell
from nlpweld.report.tables import write_tables
from nlpweld.solvers import Budget

PLANTED = Path(__file__).parent / "planted"


@pytest.fixture
def planted(monkeypatch):
    monkeypatch.setenv("NLPWELD_SOLVERS", str(PLANTED))
    monkeypatch.setattr(solvers, "__path__", [*solvers.__path__, str(PLANTED)])
    monkeypatch.setattr(run_module, "GRACE_S", 6.0)


def alive(command: str) -> bool:
    """Tell whether some process runs with a text in its command line."""
    found = (p / "cmdline" for p in Path("/proc").iterdir() if p.name.isdigit() and p.name != str(os.getpid()))
    return any(command in path.read_bytes().replace(b"\0", b" ").decode() for path in found if path.exists())


@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="looks for processes in /proc")
def test_bad_solvers_cost_one_record_each(cell, tmp_path, planted):
    honest = Task(load_cell("robot_positioner"), "random_search", 0, budget=Budget(evaluations=400))
    bad = [replace(honest, cell=cell, label="bad", solver=name) for name in ("liar", "crasher", "glutton")]
    bad.append(replace(honest, cell=cell, label="bad", solver="hanger", budget=Budget(time_s=0.1)))
    bad[2] = replace(bad[2], limit_mb=1500)
    records = {r.solver: r for r in run([*bad, honest], tmp_path, Local(2))}

    assert records["random_search"].verified
    assert (records["liar"].status, records["liar"].verified) == ("SOLVED", False)
    assert records["crasher"].status == "FAILED"
    assert "SIGSEGV" in records["crasher"].message
    assert any("about to fall" in line for line in records["crasher"].stderr)
    assert records["glutton"].status == "FAILED"
    assert "Unable to allocate" in records["glutton"].message
    assert records["hanger"].status == "TIMEOUT"
    assert "killed after 6 s" in records["hanger"].message
    assert not alive("time.sleep(977)")

    table = write_tables(tmp_path).set_index("solver")
    assert table.loc["liar", ["claimed", "verified"]].tolist() == [1, 0]
    assert table.loc["liar", ["objective_mean", "objective_best"]].isna().all()
    assert table["objective_best"].notna().sum() == 1
