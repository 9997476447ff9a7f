"""Plan files: bit-exact round trips, and one line for each way to spoil one."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.cell import Cell, load_cell, load_positioner
from nlpweld.errors import OutputError, PlanError
from nlpweld.plan import Plan, free_names, joint_counts, load_plan, write_text

CELL = load_cell("three_er16")
DUAL = load_cell("dual_welder_positioner")  # open seam
SINGLE = load_cell("robot_positioner")


def random_plan(cell: Cell, seed: int, points: int = 7) -> Plan:
    """Return a plan of random numbers, of every magnitude a double has."""
    rng = np.random.default_rng(seed)
    shapes = {name: (points, joints) for name, joints in joint_counts(cell).items()}
    paths = {name: rng.normal(size=shape) * 10.0 ** rng.integers(-300, 300, shape) for name, shape in shapes.items()}
    branches = {s.name: ("front", "up", "flip") for s in cell.stations}
    s, yaw = np.sort(rng.random(points)), rng.normal()
    freedom = {name: rng.normal(size=points) for name in free_names(cell)}
    return Plan(cell, rng.normal(size=3), s, paths, branches, yaw_rad=yaw, freedom=freedom)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    return random_plan(CELL, seed=1).save(tmp_path / "plan.json")


@given(st.integers(0, 10_000))
def test_saved_plan_comes_back_to_the_last_bit(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    plan = random_plan((CELL, DUAL, SINGLE)[seed % 3], seed)
    back = load_plan(plan.save(tmp_path_factory.getbasetemp() / "plan.json"))
    assert back.placement_m.tobytes() == plan.placement_m.tobytes()
    assert back.s.tobytes() == plan.s.tobytes()
    assert {name: q.tobytes() for name, q in back.paths.items()} == {n: q.tobytes() for n, q in plan.paths.items()}
    assert back.branches == plan.branches
    assert back.yaw_rad == plan.yaw_rad
    assert {n: u.tobytes() for n, u in back.freedom.items()} == {n: u.tobytes() for n, u in plan.freedom.items()}
    assert back.placement.tolist() == [*plan.placement_m, plan.yaw_rad]


def test_joints_are_those_of_the_robots_and_of_the_positioner() -> None:
    assert joint_counts(CELL) == {"handler_1": 6, "handler_2": 6, "welder": 6}
    assert joint_counts(DUAL) == {"robot_1": 6, "robot_2": 6, "positioner": 2}


def test_plan_without_yaw_has_none(saved: Path) -> None:
    """Plans from before there was a yaw are of the same version."""
    data = json.loads(saved.read_text())
    assert data.pop("yaw_rad") != 0
    saved.write_text(json.dumps(data))
    assert load_plan(saved).yaw_rad == 0.0
    assert load_plan(saved).placement[3] == 0.0


def test_plan_without_freedom_has_none(saved: Path) -> None:
    """None, no table and an empty one are told apart; plans from before there was freedom have none."""
    data = json.loads(saved.read_text())
    assert set(data["freedom_rad"]) == {"yaw", "slope", "rotation", "spin.welder"}
    saved.write_text(json.dumps({**data, "freedom_rad": {}}))
    assert load_plan(saved).freedom == {}
    saved.write_text(json.dumps({**data, "freedom_rad": None}))
    assert load_plan(saved).freedom is None
    assert load_plan(saved).to_json()["freedom_rad"] is None
    del data["freedom_rad"]
    saved.write_text(json.dumps(data))
    assert load_plan(saved).freedom is None


def test_free_angles_are_those_the_couplings_leave() -> None:
    assert free_names(CELL) == ("yaw", "slope", "rotation", "spin.welder")
    torches = tuple(f"{a}.robot_{k}" for k in (1, 2) for a in ("spin", "travel", "work"))
    assert free_names(DUAL) == ("slope", "rotation", *torches)
    held = DUAL.positioner.model_copy(update={"robot": load_positioner("rotator")})
    assert free_names(DUAL.model_copy(update={"positioner": held})) == torches


def test_freedom_is_put_on_a_copy() -> None:
    plan = random_plan(CELL, seed=8)
    spins = {"spin.welder": np.ones(7)}
    other = plan.with_freedom(spins)
    assert other.freedom == spins
    assert other.freedom is not spins
    assert set(plan.freedom) == set(free_names(CELL))
    assert other.paths is plan.paths
    assert other.with_freedom(None).freedom is None


def test_open_seam_has_points_at_both_ends(tmp_path: Path) -> None:
    plan = dataclasses.replace(random_plan(DUAL, seed=6, points=2), s=np.array([0.0, 1.0]))
    assert load_plan(plan.save(tmp_path / "plan.json")).s.tolist() == [0.0, 1.0]


def test_cell_comes_back_equal_and_under_the_same_hash(saved: Path) -> None:
    back = load_plan(saved).cell
    assert back == CELL
    assert back.content_hash == CELL.content_hash


def test_plan_without_branches_comes_back_without(tmp_path: Path) -> None:
    plan = random_plan(CELL, seed=2)
    bare = Plan(plan.cell, plan.placement_m, plan.s, plan.paths)
    assert load_plan(bare.save(tmp_path / "plan.json")).branches is None


def test_plan_saved_twice_is_the_same_file(saved: Path, tmp_path: Path) -> None:
    again = load_plan(saved).save(tmp_path / "again.json")
    assert again.read_bytes() == saved.read_bytes()


def test_saved_plan_takes_the_place_of_the_old_one_and_leaves_nothing_else(saved: Path) -> None:
    random_plan(CELL, seed=3).save(saved)
    assert load_plan(saved).placement_m.tolist() == random_plan(CELL, seed=3).placement_m.tolist()
    assert [path.name for path in saved.parent.iterdir()] == ["plan.json"]


def test_folders_on_the_way_are_made(tmp_path: Path) -> None:
    path = random_plan(CELL, seed=4).save(tmp_path / "a" / "b" / "plan.json")
    assert load_plan(path).cell == CELL


def removed(*keys: str) -> Callable[[Any], None]:
    """Return a change that takes one entry out."""

    def change(data: Any) -> None:
        for key in keys[:-1]:
            data = data[key]
        del data[keys[-1]]

    return change


def put(value: Any, *keys: Any) -> Callable[[Any], None]:
    """Return a change that sets one entry."""

    def change(data: Any) -> None:
        for key in keys[:-1]:
            data = data[key]
        data[keys[-1]] = value

    return change


CHANGES = {  # change of the plan's data, and what the message names
    "no_format": (removed("format"), "format: not a plan file"),
    "other_format": (put("nlpweld-record", "format"), "format: not a plan file"),
    "no_version": (removed("version"), "version: None is not 1"),
    "other_version": (put(2, "version"), "version: 2 is not 1"),
    "no_cell": (removed("cell"), "cell: missing"),
    "no_placement": (removed("placement_m"), "placement_m: missing"),
    "no_s": (removed("s"), "s: missing"),
    "no_paths": (removed("paths_rad"), "paths_rad: missing"),
    "no_path_of_one": (removed("paths_rad", "welder"), "paths_rad.welder: missing"),
    "nan_in_path": (put(float("nan"), "paths_rad", "welder", 3, 2), "paths_rad.welder: holds NaN"),
    "infinity_in_placement": (put(float("inf"), "placement_m", 1), "placement_m: holds NaN or infinity"),
    "nan_in_s": (put(float("nan"), "s", 1), "s: holds NaN"),
    "null_in_path": (put(None, "paths_rad", "welder", 3, 2), "paths_rad.welder: "),
    "text_in_path": (put("fast", "paths_rad", "welder", 3, 2), "paths_rad.welder: "),
    "five_joints": (put([[0.0] * 5] * 7, "paths_rad", "welder"), "paths_rad.welder: not one row of 6 joints"),
    "ragged_path": (put([0.0] * 5, "paths_rad", "welder", 3), "paths_rad.welder: "),
    "missing_point": (removed("paths_rad", "welder", -1), "paths_rad.welder: not one row"),
    "two_coordinates": (put([0.0, 1.0], "placement_m"), "placement_m: not three numbers"),
    "unsorted_s": (put(0.999, "s", 0), "s: not at least three increasing numbers in [0, 1)"),
    "repeated_s": (lambda data: data["s"].__setitem__(1, data["s"][0]), "s: not at least three increasing"),
    "s_of_one": (put(1.0, "s", -1), "s: not at least three increasing"),
    "negative_s": (put(-0.1, "s", 0), "s: not at least three increasing"),
    "two_points": (put([0.1, 0.2], "s"), "s: not at least three increasing"),
    "extra_robot": (put([[0.0] * 6] * 7, "paths_rad", "helper"), "paths_rad.helper: "),
    "path_list": (put([1.0, 2.0], "paths_rad"), "paths_rad: "),
    "branch_of_no_robot": (put(["front", "up", "flip"], "branches", "helper"), "branches.helper: "),
    "branch_of_two_words": (put(["front", "up"], "branches", "welder"), "branches.welder: "),
    "branch_of_no_such_name": (put(["front", "up", "left"], "branches", "welder"), "branches.welder: "),
    "branch_list": (put([1], "branches"), "branches: "),
    "broken_cell": (put(-1.0, "cell", "workpiece", "main_radius_m"), "cell.workpiece.main_radius_m: "),
    "cell_of_two_of_one_name": (put("welder", "cell", "stations", 0, "name"), "cell: stations: two are named"),
    "number_too_large": (put(10**400, "placement_m", 1), "placement_m: not an array of numbers"),
    "number_for_cell": (put(5, "cell"), "cell: "),
    "infinite_yaw": (put(float("inf"), "yaw_rad"), "yaw_rad: holds NaN or infinity"),
    "freedom_list": (put([0.0], "freedom_rad"), "freedom_rad: not a table by angle"),
    "freedom_of_no_name": (put([0.0] * 7, "freedom_rad", "pitch"), "freedom_rad.pitch: the cell has no free angle"),
    "freedom_of_handler": (put([0.0] * 7, "freedom_rad", "spin.handler_1"), "freedom_rad.spin.handler_1: "),
    "travel_of_heading": (put([0.0] * 7, "freedom_rad", "travel.welder"), "freedom_rad.travel.welder: "),
    "slope_alone": (removed("freedom_rad", "rotation"), "freedom_rad.slope: alone"),
    "rotation_alone": (removed("freedom_rad", "slope"), "freedom_rad.rotation: alone"),
    "freedom_too_short": (removed("freedom_rad", "yaw", -1), "freedom_rad.yaw: not one number for each of 7"),
    "freedom_too_deep": (put([[0.0]] * 7, "freedom_rad", "yaw"), "freedom_rad.yaw: not one number for each of 7"),
    "nan_in_freedom": (put(float("nan"), "freedom_rad", "yaw", 3), "freedom_rad.yaw: holds NaN"),
    "yaw_list": (put([0.0], "yaw_rad"), "yaw_rad: not a number"),
}
POSITIONER_CHANGES = {
    "no_path": (removed("paths_rad", "positioner"), "paths_rad.positioner: missing"),
    "one_joint": (put([[0.0]] * 7, "paths_rad", "positioner"), "paths_rad.positioner: not one row of 2 joints"),
    "branch": (put(["front", "up", "flip"], "branches", "positioner"), "branches.positioner: "),
    "other_name": (put([[0.0, 0.0]] * 7, "paths_rad", "table"), "paths_rad.table: "),
    "s_beyond_one": (put(1.001, "s", -1), "s: not at least two increasing numbers in [0, 1]"),
    "yaw": (put([0.0] * 7, "freedom_rad", "yaw"), "freedom_rad.yaw: the cell has no free angle"),
    "one_point": (put([0.1], "s"), "s: not at least two increasing numbers in [0, 1]"),
}


def complaint(path: Path) -> str:
    """Return the message of the PlanError that loading this file must raise, which is one line and names the file."""
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    message = str(caught.value)
    assert message.splitlines() == [message]
    assert message.startswith(f"{path}: ")
    return message.removeprefix(f"{path}: ")


@pytest.mark.parametrize(("change", "words"), CHANGES.values(), ids=CHANGES)
def test_spoiled_plan_is_told_in_one_line_with_file_and_field(
    saved: Path, change: Callable[[Any], None], words: str
) -> None:
    data = json.loads(saved.read_text())
    change(data)
    saved.write_text(json.dumps(data))
    assert complaint(saved).startswith(words)


@pytest.mark.parametrize(("change", "words"), POSITIONER_CHANGES.values(), ids=POSITIONER_CHANGES)
def test_spoiled_plan_with_a_positioner_is_told(tmp_path: Path, change: Callable[[Any], None], words: str) -> None:
    path = random_plan(DUAL, seed=7).save(tmp_path / "plan.json")
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))
    assert complaint(path).startswith(words)


@pytest.mark.parametrize("text", ["", "plan", "{", "[1, 2", '"', "\ud83d", "[" * 100_000], ids=lambda t: repr(t[:7]))
def test_file_that_is_not_json_is_told_so(tmp_path: Path, text: str) -> None:
    (tmp_path / "plan.json").write_bytes(text.encode("utf-8", "surrogatepass"))
    assert complaint(tmp_path / "plan.json").startswith("not JSON (")


@pytest.mark.parametrize("text", ["[]", "5", "null", "{}", '{"format": []}'])
def test_json_that_is_not_a_plan_is_told_so(tmp_path: Path, text: str) -> None:
    (tmp_path / "plan.json").write_text(text)
    assert complaint(tmp_path / "plan.json").startswith("format: not a plan file")


def test_plan_cut_short_anywhere_is_refused(saved: Path) -> None:
    whole = saved.read_text()
    for share in (0.01, 0.3, 0.6, 0.9, 0.999):
        saved.write_text(whole[: int(share * len(whole))])
        assert complaint(saved).startswith("not JSON (")


def test_missing_plan_is_told_with_the_reason(tmp_path: Path) -> None:
    assert complaint(tmp_path / "none.json") == "cannot be read (No such file or directory); check the path"


def test_folder_is_not_a_plan(tmp_path: Path) -> None:
    assert complaint(tmp_path) == "cannot be read (Is a directory); check the path"


def test_plan_below_a_file_cannot_be_written_and_leaves_the_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OutputError) as caught:
        random_plan(CELL, seed=5).save(tmp_path / "file" / "x.json")
    reason = "cannot be written (its folder is a file); choose another --out"
    assert str(caught.value) == f"{tmp_path / 'file' / 'x.json'}: {reason}"
    assert (tmp_path / "file").read_text() == "mine"
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


def test_plan_onto_a_folder_cannot_be_written_and_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "x.json").mkdir()
    with pytest.raises(OutputError, match=r"x\.json: cannot be written \(Is a directory\)"):
        write_text(tmp_path / "x.json", "text")
    assert [path.name for path in tmp_path.iterdir()] == ["x.json"]


def test_text_that_cannot_be_encoded_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = write_text(tmp_path / "x.txt", "old")
    with pytest.raises(UnicodeEncodeError):
        write_text(path, "\ud800")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["x.txt"]
