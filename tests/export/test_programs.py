"""The programs of controllers: what holds robots together, where they stop, and what names and numbers look like."""

import dataclasses
import re

import numpy as np
import pytest

from nlpweld.errors import OptionError
from nlpweld.export import export_plan
from nlpweld.export.text import number
from tests.export.timed import carried, turned


@pytest.fixture(scope="module")
def rapid():
    return export_plan(carried(), "rapid").files


@pytest.fixture(scope="module")
def krl():
    return export_plan(carried(), "krl").files


def test_rapid_moves_of_one_id_and_time_are_made_together(rapid):
    moves = [re.findall(r"\\ID:=(\d+)\\NoEOffs,v1000\\T:=([\d.]+),(\w+),", text) for text in rapid.values()]
    assert list(rapid) == ["w1_handler_1.mod", "w2_handler_2.mod", "w3_welder.mod"]
    assert moves[0] == moves[1] == moves[2]
    ids = [int(number) for number, _, _ in moves[0]]
    assert ids == list(range(10, 10 * len(ids) + 1, 10))
    assert sum(float(t) for _, t, _ in moves[0]) == pytest.approx(21.5, abs=1e-9)
    for text in rapid.values():
        assert '{3}:=[["T_ROB1"],["T_ROB2"],["T_ROB3"]];' in text
        assert text.index("v50,fine") < text.index("SyncMoveOn") < text.index("\\ID:=10\\") < text.index("SyncMoveOff")


def test_rapid_of_one_robot_is_not_synchronised():
    (text,) = export_plan(turned(), "rapid").files.values()
    assert "Sync" not in text
    assert "\\ID" not in text
    assert "external axes of robot_1" in text


def test_rapid_stops_where_the_plan_rests_and_nowhere_else(rapid):
    zones = re.findall(r"\\T:=([\d.]+),(\w+),", rapid["w3_welder.mod"])
    stops = np.cumsum([float(t) for t, _ in zones])[[zone == "fine" for _, zone in zones]]
    assert stops == pytest.approx([1.5, 21.5])
    assert {zone for _, zone in zones} == {"fine", "z1"}


def test_krl_blocks_take_the_time_of_their_parts(krl):
    assert list(krl) == [f"w{k}_{n}.{e}" for k, n in ((1, "handler_1"), (2, "handler_2"), (3, "welder")) for e in DATA]
    for name in ("w1_handler_1", "w3_welder"):
        text = krl[f"{name}.src"]
        blocks = re.findall(r"PTP_SPLINE\n(.*?)ENDSPLINE", text, re.S)
        assert len(blocks) == text.count("; sync") == 2
        for block, seconds in zip(blocks, (1.5, 20.0), strict=True):
            parts = [float(x) for x in re.findall(r"PART=([\d.]+)", block)]
            assert float(re.search(r"END=([\d.]+)", block)[1]) == pytest.approx(seconds)
            assert sum(parts) == pytest.approx(seconds, abs=1e-9)
            assert block.count("SPTP") == len(parts)
            assert block.count("TIME_BLOCK START") == block.count("TIME_BLOCK END") == 1
        assert f"DEF {name}( )" in text
        assert f"DEFDAT {name}" in krl[f"{name}.dat"]


DATA = ("src", "dat")


@pytest.mark.parametrize("format", ["rapid", "krl"])
def test_the_arc_is_on_from_the_welds_first_point(format):
    text = next(iter(export_plan(carried(), format).files.values()))
    moved = r"T:=([\d.]+)" if format == "rapid" else r"PART=([\d.]+)"
    before, after = text.split("weld: arc on")
    assert sum(float(t) for t in re.findall(moved, before)) == pytest.approx(1.5)
    assert sum(float(t) for t in re.findall(moved, after)) == pytest.approx(20.0)


def test_csv_tells_where_the_arc_is_on():
    rows = [line.split(",")[:3] for line in export_plan(carried(), "csv").files["joints.csv"].splitlines()[1:]]
    on = [float(t) for t, _, arc in rows if arc == "1"]
    assert min(on) == 1.5
    assert max(on) < 21.5
    assert rows[-1] == ["21.500000", "1.000000000", "0"]


def test_names_are_what_controllers_take():
    plan = carried()
    odd = ["a+b-c", "a-b+c", "welder_with_a_name_that_is_longer_than_any_controller_takes"]
    stations = tuple(s.model_copy(update={"name": n}) for s, n in zip(plan.cell.stations, odd, strict=True))
    tracks = dict(zip(odd, plan.timeline.tracks.values(), strict=True))
    renamed = dataclasses.replace(plan, cell=plan.cell.model_copy(update={"stations": stations}))
    renamed = renamed.timed(dataclasses.replace(plan.timeline, tracks=tracks))
    for format, longest, word in (("rapid", 32, "MODULE"), ("krl", 24, "DEF")):
        files = export_plan(renamed, format, 1.0).files
        names = {name.rpartition(".")[0] for name in files}
        assert len(names) == 3
        assert all(re.fullmatch(r"[A-Za-z]\w*", name) and len(name) <= longest for name in names)
        assert all(any(f"{word} {name}" in text for text in files.values()) for name in names)
        assert all(len(proc) <= 32 for text in files.values() for proc in re.findall(r"PROC (\w+)", text))


def test_a_title_cannot_leave_its_comment():
    plan = turned()
    robot = plan.cell.stations[0].robot.model_copy(update={"title": "arm\nMoveAbsJ home; \u00e9"})
    station = plan.cell.stations[0].model_copy(update={"robot": robot})
    spoiled = dataclasses.replace(plan, cell=plan.cell.model_copy(update={"stations": (station,)}))
    for format in ("rapid", "krl"):
        for text in export_plan(spoiled, format, 1.0).files.values():
            assert text.isascii()
            assert all(line.lstrip()[0] in "!;" for line in text.splitlines() if "arm MoveAbsJ home" in line)
            assert "\nMoveAbsJ home" not in text


@pytest.mark.parametrize("format", ["rapid", "krl"])
def test_an_arm_of_seven_joints_is_refused(format):
    plan = turned()
    robot = plan.cell.stations[0].robot
    robot = robot.model_copy(update={"joints": (*robot.joints, robot.joints[-1])})
    station = plan.cell.stations[0].model_copy(update={"robot": robot})
    track = plan.timeline.tracks["robot_1"]
    wide = dataclasses.replace(
        track, **{f: np.hstack([getattr(track, f)] * 2)[:, :7] for f in ("q", "rate", "acceleration")}
    )
    spoiled = dataclasses.replace(plan, cell=plan.cell.model_copy(update={"stations": (station,)}))
    spoiled = spoiled.timed(dataclasses.replace(plan.timeline, tracks={**plan.timeline.tracks, "robot_1": wide}))
    assert export_plan(spoiled, "csv", 1.0).points
    with pytest.raises(OptionError, match="'robot_1' has 7 joints"):
        export_plan(spoiled, format, 1.0)


def test_numbers_have_no_exponent_and_zero_no_sign():
    assert [number(x) for x in (-1e-9, 1e-7, -12.5, 1e6)] == ["0.000000", "0.000000", "-12.500000", "1000000.000000"]
    assert number(-0.4, 0) == "0"
    assert number(-0.6, 0) == "-1"
