"""Tasks, their keys, and the records they leave."""

import json
from dataclasses import replace
from itertools import pairwise

import pytest

from nlpweld.bench.compare import table
from nlpweld.bench.task import Task, run_task
from nlpweld.cell import Cell
from nlpweld.engine import choice
from nlpweld.solvers import Budget


def test_a_record_is_plain_json_with_claim_and_verdict_apart(task):
    record = run_task(task)
    json.dumps(record.model_dump(mode="json"), allow_nan=False)
    assert record.status == "SOLVED"
    assert record.claimed_objective == pytest.approx(record.report["mmr_mean"], rel=1e-9)
    assert record.verified is record.report["feasible"]
    assert record.evaluations == 200
    assert record.key == task.key


def test_answers_on_the_way_grow_and_end_with_the_runs_own(task):
    record = run_task(replace(task, solver="ga", budget=Budget(evaluations=500)))
    assert 1 < len(record.answers) <= 4
    last = record.answers[-1]
    assert (last.objective, last.verified) == (record.report["mmr_mean"], record.verified)
    assert last.time_s == pytest.approx(record.build_s + record.solve_s)
    for first, then in pairwise(record.answers):
        assert first.time_s <= then.time_s
        assert first.evaluations <= then.evaluations
        assert first.claimed <= then.claimed


def test_same_task_same_record_but_for_times(task):
    timed = {"build_s", "solve_s", "wall_s", "trace", "answers"}
    first, again = (run_task(task).model_dump(exclude=timed) for _ in range(2))
    assert first == again


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 1},
        {"solver": "ga"},
        {"budget": Budget(evaluations=201)},
        {"budget": Budget(evaluations=200, time_s=1.0)},
        {"options": {"batch": 7}},
        {"limit_mb": 4000},
    ],
)
def test_the_key_changes_with_what_decides_the_answer(task, change):
    assert replace(task, **change).key != task.key


def test_the_key_changes_with_the_cell_and_the_preset(task):
    assert replace(task, cell=task.cell.with_(seam={"points": 13})).key != task.key
    ga = replace(task, solver="ga")
    assert replace(ga, preset="paper").key != ga.key


def test_a_label_changes_the_folder_and_not_the_key(task):
    other = replace(task, label="other")
    assert other.key == task.key
    assert other.place.startswith("other/")


def test_a_task_survives_the_way_to_another_process(task):
    there = Task.from_json(json.loads(json.dumps(task.to_json())))
    assert there.key == task.key
    assert there.place == task.place


def test_a_robot_without_a_spherical_wrist_is_a_failed_record_that_says_so(task):
    data = task.to_json()
    data["cell"]["stations"][2]["robot"]["joints"][4]["d_m"] = 0.05
    record = run_task(Task.from_json(data))
    assert record.status == "FAILED"
    assert record.verified is False
    assert "welder" in record.message
    assert "not spherical" in record.message


def test_a_time_limit_is_a_timeout_record_with_the_best_so_far(task):
    record = run_task(replace(task, solver="ga", budget=Budget(time_s=0.3)))
    assert record.status == "TIMEOUT"
    assert record.placement is not None


def test_record_tells_where_free_bases_stand_and_held_ones_not(cell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "find_spec", lambda name: None)  # NumPy is ready sooner than a new cell is compiled
    data = cell.model_dump(mode="python", exclude_unset=True)
    data["stations"][2]["layout"] = {"x_m": (-0.1, 0.1), "source": "test"}
    budget = Budget(evaluations=200)
    free, held = (run_task(Task(c, "random_search", 0, budget=budget)) for c in (Cell.model_validate(data), cell))
    assert list(free.layout) == ["welder"]
    assert -0.1 <= free.layout["welder"]["x_m"] <= 0.1
    assert free.layout["welder"]["y_m"] == 1.0
    assert table([free])["welder.x_m"].tolist() == [free.layout["welder"]["x_m"]]
    assert held.layout == {}
