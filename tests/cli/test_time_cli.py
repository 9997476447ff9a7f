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


@pytest.fixture(scope="module")
def timed_file(plan_file):
    from nlpweld.plan import load_plan
    from nlpweld.timing import time_plan

    return time_plan(load_plan(plan_file), 0.04).save(plan_file.parent / "timed.json")


def test_verify_judges_the_timeline_of_a_timed_plan_too(call, timed_file, tmp_path):
    code, shown, _ = call("verify", timed_file)
    assert code == 0
    assert "72 points" not in shown
    assert "18 points: feasible" in shown
    assert "; verified" in shown
    wrong = edited(
        timed_file, tmp_path, lambda data: data["timeline"]["tracks"]["robot_1"]["q_rad"][20].__setitem__(0, 0.5)
    )
    code, shown, _ = call("verify", wrong, "--json")
    report = json.loads(shown)
    assert code == 1
    assert report["violations"] == []  # the points are what they were
    assert report["timing"]["feasible"] is report["feasible"] is False


def test_verify_says_nothing_of_time_where_a_plan_is_not_timed(call, plan_file):
    code, shown, _ = call("verify", plan_file, "--json")
    assert code == 0
    assert "timing" not in json.loads(shown)


@pytest.mark.parametrize("speed", ["1e-300", "1e-9", "1e-6", "1e300"])
def test_speeds_at_which_no_weld_ends(call, plan_file, tmp_path, speed):
    code, shown, told = call("time", plan_file, "--speed", speed, "--out", tmp_path / "timed.json", "--json")
    assert (code, shown) == (2, "")
    assert told.count("\n") == 1
    assert "speed" in told
    assert not (tmp_path / "timed.json").exists()


@pytest.mark.parametrize(
    ("where", "value"),
    [
        (("torch", "jerk_m_s3"), 1e300),
        (("torch", "acceleration_m_s2"), 1e-300),
        (("travel", "speed_m_s"), 1e-6),
        (("travel", "jerk_m_s3"), 1e-300),
        (("stand_off_m",), 1e300),
        (("stand_off_m",), 1e-300),
    ],
)
def test_paces_that_end_nowhere(call, plan_file, tmp_path, where, value):
    def change(data):
        table = data["cell"]["timing"]
        for name in where[:-1]:
            table = table[name]
        table[where[-1]] = value

    code, shown, told = call("time", edited(plan_file, tmp_path, change), "--json")
    assert (code, shown) == (2, "")
    assert told.count("\n") == 1


@pytest.mark.parametrize("kind", ["speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3"])
@pytest.mark.parametrize("value", [1e-300, 1e300])
def test_drives_that_move_nothing(call, plan_file, tmp_path, kind, value):
    def change(data):
        data["cell"]["stations"][0]["robot"]["drives"][kind][0] = value

    code, shown, told = call("time", edited(plan_file, tmp_path, change), "--json")
    assert (code, shown) == (2, "")
    assert told.count("\n") == 1
    assert f"drives.{kind}" in told


@pytest.mark.parametrize("command", [("verify",), ("export", "--format", "csv", "--out", "kept")])
@pytest.mark.parametrize("value", [float("nan"), 1e200])
def test_timelines_that_hold_no_angles(call, timed_file, tmp_path, command, value):
    wrong = edited(
        timed_file, tmp_path, lambda data: data["timeline"]["tracks"]["robot_1"]["q_rad"][7].__setitem__(2, value)
    )
    code, shown, told = call(command[0], wrong, *command[1:])
    assert (code, shown) == (2, "")
    assert "timeline.tracks.robot_1.q_rad: holds NaN or infinity, or nearly" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("option", ["--out", "--figure"])
def test_a_folder_for_a_file_is_refused_before_anything_is_written(call, plan_file, tmp_path, option):
    other = "--figure" if option == "--out" else "--out"
    code, _, told = call("time", plan_file, option, tmp_path, other, tmp_path / "kept")
    assert code == 2
    assert "is a folder" in told
    assert not (tmp_path / "kept").exists()
