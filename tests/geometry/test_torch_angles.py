"""Torch rotations from travel, work and spin angle, and back."""

import numpy as np
import pytest

from nlpweld.errors import KinematicsError
from nlpweld.geometry.torch_angles import height_squared, torch_angles, torch_pose, torch_rotation

RANDOM = 20_000
DEG = np.pi / 180


def random_torches(seed: int, margin: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return travel, work and spin, half of them on or within 1e-1 to 1e-17 of where no direction has both.

    Args:
        seed: of the draw.
        margin: least share of the room between the borders that is kept from them.
    """
    rng = np.random.default_rng(seed)
    travel = rng.uniform(1e-9, np.pi / 2, RANDOM)
    share = rng.uniform(0, 1, RANDOM)
    share[: RANDOM // 2] = 10.0 ** rng.uniform(-17, -1, RANDOM // 2)
    share[: RANDOM // 10] = 0.0
    share = np.clip(np.where(rng.random(RANDOM) < 0.5, share, 1 - share), margin, 1 - margin)
    return travel, -(np.pi / 2 + (2 * share - 1) * travel), rng.uniform(-np.pi, np.pi, RANDOM)


def test_rotations_are_orthonormal_and_right_handed() -> None:
    R = torch_rotation(*random_torches(seed=1))
    assert np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() < 2e-15
    assert np.linalg.det(R) == pytest.approx(np.ones(RANDOM), abs=1e-14)


def test_travel_and_work_are_the_angles_to_the_root_axis_and_to_y() -> None:
    travel, work, spin = random_torches(seed=2)
    z_H = torch_rotation(travel, work, spin)[..., 2]
    assert np.abs(z_H[:, 0] - np.cos(travel)).max() < 1e-15
    assert np.abs(z_H[:, 1] - np.cos(work)).max() < 1e-15
    assert z_H[:, 2].min() >= 0.0


def test_travel_and_work_come_back_to_1e12_up_to_the_border() -> None:
    travel, work, spin = random_torches(seed=3)
    found_travel, found_work, _ = torch_angles(torch_rotation(travel, work, spin))
    assert np.abs(found_travel - travel).max() < 1e-12
    assert np.abs(found_work - work).max() < 1e-12


def test_spin_comes_back_to_1e12_and_of_a_spoilt_rotation_to_what_the_work_angle_leaves() -> None:
    rng = np.random.default_rng(4)
    travel, work, spin = random_torches(seed=4)
    travel[:5000], work[:5000] = np.pi / 2, -(10.0 ** rng.uniform(-9, 0, 5000))  # close to along y
    R = torch_rotation(travel, work, spin)
    for rotation, weight, bound in ((R, 1.0, 1e-12), (R + rng.uniform(-1e-14, 1e-14, R.shape), np.sin(-work), 3e-14)):
        error = np.abs(torch_angles(rotation)[2] - spin)
        assert (np.minimum(error, 2 * np.pi - error) * weight).max() < bound


def test_rotation_comes_back_from_its_own_angles() -> None:
    R = torch_rotation(*random_torches(seed=5, margin=1e-3))
    assert np.abs(torch_rotation(*torch_angles(R)) - R).max() < 1e-12


def test_rotation_is_the_printed_matrix() -> None:
    travel, work, b = random_torches(seed=6, margin=1e-3)
    phi, eta = np.arcsin(np.cos(travel) / np.sin(np.abs(work))), -(np.pi / 2 + work)
    (c, s), (ce, se), (cb, sb) = ((np.cos(a), np.sin(a)) for a in (phi, eta, b))
    columns = [
        [c * cb + s * se * sb, ce * sb, -s * cb + c * se * sb],
        [-c * sb + s * se * cb, ce * cb, s * sb + c * se * cb],
        [s * ce, -se, c * ce],
    ]
    assert np.abs(torch_rotation(travel, work, b) - np.array(columns).transpose(2, 1, 0)).max() < 1e-11


def test_upright_torch_is_not_turned() -> None:
    assert torch_rotation(90 * DEG, -90 * DEG, 0.0) == pytest.approx(np.eye(3), abs=1e-15)


def test_torch_of_75_and_45_degrees_tilts_by_what_was_worked_out_by_hand() -> None:
    R = torch_rotation(75 * DEG, -45 * DEG, 0.0)
    assert np.degrees(np.arctan2(R[0, 2], R[2, 2])) == pytest.approx(21.4707, abs=1e-4)
    assert np.degrees(np.arcsin(-R[1, 2])) == pytest.approx(-45.0, abs=1e-12)


@pytest.mark.parametrize("work", [0.0, -np.pi])
def test_torch_along_y_takes_phi_as_zero_and_keeps_its_spin(work: float) -> None:
    R = torch_rotation(np.pi / 2, work, 0.4)
    assert R[:, 2] == pytest.approx([0, np.cos(work), 0], abs=1e-15)
    assert np.array(torch_angles(R)) == pytest.approx(np.array([np.pi / 2, work, 0.4]), abs=1e-15)


@pytest.mark.parametrize("side", [1, -1])
def test_spin_of_a_torch_exactly_along_y_is_read_off_its_x_axis(side: int) -> None:
    c, s = np.cos(0.4), np.sin(0.4)
    R = np.array([[c, -s, 0.0], [0.0, 0.0, side], [-side * s, -side * c, 0.0]])  # Rx(-+90 deg) Rz(0.4)
    assert torch_angles(R)[2] == pytest.approx(0.4, abs=1e-15)


def test_dragging_torch_leans_the_other_way() -> None:
    push, drag = (torch_rotation(t * DEG, -60 * DEG, 0.0)[:, 2] for t in (70, 110))
    assert drag == pytest.approx(push * [-1, 1, 1], abs=1e-15)


def test_pose_stands_off_along_the_torch() -> None:
    travel, work, spin = random_torches(seed=7)
    T = torch_pose(travel, work, spin, 0.015)
    assert (T[:, :3, :3] == torch_rotation(travel, work, spin)).all()
    assert np.linalg.norm(T[:, :3, 3], axis=-1) == pytest.approx(np.full(RANDOM, 0.015), rel=1e-14)
    assert np.abs(np.sum(T[:, :3, 3] * T[:, :3, 2], axis=-1) - 0.015).max() < 1e-16 * 10
    assert (T[:, 3] == [0, 0, 0, 1]).all()


def test_height_does_not_cancel_next_to_the_border() -> None:
    gap = 1e-9
    travel, work = 0.3, -(np.pi / 2 - 0.3 + gap)
    assert height_squared(travel, work) == pytest.approx(np.sin(2 * 0.3) * gap, rel=1e-6)


@pytest.mark.parametrize(
    ("travel", "work", "spin", "words"),
    [
        (20.0, -20.0, 0.0, r"^point 1: no torch direction has travel angle 20 deg and work angle -20 deg: .* 1\.766,"),
        (0.0, -90.0, 0.0, "^point 1: travel angle is 0 deg; it must lie between 0 and 180 deg$"),
        (180.0, -90.0, 0.0, "^point 1: travel angle is 180 deg"),
        (np.nan, -90.0, 0.0, "^point 1: travel angle is nan deg"),
        (90.0, 30.0, 0.0, "^point 1: work angle is 30 deg; it must lie between -180 and 0 deg$"),
        (90.0, -181.0, 0.0, "^point 1: work angle is -181 deg"),
        (90.0, -90.0, np.inf, "^point 1: spin angle is inf deg; it must be finite$"),
    ],
)
def test_impossible_torch_is_told_with_its_point_and_angles(
    travel: float, work: float, spin: float, words: str
) -> None:
    with pytest.raises(KinematicsError, match=words) as caught:
        torch_rotation(np.radians([90.0, travel]), np.radians([-90.0, work]), np.radians([0.0, spin]))
    assert "\n" not in str(caught.value)


def test_single_torch_is_told_without_a_point() -> None:
    with pytest.raises(KinematicsError, match=r"^no torch direction"):
        torch_rotation(10 * DEG, -10 * DEG, 0.0)


def test_torch_from_below_is_refused() -> None:
    R = np.array([np.eye(3), np.diag([1.0, -1.0, -1.0])])
    with pytest.raises(KinematicsError, match=r"^point 1: torch points at the weld from below; turn it over$"):
        torch_angles(R)
