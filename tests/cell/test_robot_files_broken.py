"""Broken robot files: one line that names the file, the field and the mend."""

from pathlib import Path

import pytest

from nlpweld.cell import load_robot
from nlpweld.errors import CellError

SOUND = """\
title = "two links"
zero_flange_m = [0.9, 0.0, 0.3]
reach_m = 0.9
[[joints]]
a_m = 0.5
d_m = 0.3
alpha_deg = 0.0
lower_deg = -90.0
upper_deg = 120.0
[[joints]]
a_m = 0.4
d_m = 0.0
alpha_deg = 0.0
lower_deg = -150.0
upper_deg = 150.0
[source]
joints = "drawing"
zero_flange_m = "drawing"
reach_m = "drawing"
[drives]
speed_deg_s = [100.0, 110.0]
source = "drawing"
[[bodies]]
name = "arm"
start = { frame = "link0", at_m = [0.0, 0.0, 0.1] }
end = { frame = "link2" }
radius_m = 0.05
source = "chosen"
"""

# (what is wrong, text replaced once in SOUND, its replacement, the field named, what the message must say)
BROKEN = [
    ("missing", 'title = "two links"\n', "", "title: ", "missing"),
    ("missing_but_sourced", "reach_m = 0.9\n", "", "reach_m: ", "missing; add it"),
    ("missing_in_joint", "d_m = 0.3\n", "", "joints.1.d_m: ", "missing"),
    ("unknown", "reach_m = 0.9\n", "reach_m = 0.9\ncolour = 1.0\n", "colour", "colour"),
    ("unknown_in_joint", "d_m = 0.3\n", "d_m = 0.3\nbacklash = 0.1\n", "joints.1.backlash: ", "unknown field"),
    ("misspelt_in_joint", "lower_deg = -90.0", "lowr_deg = -90.0", "joints.1.lowr_deg: ", "'lower_deg'"),
    ("misspelt_in_body", "radius_m = 0.05", "radus_m = 0.05", "bodies.arm.radus_m: ", "'radius_m'"),
    ("nan", "a_m = 0.5", "a_m = nan", "joints.1.a_m: ", "finite"),
    ("infinite", "upper_deg = 120.0", "upper_deg = inf", "joints.1.upper_deg: ", "finite"),
    ("negative_reach", "reach_m = 0.9", "reach_m = -0.9", "reach_m: ", "greater than 0"),
    ("negative_radius", "radius_m = 0.05", "radius_m = -0.05", "bodies.arm.radius_m: ", "greater than 0"),
    ("negative_speed", "[100.0, 110.0]", "[-100.0, 110.0]", "drives.speed_deg_s.1: ", "greater than or equal"),
    ("speed_of_one_joint", "[100.0, 110.0]", "[100.0]", "drives.speed_deg_s", "1 numbers for 2 joints"),
    ("sign_of_two", "a_m = 0.5", "a_m = 0.5\nsign = 2", "joints.1.sign: ", "got 2"),
    ("truth_for_number", "a_m = 0.5", "a_m = true", "joints.1.a_m: ", "valid number"),
    ("text_for_number", "a_m = 0.5", 'a_m = "0.5"', "joints.1.a_m: ", "valid number"),
    ("empty_source", 'source = "chosen"', 'source = " "', "bodies.arm: ", "source of 'source' is empty"),
    ("missing_source", 'source = "chosen"\n', "", "bodies.arm.source: ", "missing"),
    ("missing_source_of_one", 'reach_m = "drawing"\n', "", "'reach_m'", "has no source"),
    ("source_of_nothing", 'reach_m = "drawing"\n', 'reach_m = "drawing"\nmass = "x"\n', "'mass'", "does not have"),
    ("joints_unsourced", 'joints = "drawing"\n', "", "'joints'", "has no source"),
    ("empty_text_in_source_table", 'reach_m = "drawing"', 'reach_m = ""', "'reach_m'", "is empty"),
    ("number_for_source", 'source = "chosen"', "source = 5", "bodies.arm.source: ", "valid string, got 5"),
    ("number_in_source_table", 'reach_m = "drawing"', "reach_m = 5", "source.reach_m: ", "valid string, got 5"),
    ("body_ends_unsourced", 'source = "chosen"', 'source = { radius_m = "chosen" }', "'start'", "has no source"),
    ("reversed_limits", "lower_deg = -90.0", "lower_deg = 130.0", "joints.1: lower_deg", "not below upper_deg"),
    ("body_on_no_link", 'frame = "link2"', 'frame = "link3"', "'arm'", "link0 to link2"),
    ("body_on_tcp", 'frame = "link2"', 'frame = "tcp"', "'arm'", "link0 to link2"),
    ("body_on_link_02", 'frame = "link2"', 'frame = "link02"', "bodies.arm.end.frame: ", "got 'link02'"),
    ("body_on_nonsense", 'frame = "link2"', 'frame = "elbow"', "bodies.arm.end.frame: ", "got 'elbow'"),
    ("not_toml", "reach_m = 0.9", "reach_m = ", "not TOML", "line 3"),
]


def complaint(path: Path, text: str) -> str:
    """Load a robot file with this text and return the message of the CellError it must raise."""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CellError) as caught:
        load_robot(path)
    return str(caught.value)


def test_sound_file_loads(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(SOUND, encoding="utf-8")
    assert load_robot(path).name == "arm"


@pytest.mark.parametrize(("old", "new", "field", "words"), [b[1:] for b in BROKEN], ids=[b[0] for b in BROKEN])
def test_broken_file_is_told_in_one_line_with_file_and_field(
    tmp_path: Path, old: str, new: str, field: str, words: str
) -> None:
    assert old in SOUND
    message = complaint(tmp_path / "arm.toml", SOUND.replace(old, new, 1))
    assert message.splitlines() == [message]
    assert message.startswith(f"{tmp_path / 'arm.toml'}: ")
    assert field in message
    assert words in message


def test_misspelt_robot_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(CellError, match=r"^er16_160: .*did you mean 'er16_1600'\?$"):
        load_robot("er16_160")


def test_missing_robot_file_is_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(CellError) as caught:
        load_robot(tmp_path / "none.toml")
    assert str(caught.value).splitlines() == [str(caught.value)]
    assert str(tmp_path / "none.toml") in str(caught.value)
