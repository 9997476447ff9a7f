"""Errors of a cell's set-up: what a file may say of them, and the scenarios that stand for them."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from nlpweld.cell import Cell, load_cell
from nlpweld.cell.files import LIBRARY
from nlpweld.cell.uncertainty import samples, vertices
from nlpweld.errors import CellError, OptionError

SOUND = (LIBRARY / "cells" / "three_er16.toml").read_text(encoding="utf-8")
BOX = {"placement_m": (0.002, 0.003, 0.004), "placement_deg": 0.5, "base_m": (0.001,) * 3, "base_deg": 0.1}


def off(**box: object) -> Cell:
    return load_cell("three_er16").with_(uncertainty={**box, "source": "a test"})


@pytest.mark.parametrize(
    ("stated", "told"),
    [
        ('placement_m = [-0.002, 0.002, 0.002]\nsource = "x"', ["uncertainty.placement_m.1: ", "got -0.002"]),
        ('base_m = [0.001, nan, 0.001]\nsource = "x"', ["uncertainty.base_m.2: ", "finite"]),
        ('base_deg = -0.1\nsource = "x"', ["uncertainty.base_deg: ", "got -0.1"]),
        ('placement_deg = [0.5, -0.5]\nsource = "x"', ["uncertainty.placement_deg: ", "number"]),
        ('placement_m = [0.002, -0.002]\nsource = "x"', ["uncertainty.placement_m.2: ", "got -0.002"]),
        ('placment_m = [0.002, 0.002, 0.002]\nsource = "x"', ["uncertainty.placment_m: ", "unknown field"]),
        ("base_deg = 0.1", ["uncertainty.source: ", "missing"]),
        ('base_deg = 0.1\nsource = { base_m = "x" }', ["uncertainty: number 'base_deg' has no source"]),
    ],
)
def test_broken_errors_are_one_line_that_names_the_field(tmp_path: Path, stated: str, told: list[str]) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(SOUND.replace("[objective]", f"[uncertainty]\n{stated}\n[objective]", 1), encoding="utf-8")
    with pytest.raises(CellError) as refused:
        load_cell(path)
    assert "\n" not in str(refused.value)
    for part in told:
        assert part in str(refused.value)


def test_file_states_half_widths(tmp_path: Path) -> None:
    stated = '[uncertainty]\nplacement_m = [0.002, 0.0, 0.001]\nbase_deg = 0.2\nsource = "x"\n[objective]'
    (tmp_path / "cell.toml").write_text(SOUND.replace("[objective]", stated, 1), encoding="utf-8")
    box = load_cell(tmp_path / "cell.toml").uncertainty
    assert box is not None
    assert box.placement.tolist() == [0.002, 0.0, 0.001, 0.0]
    assert box.base == pytest.approx([0.0, 0.0, 0.0, np.radians(0.2)])


def test_content_hash_tells_errors_apart() -> None:
    cell = load_cell("three_er16")
    assert off(base_deg=0.1).content_hash != cell.content_hash
    assert off(base_deg=0.1).content_hash != off(base_deg=0.2).content_hash


def test_table_added_by_with_is_checked_like_a_file() -> None:
    with pytest.raises(ValidationError, match="base_deg"):
        off(base_deg=-1.0)


def test_no_table_is_told_with_the_mend() -> None:
    for drawn in (lambda: vertices(load_cell("three_er16")), lambda: samples(load_cell("three_er16"), 3, 0)):
        with pytest.raises(OptionError, match=r"three_er16: no \[uncertainty\] table .* add one"):
            drawn()


@pytest.mark.parametrize(
    ("box", "count"),
    [
        ({"placement_m": (0.0, 0.0, 0.0)}, 1),
        ({"placement_m": (0.0, 0.0, 0.002)}, 1 + 2),
        ({"placement_m": (0.001,) * 3, "placement_deg": 0.5}, 1 + 16),
        (BOX, 1 + 32 + 8),
    ],
)
def test_scenarios_are_the_stated_cell_and_vertices_each_once(box: dict[str, object], count: int) -> None:
    found = vertices(off(**box))
    assert len(found) == count
    assert not found[0].placement.any()
    assert not found[0].bases.any()
    assert found[0].label == "as stated"
    assert len({(s.placement.tobytes(), s.bases.tobytes()) for s in found}) == count
    assert len({s.label for s in found}) == count


def test_what_depends_on_the_work_as_one_robot_sees_it_is_worst_at_one_of_the_vertices() -> None:
    cell, rng = off(**BOX), np.random.default_rng(5)
    p, b = cell.uncertainty.placement, cell.uncertainty.base
    for _ in range(20):
        slope, yaw, base_yaw = rng.normal(size=3), rng.normal(), rng.normal()
        for k in range(3):
            seen = [
                slope @ (s.placement - s.bases[k])[:3] + yaw * s.placement[3] + base_yaw * s.bases[k, 3]
                for s in vertices(cell)
            ]
            everywhere = np.abs(slope) @ (p + b)[:3] + abs(yaw) * p[3] + abs(base_yaw) * b[3]
            assert max(seen) == pytest.approx(everywhere, rel=1e-12)


def test_samples_fill_the_box_and_come_from_their_seed() -> None:
    cell = off(**BOX)
    drawn = samples(cell, 200, 3)
    widths = np.vstack([cell.uncertainty.placement, *[cell.uncertainty.base] * 3])
    errors = np.array([np.vstack([s.placement, s.bases]) for s in drawn])
    assert (np.abs(errors) <= widths).all()
    assert (errors.max(axis=0) > 0.9 * widths).all()
    assert (errors.min(axis=0) < -0.9 * widths).all()
    assert samples(cell, 200, 3)[7].label == drawn[7].label
    assert samples(cell, 200, 4)[7].label != drawn[7].label


def test_scenarios_say_what_is_off() -> None:
    cell = off(placement_deg=0.5, base_m=(0.0, 0.001, 0.0))
    labels = [s.label for s in vertices(cell)]
    assert "placement +0.5 deg; every base -1 mm in y" in labels
    assert any("base of handler_2 +1 mm in y; " in label for label in labels)
    assert "placement (+2, -3, +4) mm" in [s.label for s in vertices(off(placement_m=(0.002, 0.003, 0.004)))]
