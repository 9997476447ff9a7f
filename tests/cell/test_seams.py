"""Composite and polyline seams as files state them, and broken ones told in one line."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from nlpweld.cell.files import checked
from nlpweld.cell.seam_csv import polyline_from_csv, with_rows
from nlpweld.cell.seams import Composite, Polyline
from nlpweld.errors import CellError

SOUND = """\
curve = "composite"
points = 61
start_m = [0.0, 0.0, 0.2]
pieces = [
  { kind = "line", to_m = [0.0, 0.0, 0.0] },
  { kind = "arc", centre_m = [0.1, 0.0, 0.0], axis = [0.0, -1.0, 0.0], angle_deg = 180.0 },
  { kind = "line", to_m = [0.2, 0.0, 0.2] },
]
side = [0.0, -1.0, 0.0]
source = "drawing"
"""
CSV = """\
x_m,y_m,z_m,nx,ny,nz
0.0,0.0,0.0,0.0,0.0,1.0
0.1,0.0,0.0,0.0,0.0,1.0
0.1,0.1,0.0,0.0,0.0,2.0
0.1,0.2,0.1,0.0,0.0,1.0
"""

# (what is wrong, text replaced once in SOUND, its replacement, what the message must say)
BROKEN = [
    ("no_length", "to_m = [0.0, 0.0, 0.0]", "to_m = [0.0, 0.0, 0.2]", "seam: piece 1: line of zero length"),
    ("off_plane", "centre_m = [0.1, 0.0,", "centre_m = [0.1, 0.01,", "piece 2: arc is not joined: its start is 0.01 m"),
    ("no_radius", "centre_m = [0.1,", "centre_m = [0.0,", "seam: piece 2: centre_m is where the arc starts"),
    ("no_axis", "axis = [0.0, -1.0,", "axis = [0.0, 0.0,", "seam: piece 2: axis is zero"),
    ("no_angle", "angle_deg = 180.0", "angle_deg = 0.0", "seam: piece 2: angle_deg is 0;"),
    ("above_a_turn", "angle_deg = 180.0", "angle_deg = -361.0", "seam: piece 2: angle_deg is -361;"),
    ("arc_turns_back", "angle_deg = 180.0", "angle_deg = -180.0", "seam: piece 2 turns back by 180 deg from piece 1"),
    ("line_turns_back", "to_m = [0.2, 0.0, 0.2]", "to_m = [0.1, 0.0, -0.2]", "piece 3 turns back by 153.4 deg from"),
    ("side_along_line", "side = [0.0, -1.0, 0.0]", "side = [0.0, 0.0, 5.0]", "parallel to the tangent of piece 1"),
    ("side_along_arc", "side = [0.0, -1.0, 0.0]", "side = [0.5, 0.0, -0.5]", "parallel to the tangent of piece 2"),
    ("no_side", "side = [0.0, -1.0, 0.0]", "side = [0.0, 0.0, 0.0]", "seam: side is zero"),
    ("closes_backwards", "points = 61", "points = 61\nclosed = true", "piece 1 turns back by 180 deg from piece 3"),
    ("one_point", "points = 61", "points = 1", "seam.points: "),
    ("nan", "to_m = [0.2,", "to_m = [nan,", "seam.pieces.3.to_m.1: input should be a finite number"),
    ("misspelt", "angle_deg = 180.0", "angle = 180.0", "seam.pieces.2.angle: unknown field"),
    ("unknown_kind", 'kind = "arc"', 'kind = "spline"', "seam.pieces.2.kind: 'spline' is not one of 'line', 'arc'"),
    ("no_pieces", SOUND[SOUND.index("pieces"): SOUND.index("side")], "pieces = []\n", "seam.pieces: "),
    ("no_source", 'source = "drawing"\n', "", "seam.source: missing"),
    ("truth_as_text", "points = 61", 'points = 61\nclosed = "yes"', "seam.closed: "),
]  # fmt: skip


def composite(text: str) -> Composite:
    """Return the seam of a TOML text, checked as a cell file's ``[seam]`` table would be."""
    return checked(Composite, tomllib.loads(text), Path("cell.toml"), "seam")


def test_sound_seam_loads_and_its_numbers_survive_json() -> None:
    seam = composite(SOUND)
    assert seam.points == 61
    assert Composite.model_validate_json(seam.model_dump_json()) == seam


@pytest.mark.parametrize(("old", "new", "words"), [b[1:] for b in BROKEN], ids=[b[0] for b in BROKEN])
def test_broken_seam_is_told_in_one_line(old: str, new: str, words: str) -> None:
    assert SOUND.count(old) >= 1
    with pytest.raises(CellError) as caught:
        composite(SOUND.replace(old, new, 1))
    assert str(caught.value).splitlines() == [str(caught.value)]
    assert str(caught.value).startswith("cell.toml: ")
    assert words in str(caught.value)


def test_closed_seam_with_a_gap_is_told() -> None:
    last = '{ kind = "line", to_m = [0.2, 0.0, 0.2] },'
    arch = last + '\n  { kind = "arc", centre_m = [0.1, 0.0, 0.2], axis = [0.0, -1.0, 0.0], angle_deg = 180.0 },'
    assert composite(SOUND.replace(last, arch).replace("points = 61", "points = 61\nclosed = true")).closed
    with pytest.raises(CellError, match=r"seam: closed, but piece 4 ends 0\.0\d+ m away from start_m; join them"):
        composite(SOUND.replace(last, arch.replace("180", "150")).replace("points = 61", "points = 61\nclosed = true"))


def test_least_sine_of_an_arc_is_that_of_many_tangents() -> None:
    track = composite(SOUND).track
    for direction in np.random.default_rng(1).normal(size=(50, 3)):
        unit = direction / np.linalg.norm(direction)
        for piece in range(3):
            along = np.linspace(0, track.length_m[piece], 2001)
            tangents = track.at(np.full(2001, piece), along)[1]
            least = np.linalg.norm(np.cross(tangents, unit), axis=1).min()
            assert track.least_sine(unit)[piece] == pytest.approx(least, abs=1e-3)


def test_right_angle_between_pieces_is_allowed() -> None:
    assert len(composite(SOUND.replace("to_m = [0.2, 0.0, 0.2]", "to_m = [0.5, 0.0, 0.0]")).pieces) == 3


def csv_seam(tmp_path: Path, text: str, **options: bool) -> Polyline:
    """Return the seam of a CSV text."""
    path = tmp_path / "seam.csv"
    path.write_text(text, encoding="utf-8")
    return polyline_from_csv(path, points=20, source="measured", **options)


def test_polyline_holds_the_rows_of_its_file(tmp_path: Path) -> None:
    seam = csv_seam(tmp_path, CSV)
    assert seam.vertices_m[3] == (0.1, 0.2, 0.1)
    assert seam.normals[2] == (0.0, 0.0, 2.0)
    assert seam.track.length_m == pytest.approx([0.1, 0.1, np.sqrt(0.02)], abs=1e-15)
    assert Polyline.model_validate_json(seam.model_dump_json()) == seam


def test_file_of_a_seam_table_is_looked_up_beside_the_cell(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text("\ufeff" + CSV, encoding="utf-8")
    table = with_rows({"curve": "polyline", "points": 9, "file": "rows.csv", "source": "measured"}, tmp_path)
    assert "file" not in table
    assert Polyline.model_validate(table).points == 9
    assert with_rows({"curve": "saddle"}, tmp_path) == {"curve": "saddle"}


# (what is wrong, text replaced once in CSV, its replacement, what the message must say)
BROKEN_CSV = [
    ("header", "x_m,y_m,z_m", "x,y,z", "seam.csv: line 1: header is 'x,y,z,nx,ny,nz'; write 'x_m,y_m,z_m,nx,ny,nz'"),
    ("empty", CSV, "", "seam.csv: line 1: header is ''"),
    ("short_row", "0.1,0.0,0.0,0.0,0.0,1.0", "0.1,0.0,0.0", "seam.csv: line 3: 3 fields instead of 6"),
    ("text", "0.1,0.0,0.0,", "0.1,zero,0.0,", "seam.csv: line 3: '0.1,zero,0.0,0.0,0.0,1.0' holds something else than"),
    ("nan", "0.1,0.0,0.0,", "nan,0.0,0.0,", "vertices_m.2.1: input should be a finite number"),
    ("infinite_normal", "0.0,0.0,2.0", "0.0,0.0,inf", "normals.3.3: input should be a finite number"),
    ("one_row", CSV[CSV.index("0.1,0.0,0.0,"):], "", "vertices_m: "),
    ("duplicate", "0.1,0.1,0.0,0", "0.1,0.0,0.0,0", "vertex 3 is where vertex 2 is"),
    ("turns_back", "0.1,0.2,0.1", "0.1,0.05,0.01", "from vertex 3 turns back by 168.7 deg from"),
    ("normal_along", "0.1,0.0,0.0,0.0,0.0,1.0", "0.1,0.0,0.0,0.0,1.0,0.0", "start of the piece from vertex 2 is"),
    ("normal_along_end", "0.1,0.0,0.0,0.0,0.0,1.0", "0.1,0.0,0.0,1.0,0.0,0.0", "end of the piece from vertex 1 is"),
    ("no_normal", "0.0,0.0,2.0", "0.0,0.0,0.0", "normal of vertex 3 is zero"),
    ("normal_flips", "0.0,0.0,2.0", "0.0,0.0,-2.0", "normal turns by more than 90 deg along the piece from vertex 2"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), [b[1:] for b in BROKEN_CSV], ids=[b[0] for b in BROKEN_CSV])
def test_broken_rows_are_told_in_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in CSV
    with pytest.raises(CellError) as caught:
        csv_seam(tmp_path, CSV.replace(old, new, 1))
    assert str(caught.value).splitlines() == [str(caught.value)]
    assert str(caught.value).startswith(str(tmp_path / "seam.csv"))
    assert words in str(caught.value)


def test_repeated_first_row_of_a_closed_seam_is_told(tmp_path: Path) -> None:
    ring = "x_m,y_m,z_m,nx,ny,nz\n" + "".join(f"{x},{y},0.0,0.0,0.0,1.0\n" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    assert csv_seam(tmp_path, ring, closed=True).track.length_m == pytest.approx(np.ones(4))
    assert len(csv_seam(tmp_path, ring + "0,0,0,0,0,1\n").vertices_m) == 5  # open, and ends where it starts
    with pytest.raises(CellError, match=r"vertex 1 is where vertex 5 is; .* do not repeat the first point"):
        csv_seam(tmp_path, ring + "0,0,0,0,0,1\n", closed=True)


def test_missing_rows_are_told(tmp_path: Path) -> None:
    with pytest.raises(CellError, match=r"none\.csv: cannot be read \(No such file or directory\)"):
        polyline_from_csv(tmp_path / "none.csv", points=5, source="measured")


def test_normals_that_are_too_few_are_told(tmp_path: Path) -> None:
    data = csv_seam(tmp_path, CSV).model_dump()
    with pytest.raises(CellError, match="seam: normals: 3 for 4 vertices_m; give one for each"):
        checked(Polyline, {**data, "normals": data["normals"][:3]}, Path("cell.toml"), "seam")
