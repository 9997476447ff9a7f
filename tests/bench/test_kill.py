"""The runner is killed at random instants; what it then resumes to equals an undisturbed run, apart from times."""

import random
import signal
import subprocess
import sys
import time

import pytest

from nlpweld.records.files import read_record, record_files

KILLS, SEEDS = 20, 120
PROGRAM = """
import sys
from pathlib import Path
from nlpweld.bench import apart
from nlpweld.bench.engines import Local
from nlpweld.bench.run import run
from nlpweld.bench.study import load_study
from nlpweld.bench.task import failed
tasks = load_study("study.toml")
for task in tasks:
    if not Path(f"answer{task.seed}").exists():
        Path(f"answer{task.seed}").write_text(failed(task, "none", 0.1, "INFEASIBLE").model_dump_json())
apart.WORKER = [sys.executable, "-I", "-S", "worker.py"]
run(tasks, Path(sys.argv[1]), Local(2))
"""
# tells an answer made beforehand, so that a task takes some 50 ms and kills fall everywhere
WORKER = """
import json, sys, time
seed = json.loads(sys.stdin.readline())["task"]["seed"]
time.sleep(0.01 * (seed % 3))
print(open(f"answer{seed}").read())
"""
STUDY = f'title = "kill"\n[[runs]]\ncells = ["three_er16"]\nsolvers = ["random_search"]\nseeds = {SEEDS}\n'


@pytest.fixture
def start(tmp_path):
    """Start the runner on a folder of a name."""
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "worker.py").write_text(WORKER)

    def run(name):
        command = [sys.executable, "-c", PROGRAM, name]
        return subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)

    return run


def stored(folder):
    return {path.relative_to(folder).as_posix(): read_record(path) for path in record_files(folder)}


def untimed(records):
    return {name: record.model_copy(update={"wall_s": 0.0}) for name, record in records.items()}


def count(folder):
    return len(list(record_files(folder)))


def wait_for(runner, folder, more):
    """Wait until a folder holds so many records more, or the runner has ended."""
    wanted = count(folder) + more
    while count(folder) < wanted and runner.poll() is None:
        time.sleep(0.005)


def test_twenty_kills_change_nothing(tmp_path, start):
    rng = random.Random(5)
    held, killed = 0, tmp_path / "killed"
    for kill in range(KILLS):
        runner = start("killed")
        if kill % 4:  # else it may not even have begun
            wait_for(runner, killed, 1)
        time.sleep(rng.uniform(0.0, 0.1))
        runner.send_signal(signal.SIGKILL)
        runner.communicate()
        records = stored(killed)  # raises if one of them is not whole
        assert len(records) >= held
        held = len(records)
    assert KILLS // 2 < held < SEEDS
    for runner in (start("killed"), start("whole")):
        _, err = runner.communicate()
        assert runner.returncode == 0, err
    undisturbed = stored(tmp_path / "whole")
    assert len(undisturbed) == SEEDS
    assert untimed(stored(killed)) == untimed(undisturbed)
