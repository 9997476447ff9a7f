"""``nlpweld time``: what it prints and keeps, and bad input."""

import json

import pytest

PLACE = ("--at", 0.0, -1.0, 0.5)


@pytest.fixture(scope="module")
def plan_file(tmp_path_factory):
    from nlpweld.cli import main

    file = tmp_path_factory.mktemp("plan") / "plan.json"
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in ("evaluate", "robot_positioner", *PLACE, "--points", 18, "--out", file)])
    assert ended.value.code == 0
    return file


def edited(plan_file, folder, change):
    data = json.loads(plan_file.read_text())
    change(data)
    other = folder / "edited.json"
    other.write_text(json.dumps(data))
    return other


def test_a_plan_is_timed_verified_drawn_and_kept(call, plan_file, tmp_path):
    out, figure = tmp_path / "timed.json", tmp_path / "timed.png"
    code, shown, _ = call("time", plan_file, "--speed", 0.04, "--out", out, "--figure", figure)
    assert code == 0
    for words in ("cycle ", "arc on ", "; verified", "slowed nowhere", "nearest its limit", "turned by the weld"):
        assert words in shown
    assert figure.read_bytes().startswith(b"\x89PNG")
    code, shown, _ = call("time", out, "--json")  # a timed plan can be timed again: at the speed it was asked for
    report = json.loads(shown)
    assert code == 0
    assert report["speed_m_s"] == 0.04
    assert report["feasible"] is True
    assert [name for name, _, _ in report["phases"]] == ["approach", "plunge", "weld", "withdraw", "retreat"]
    assert json.loads(out.read_text())["timeline"]["t_s"][-1] == pytest.approx(report["cycle_s"])


def test_a_failure_is_told_with_status_1(call, plan_file, monkeypatch):
    from nlpweld.verify import time_rules

    monkeypatch.setattr(time_rules, "STILL", -1.0)
    code, shown, _ = call("time", plan_file, "--speed", 0.04)
    assert code == 1
    assert "NOT verified" in shown


@pytest.mark.parametrize("speed", ["0", "nan", "-0.01"])
def test_speeds_that_are_none(call, plan_file, speed):
    code, _, told = call("time", plan_file, "--speed", speed)
    assert code == 2
    assert told.startswith("nlpweld: speed_m_s")
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data["cell"].pop("timing"), "has no [timing] table"),
        (lambda data: data["cell"]["stations"][0]["robot"].pop("drives"), "drives.speed_deg_s is not stated"),
        (lambda data: data["paths_rad"]["robot_1"][3].__setitem__(1, 0.9), "a plan without closure: robot_1"),
        (lambda data: data["paths_rad"]["robot_1"][3].__setitem__(1, float("nan")), "NaN"),
    ],
)
def test_plans_that_cannot_be_timed(call, plan_file, tmp_path, change, words):
    code, _, told = call("time", edited(plan_file, tmp_path, change))
    assert code == 2
    assert words in told
    assert told.count("\n") == 1
