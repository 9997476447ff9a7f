"""Bases that may move: what a file may say, which coordinates are free, and the cell once its bases are moved."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from nlpweld.cell import Cell, library_names, load_cell
from nlpweld.cell.files import LIBRARY
from nlpweld.errors import CellError, OptionError

SOUND = (LIBRARY / "cells" / "three_er16.toml").read_text(encoding="utf-8")
BASE = 'base_position_m = [1.0, -1.0, 0.05]\nsource = { base_position_m = "paper, section 4" }\n'  # of handler_1
WHERE = "stations.handler_1.layout"
FREE = ("handler_1.x_m", "handler_1.yaw_rad")


def written(folder: Path, table: str) -> Path:
    """Write the cell with a layout of handler_1."""
    assert BASE in SOUND
    text = SOUND.replace(BASE, f"{BASE}[stations.layout]\n{table}\n")
    path = folder / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def rails(tmp_path: Path) -> Cell:
    """The cell with handler_1 on a rail along x, free to turn."""
    return load_cell(written(tmp_path, 'x_m = [0.8, 1.2]\nyaw_deg = [-29.0, 59.0]\nsource = "chosen"'))


@pytest.mark.parametrize(
    ("table", "field", "words"),
    [
        ('x_m = [1.2, 0.8]\nsource = "a"', WHERE, "x_m [1.2, 0.8] is reversed"),
        ('yaw_deg = [30, -30]\nsource = "a"', WHERE, "yaw_deg [30, -30] is reversed"),
        ('yaw_deg = [-181, 180]\nsource = "a"', WHERE, "more than a whole turn"),
        ('x_m = []\nsource = "a"', f"{WHERE}.x_m.1", "missing"),
        ('x_m = [0.8]\nsource = "a"', f"{WHERE}.x_m.2", "missing"),
        ('x_m = [nan, 1.2]\nsource = "a"', f"{WHERE}.x_m.1", "finite"),
        ('y_m = [-1.0, inf]\nsource = "a"', f"{WHERE}.y_m.2", "finite"),
        ('z_m = [0.0, 0.1]\nsource = "a"', WHERE, "no axis 'z_m'; a base may move along x_m, y_m, yaw_deg"),
        ('yaw_rad = [0.0, 0.1]\nsource = "a"', WHERE, "no axis 'yaw_rad'"),
        ('x_m = [1.1, 1.2]\nsource = "a"', "stations.handler_1", "x_m [1.1, 1.2] leaves out the base, which is at 1"),
        ('yaw_deg = [10, 20]\nsource = "a"', "stations.handler_1", "layout.yaw_deg [10, 20] leaves out"),
        ('source = "a"', WHERE, "state one of x_m, y_m, yaw_deg"),
        ("x_m = [0.8, 1.2]", f"{WHERE}.source", "missing"),
        ("x_m = [0.8, 1.2]\nsource = { y_m = 'a' }", WHERE, "'x_m' has no source"),
    ],
)  # fmt: skip
def test_broken_layout_is_told_in_one_line(tmp_path: Path, table: str, field: str, words: str) -> None:
    path = written(tmp_path, table)
    with pytest.raises(CellError) as caught:
        load_cell(path)
    message = str(caught.value)
    assert message.splitlines() == [message]
    assert message.startswith(f"{path}: {field}: ")
    assert words in message


def test_free_coordinates_of_a_base_come_after_the_placements(rails: Cell) -> None:
    assert rails.variables == ("x_m", "y_m", "z_m", *FREE)
    assert rails.box[:, 3:] == pytest.approx(np.array([[0.8, np.radians(-29)], [1.2, np.radians(59)]]), abs=1e-15)
    assert rails.drift == ()


def test_coordinates_of_a_placement_leave_bases_where_they_are(rails: Cell) -> None:
    x = rails.coordinates(np.array([0.1, 0.2, 0.3]))
    assert x == pytest.approx([0.1, 0.2, 0.3, 1.0, 0.0])
    assert rails.laid_out(x) == rails
    assert rails.placement(x) == pytest.approx([0.1, 0.2, 0.3, 0.0])


def test_moved_cell_says_where_its_bases_are_and_still_holds_them(rails: Cell) -> None:
    x = np.array([0.1, 0.2, 0.3, 1.15, np.radians(45.0)])
    moved = rails.laid_out(x)
    assert moved.stations[0].base_position_m == (1.15, -1.0, 0.05)
    assert moved.stations[0].base_rpy_deg == pytest.approx((0.0, 0.0, 45.0))
    assert moved.stations[1:] == rails.stations[1:]
    assert moved.coordinates(moved.placement(x)) == pytest.approx(x)
    assert rails.layout(x) == {"handler_1": pytest.approx({"x_m": 1.15, "y_m": -1.0, "yaw_rad": np.pi / 4})}
    assert "paper, section 4" in moved.stations[0].source_of("base_position_m")


def test_moved_cell_is_read_back_from_what_a_plan_writes_of_it(rails: Cell) -> None:
    for x in rails.box.T[3]:  # at the bounds, which rounding must not leave
        for yaw in rails.box.T[4]:
            moved = rails.laid_out(np.array([0.1, 0.2, 0.3, x, yaw]))
            back = Cell.model_validate(moved.model_dump(mode="json", exclude_unset=True))
            assert back == moved
            assert back.content_hash != rails.content_hash


def test_sources_do_not_pile_up_as_bases_move_again(rails: Cell) -> None:
    once = rails.laid_out(np.array([0.1, 0.2, 0.3, 1.15, 0.1]))
    twice = once.laid_out(np.array([0.1, 0.2, 0.3, 1.05, 0.2]))
    assert once.stations[0].source == twice.stations[0].source


def test_collapsed_bounds_hold_a_base(tmp_path: Path) -> None:
    held = load_cell(written(tmp_path, 'x_m = [1.0, 1.0]\nyaw_deg = [0.0, 0.0]\nsource = "chosen"'))
    assert held.variables == ("x_m", "y_m", "z_m")
    assert held.layout(held.box[0]) == {}


def test_placement_may_be_held_where_a_base_is_free(rails: Cell) -> None:
    at = {"lower_m": (0.1, -0.2, 0.4), "upper_m": (0.1, -0.2, 0.4)}
    held = rails.with_(search=at)
    assert held.variables == FREE
    assert held.placement(held.box[1]).tolist() == [0.1, -0.2, 0.4, 0.0]
    with pytest.raises(OptionError, match="x_m is held at 0"):
        held.coordinates(np.array([0.2, -0.2, 0.4]))
    with pytest.raises(ValidationError, match="every coordinate is held"):
        load_cell("three_er16").with_(search=at)


@pytest.mark.parametrize("name", library_names("cells"))
def test_content_hash_knows_nothing_of_tables_left_out_nor_of_speeds(name: str) -> None:
    cell = load_cell(name)
    data = json.loads(cell.model_dump_json())
    for owner in (*data["stations"], *([data["positioner"]] if data["positioner"] else [])):
        assert owner["robot"].pop("drives")
        assert owner.pop("layout", None) is None
    del data["timing"], data["uncertainty"]
    bare = json.dumps(data, separators=(",", ":"), ensure_ascii=False)
    assert cell.content_hash == hashlib.sha256(bare.encode()).hexdigest()


def test_content_hash_tells_layouts_apart(tmp_path: Path) -> None:
    tables = ['x_m = [0.8, 1.2]\nsource = "a"', 'x_m = [0.8, 1.3]\nsource = "a"', 'y_m = [-1.2, -1.0]\nsource = "a"']
    cells = [load_cell("three_er16"), *(load_cell(written(tmp_path, table)) for table in tables)]
    assert len({cell.with_(seam={"points": 18}).content_hash for cell in cells}) == 4


def everywhere(cell: Cell, **bounds: tuple[float, float]) -> Cell:
    """Return a cell whose bases may all move."""
    data = cell.model_dump(mode="python", exclude_unset=True)
    for station in data["stations"]:
        station["layout"] = {**bounds, "source": "chosen"}
    return Cell.model_validate(data)


def test_drift_is_where_everything_is_free() -> None:
    torches, headed = load_cell("dual_welder_positioner"), load_cell("three_er16")
    wide, turn = (-2.0, 2.0), (-180.0, 180.0)
    assert everywhere(torches, x_m=wide).drift == ("x_m",)
    assert everywhere(torches, x_m=wide, yaw_deg=turn).with_(search={"yaw_deg": turn}).drift == ("x_m",)
    free = {"x_m": wide, "y_m": wide, "yaw_deg": turn}
    assert everywhere(torches, **free).drift == ("x_m", "y_m")
    assert everywhere(torches, **free).with_(search={"yaw_deg": turn}).drift == ("x_m", "y_m", "yaw_rad")
    assert everywhere(headed, **free).with_(search={"yaw_deg": turn}).drift == ("x_m", "y_m")
