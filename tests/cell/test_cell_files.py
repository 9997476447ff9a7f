"""Broken cell files: one line that names the file, the field and the mend."""

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from nlpweld.cell import Cell, load_cell
from nlpweld.cell.files import LIBRARY
from nlpweld.errors import CellError

SOUND = (LIBRARY / "cells" / "three_er16.toml").read_text(encoding="utf-8")
TORCH = 'tool = "torch"'
LOOSE = SOUND[SOUND.index('kind = "loose"') :]  # the welder's coupling, to the end of the file
TIGHT = 'kind = "tight"\nposition_m = [0.25, 0.0, 0.0]\nazimuth_deg = 210.0\nelevation_deg = -60.0'
UP = "x_reference = [0.0, 0.0, 1.0]"
ALONG = "x_reference = [-0.8660254037844386, -0.5, 0.0]"  # the approach of azimuth 210 and elevation 0, to round-off
H1 = 'name = "handler_1"\n'

# (what is wrong, text replaced once in SOUND, its replacement, the field named first, what the message must say)
BROKEN = [
    ("missing", "points = 72\n", "", "seam.points: ", "missing; add it"),
    ("missing_table", '[posture]\nrule = "flat"\n', "[seam.posture]\n", "seam.posture: ", "did you mean"),
    ("missing_in_station", "elevation_deg = -60.0\n", "", "stations.handler_1.coupling.elevation_deg: ", "missing"),
    ("missing_name", H1, "", "stations.1.name: ", "missing; add it"),
    ("missing_kind", 'kind = "tight"\n', "", "stations.handler_1.coupling.kind: ", "missing; add it"),
    ("missing_robot", 'robot = "er16_1600"\n', "", "stations.handler_1.robot: ", "missing or not a name"),
    ("missing_tool", 'tool = "gripper"\n', "", "stations.handler_1.tool: ", "there are gripper, torch"),
    ("unknown", "points = 72\n", "points = 72\ncolour = 1.0\n", "seam.colour: ", "unknown field; remove it"),
    ("unknown_at_top", "[placements]", "colour = 1.0\n[placements]", "colour: ", "unknown field; remove it"),
    ("misspelt", "main_radius_m", "main_radus_m", "workpiece.main_radus_m: ", "did you mean 'main_radius_m'?"),
    ("misspelt_in_coupling", "azimuth_deg", "azimut_deg", "stations.handler_1.coupling.azimut_deg: ", "'azimuth_deg'?"),
    ("misspelt_in_tool", "radius_m = 0.03", "radus_m = 0.03", "tools.torch.bodies.torch_body.radus_m: ", "'radius_m'?"),
    ("nan", "clearance_m = 0.010", "clearance_m = nan", "constraints.clearance_m: ", "finite"),
    ("infinite", "base_position_m = [1.0", "base_position_m = [inf", "stations.handler_1.base_position_m.1: ", "finit"),
    ("negative", "clearance_m = 0.010", "clearance_m = -0.010", "constraints.clearance_m: ", "equal to 0, got -0.01"),
    ("zero_step", "verify_step_m = 0.005", "verify_step_m = 0", "constraints.verify_step_m: ", "greater than 0, got 0"),
    ("text_for_number", "main_length_m = 0.50", 'main_length_m = "0.5"', "workpiece.main_length_m: ", "got '0.5'"),
    ("truth_for_number", "main_length_m = 0.50", "main_length_m = true", "workpiece.main_length_m: ", "got True"),
    ("number_for_text", 'reading = "paper"', "reading = 16", "objective.reading: ", "got 16"),
    ("number_for_source", "[objective]", "[objective]\nsource = 5", "", "Cannot overwrite a value"),
    ("two_numbers_for_three", "lower_m = [-0.6, -1.0, 0.1]", "lower_m = [-0.6, -1.0]", "search.lower_m.3: ", "missing"),
    ("four_numbers_for_three", "paper = [0.023,", "paper = [0.0, 0.023,", "placements.paper: ", "at most 3 items"),
    ("thick_branch", "branch_radius_m = 0.05", "branch_radius_m = 0.1", "workpiece: branch_radius_m 0.1", "thinner"),
    ("short_main_pipe", "main_length_m = 0.50", "main_length_m = 0.2", "workpiece: main_length_m", "lengthen"),
    ("branch_inside", "branch_top_m = 0.35", "branch_top_m = 0.1", "workpiece: branch_top_m", "inside the main pipe"),
    ("reversed_box", "upper_m = [0.6, 0.6,", "upper_m = [0.6, -1.1,", "search: lower_m.y -1 is not below", "swap them"),
    ("no_points", "points = 72", "points = 0", "seam.points: ", "equal to 3, got 0"),
    ("half_a_point", "points = 72", "points = 2.5", "seam.points: ", "valid integer, got 2.5"),
    ("two_of_one_name", 'name = "handler_2"', 'name = "handler_1"', "stations: ", "'handler_1'; rename one"),
    ("none_tight", None, None, "stations: none is coupled 'tight'", "couple at least one"),
    ("none_loose", LOOSE, f'{TIGHT}\n{UP}\nsource = "x"\n', "stations: none is coupled 'loose'", "couple at least"),
    ("no_such_pair", "nozzle/branch", "nozle/branch", "stations.welder.coupling.may_touch: ", "mean 'nozzle/branch'?"),
    ("unknown_tool", TORCH, 'tool = "torches"', "stations.welder.tool: no tool 'torches'", "did you mean 'torch'?"),
    ("list_for_tool", TORCH, 'tool = ["torch"]', "stations.welder.tool: ", "not a name"),
    ("unknown_robot", "er16_1600", "er61_1600", "stations.handler_1.robot: er61_1600", "did you mean 'er16_1600'?"),
    ("reference_along_approach", f"elevation_deg = -60.0\n{UP}", f"elevation_deg = 0.0\n{ALONG}",
     "stations.handler_1.coupling: x_reference", "choose another"),
    ("zero_reference", UP, "x_reference = [0.0, 0.0, 0.0]", "stations.handler_1.coupling: x_reference", "choose"),
    ("unknown_kind", 'kind = "loose"', 'kind = "glued"', "stations.welder.coupling.kind: 'glued'", "'tight', 'loose'"),
    ("unused_tool", "[[stations]]", '[tools.spare]\ntranslation_m = [0, 0, 0]\nsource = "x"\n[[stations]]',
     "tools.spare: no station uses it", "remove it"),
    ("tools_not_tables", "[tools.gripper]", "[tools]\nspare = 5\n[tools.gripper]", "tools.spare: ", "got 5"),
    ("stations_not_tables", None, None, "stations: ", "write [[stations]]"),
    ("body_like_the_robots", 'name = "nozzle"', 'name = "wrist"', "stations.welder: two bodies", "'wrist'; rename one"),
    ("body_like_the_floor", 'name = "nozzle"', 'name = "floor"', "stations.welder: body 'floor'", "rename it"),
    ("tool_body_beyond_flange", 'start = { frame = "link6" }\nend = { frame = "tcp", at_m = [0.0, 0.0, -0.12] }',
     'start = { frame = "link7" }\nend = { frame = "tcp" }', "stations.welder.tool", "the flange is link6"),
    ("unsourced", 'source = { base_position_m = "paper, section 4" }', "source = {}",
     "stations.handler_1: number 'base_position_m'", "add source.base_position_m"),
    ("not_toml", "points = 72", "points = ", "not TOML: ", "mend the syntax"),
]  # fmt: skip
WHOLE = {  # broken in more than one place
    "none_tight": re.sub('kind = "tight".*?(?=source)', 'kind = "loose"\nheading_deg = 90.0\n', SOUND, flags=re.DOTALL),
    "stations_not_tables": SOUND[: SOUND.index("[[stations]]")] + "[stations]\nwelder = 1\n",
}


def complaint(path: Path) -> str:
    """Return the message of the CellError that loading this file must raise."""
    with pytest.raises(CellError) as caught:
        load_cell(path)
    return str(caught.value)


@pytest.mark.parametrize("case", BROKEN, ids=[case[0] for case in BROKEN])
def test_broken_cell_is_told_in_one_line_with_file_field_and_mend(tmp_path: Path, case: tuple[str, ...]) -> None:
    name, old, new, field, words = case
    text = WHOLE[name] if old is None else SOUND.replace(old, new, 1)
    assert text != SOUND
    path = tmp_path / "cell.toml"
    path.write_text(text, encoding="utf-8")
    message = complaint(path)
    assert message.splitlines() == [message]
    assert message.startswith(f"{path}: {field}")
    assert words in message


def test_misspelt_cell_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(CellError, match=r"^three_er61: .*did you mean 'three_er16'\?$"):
        load_cell("three_er61")


@pytest.mark.parametrize("name", ["none.toml", "folder", "x" * 5000, "null\0", ""], ids=lambda name: repr(name[:9]))
def test_path_without_a_file_is_told_with_the_names_there_are(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    message = complaint(tmp_path / name)
    assert message.splitlines() == [message]
    assert message.startswith(f"{tmp_path / name}: no such file")
    assert "three_er16" in message


def test_file_that_may_not_be_read_is_told_with_the_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path, **_: str) -> str:
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "cell.toml"
    path.touch()
    monkeypatch.setattr(Path, "read_text", refuse)
    assert complaint(path) == f"{path}: cannot be read (Permission denied); check the path and its permissions"


def test_file_of_other_bytes_than_text_is_not_toml(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_bytes(b"\xff\xfe\x00")
    message = complaint(path)
    assert message.splitlines() == [message]
    assert message.startswith(f"{path}: not TOML: ")


def test_broken_robot_file_is_named_instead_of_the_cell(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('title = "mine"\n', encoding="utf-8")
    (tmp_path / "cell.toml").write_text(SOUND.replace('"er16_1600"', '"mine.toml"', 1), encoding="utf-8")
    message = complaint(tmp_path / "cell.toml")
    assert message.startswith(f"{tmp_path / 'mine.toml'}: ")
    assert "missing; add it (+" in message


def test_robot_file_beside_the_cell_is_found(tmp_path: Path) -> None:
    robot = (LIBRARY / "robots" / "gp25.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(robot, encoding="utf-8")
    (tmp_path / "cell.toml").write_text(SOUND.replace('"er16_1600"', '"mine.toml"', 1), encoding="utf-8")
    assert [s.robot.name for s in load_cell(tmp_path / "cell.toml").stations] == ["mine", "er16_1600", "er16_1600"]


def test_with_replaces_only_the_named_fields() -> None:
    cell = load_cell("three_er16")
    other = cell.with_(seam={"points": 36})
    assert other.seam.points == 36
    assert other.with_(seam={"points": 72}) == cell


def test_with_refuses_what_a_file_may_not_say() -> None:
    with pytest.raises(ValidationError, match="greater than or equal to 3"):
        load_cell("three_er16").with_(seam={"points": 2})


def test_content_hash_tells_cells_apart_by_value_and_by_source() -> None:
    cell = load_cell("three_er16")
    others = [cell.with_(seam={"points": 36}), cell.with_(seam={"source": "other"})]
    assert len({c.content_hash for c in [cell, *others]}) == 3
    assert load_cell("three_er16").content_hash == cell.content_hash


def test_hash_of_a_cell_stays_where_the_usual_is_said_and_changes_where_another_objective_is() -> None:
    cell = load_cell("three_er16")
    assert "over_seam" not in cell.model_dump_json()
    assert cell.with_(objective={"over_seam": "mean", "exponent": None}).content_hash == cell.content_hash
    soft = [{"over_seam": "soft_minimum", "exponent": p} for p in (1.0, 8.0)]
    others = [cell.with_(objective=fields) for fields in ({"over_seam": "minimum"}, *soft)]
    assert len({c.content_hash for c in [cell, *others]}) == 4
    again = Cell.model_validate_json(others[2].model_dump_json(exclude_unset=True))
    assert (again.objective.over_seam, again.objective.exponent) == ("soft_minimum", 8.0)
    assert again.content_hash == others[2].content_hash


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"over_seam": "soft_minimum"}, "needs an exponent"),
        ({"over_seam": "minimum", "exponent": 8.0}, "remove it"),
        ({"exponent": 8.0}, "remove it"),
        ({"over_seam": "soft_minimum", "exponent": 0.0}, "greater than 0"),
        ({"over_seam": "median"}, "soft_minimum"),
    ],
)
def test_exponent_goes_with_the_soft_minimum_alone(fields: dict[str, object], told: str) -> None:
    with pytest.raises(ValidationError, match=told):
        load_cell("three_er16").with_(objective=fields)
