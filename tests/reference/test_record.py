"""Reference files: what is written comes back, what does not belong is refused in one line."""

import json
from pathlib import Path

import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.errors import NlpweldError, ReferenceFileError
from nlpweld.reference.record import Reference, load_reference, regret


@pytest.fixture
def known() -> Cell:
    return load_cell("robot_positioner")


@pytest.fixture
def reference(known: Cell) -> Reference:
    return Reference(
        cell=known.name,
        content_hash=known.content_hash,
        formulation="reduced",
        objective=0.5,
        placement=[0.0, -1.0, 0.5, 0.0],
        branches={"robot_1": ["front", "up", "flip"]},
        objective_with_margins=0.49,
        placement_with_margins=[0.0, -1.0, 0.5, 0.0],
        upper_bound=0.505,
        rigorous=True,
        boxes=100,
        open_boxes=0,
        levels_points=72,
        seed=0,
        candidates=64,
        how={"objective": "sampled"},
        versions={"nlpweld": "0"},
    )


def test_it_comes_back_as_it_was_written(reference: Reference, known: Cell, tmp_path: Path) -> None:
    path = reference.save(tmp_path / "folder" / "r.json")
    assert load_reference(path, known) == load_reference(path) == reference
    data = json.loads(path.read_text(encoding="utf-8"))
    assert data["gap"] == pytest.approx(1 - 0.5 / 0.505)
    assert data["gap_with_margins"] == pytest.approx(1 - 0.49 / 0.505)


def test_without_a_bound_there_is_no_gap(reference: Reference, tmp_path: Path) -> None:
    from dataclasses import replace

    path = replace(reference, upper_bound=None).save(tmp_path / "r.json")
    assert load_reference(path).gap == float("inf")
    assert json.loads(path.read_text(encoding="utf-8"))["gap"] is None
    assert regret(0.7, load_reference(path)).at_most == float("inf")


def test_another_version_of_the_cell_is_refused(reference: Reference, known: Cell, tmp_path: Path) -> None:
    path = reference.save(tmp_path / "r.json")
    changed = known.with_(constraints={"clearance_m": 0.011})
    with pytest.raises(
        ReferenceFileError, match=r"r\.json: content_hash: built for another version of 'robot_posit"
    ) as e:
        load_reference(path, changed)
    assert isinstance(e.value, NlpweldError)
    assert "\n" not in str(e.value)
    with pytest.raises(ReferenceFileError, match=r"is of 'robot_positioner', not of 'three_er16'"):
        load_reference(path, load_cell("three_er16"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "x"}, "format: not a reference"),
        ({"version": 9}, "version: 9 is not 1"),
        ({"objective": "high"}, "objective: 'high' is not a number"),
        ({"upper_bound": float("nan")}, "upper_bound: nan is not a number"),
        ({"objective": True}, "objective: True is not a number"),
        ({"boxes": ...}, "boxes: missing"),
    ],
)
def test_a_file_that_was_edited_is_refused(reference: Reference, tmp_path: Path, change: dict, message: str) -> None:
    path = reference.save(tmp_path / "r.json")
    data = {**json.loads(path.read_text(encoding="utf-8")), **change}
    path.write_text(json.dumps({k: v for k, v in data.items() if v is not ...}), encoding="utf-8")
    with pytest.raises(ReferenceFileError, match=message):
        load_reference(path)


@pytest.mark.parametrize(("text", "message"), [(None, "cannot be read"), ("{", "not JSON"), ("[]", "not a reference")])
def test_what_is_no_reference_is_refused(tmp_path: Path, text: str | None, message: str) -> None:
    path = tmp_path / "r.json"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(ReferenceFileError, match=message):
        load_reference(path)


def test_regret_is_told_against_both(reference: Reference) -> None:
    lost = regret(0.48, reference)
    assert (lost.at_least, lost.at_most) == (pytest.approx(0.02), pytest.approx(0.025))
    assert regret(0.503, reference).at_least < 0.0


def test_nobody_beats_the_bound(reference: Reference) -> None:
    assert regret(0.505, reference).at_most == 0.0
    with pytest.raises(ReferenceFileError, match=r"0\.5051 is above the bound 0\.505"):
        regret(0.5051, reference)
