"""The task file of Cao et al.: where boxes go, what axes do, and bad files in one line."""

from pathlib import Path

import numpy as np
import pytest

from nlpweld.cell.files import LIBRARY
from nlpweld.errors import CellError
from nlpweld.palletising import PalletTask, load_pallet_task
from nlpweld.palletising.cycle import ways

SOUND = (LIBRARY / "palletising" / "cao_25_boxes.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def task() -> PalletTask:
    return load_pallet_task()


def test_layers_are_five_boxes_each_other_one_turned(task: PalletTask) -> None:
    places = task.places_m
    assert len(places) == 25
    first, second = places[:5], places[5:10]
    np.testing.assert_allclose(first[:, :2] + second[:, :2], [[0.0, 2.8]] * 5, atol=1e-12)
    np.testing.assert_allclose(places[::5, 2], [0.4, 0.6, 0.8, 1.0, 1.2], atol=1e-12)
    assert task.heights_m[:, 20].tolist() == [0.4, 0.8, 1.4, 1.2]


def test_boxes_of_a_layer_touch_and_do_not_overlap(task: PalletTask) -> None:
    for layer in range(2):
        spots = task.places_m[5 * layer : 5 * layer + 5]
        along = np.round(spots[:, 3] / 90) % 2 == 0
        half = np.where(along[:, None], [0.3, 0.2], [0.2, 0.3])
        gaps = np.abs(spots[:, None, :2] - spots[None, :, :2]) - (half[:, None] + half[None])
        apart = gaps.max(axis=-1) + 10.0 * np.eye(5)
        assert (apart > -1e-9).all()
        assert apart.min() < 1e-9


def test_axes_go_what_cylindrical_coordinates_say(task: PalletTask) -> None:
    way = ways(task)
    assert (way.swing_deg.min(), way.swing_deg.max()) == pytest.approx((71.565051, 108.434949))
    np.testing.assert_allclose(way.reach_m[[1, 3]], [0.0, np.hypot(0.3, 1.7) - 1.2], atol=1e-12)
    assert (way.reach_s.max(), way.wrist_s.max()) == pytest.approx((0.70085, 0.53331), abs=1e-5)
    assert (way.swing_s.min(), way.swing_s.max()) == pytest.approx((0.93638, 1.24362), abs=1e-5)
    gripper = way.swing_deg + way.wrist_deg
    np.testing.assert_allclose((gripper - task.places_m[:, 3] + 90.0) % 180.0, 90.0)


def test_every_number_says_whether_the_paper_has_it(task: PalletTask) -> None:
    assert task.cycle.source_of("rise_m").startswith("paper")
    assert task.cycle.source_of("z_a_m").startswith("chosen")
    assert "calibrated" in task.axes.B.source_of("jerk_m_s3")


def test_another_number_is_another_task(task: PalletTask) -> None:
    other = task.with_(axes={"B": {"speed_m_s": 1.4}}, cycle={"z_a_m": 1.9})
    assert (other.axes.B.speed_m_s, other.axes.B.jerk_m_s3, other.cycle.z_a_m) == (1.4, 100.8, 1.9)
    assert other.content_hash != task.content_hash
    assert task.with_().content_hash == task.content_hash


BAD = [
    ("speed_deg_s = 120.0", "speed_deg_s = 0.0", "axes.A.speed_deg_s: input should be greater"),
    ("jerk_m_s3 = 100.8", "jerk_m_s3 = -100.8", "axes.B.jerk_m_s3: input should be greater"),
    ("z_a_m = 2.0", "z_a_m = 1.3", "z_a_m 1.3 is under the 1.4 m"),
    ("rise_m = 0.4", "rise_m = nan", "cycle.rise_m: input should be a finite number"),
    ("[1.2, 0.0, 0.4]", "[1e308, 1e308, 0.4]", "pick.at_m.1: input should be less than"),
    ("[1.2, 0.0, 0.4]", "[0.0, 0.0, 0.4]", "lies on the base axis"),
    ("rise_m = 0.4", "ryse_m = 0.4", "did you mean 'rise_m'?"),
    ("layers = 5", "layers = 0", "stack.layers"),
    ("layers = 5", "layers = true", "stack.layers"),
    ('box_m = "paper, section 4"\n', "", "number 'box_m' has no source"),
    ('"round_trip"', '"twice"', "cycle.reading"),
]


@pytest.mark.parametrize(("old", "new", "told"), BAD, ids=[new or "no source" for _, new, _ in BAD])
def test_a_bad_file_is_told_in_one_line(tmp_path: Path, old: str, new: str, told: str) -> None:
    assert old in SOUND
    path = tmp_path / "bad.toml"
    path.write_text(SOUND.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(CellError) as error:
        load_pallet_task(path)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_an_unknown_task_lists_those_there_are() -> None:
    with pytest.raises(CellError, match="there are cao_25_boxes"):
        load_pallet_task("zzz")
