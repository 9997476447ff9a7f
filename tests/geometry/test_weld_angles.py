"""Slope, rotation and deviation of welds, fillets, and the main positions of ISO 6947."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.cell import load_cell
from nlpweld.geometry.seam import weld_frames
from nlpweld.geometry.weld_angles import (
    MAIN_POSITIONS,
    OUTSIDE,
    fillet_rotation,
    iso_position,
    turn,
    weld_angles,
    weld_rotation,
    weld_rotations,
)

RANDOM = 20_000
X, Y, Z = np.eye(3)


def random_rotations(seed: int) -> np.ndarray:
    """Return rotations drawn from unit quaternions, every tenth of them with a root axis within 1e-6 of vertical."""
    rng = np.random.default_rng(seed)
    w, x, y, z = (q := rng.normal(size=(4, RANDOM))) / np.linalg.norm(q, axis=0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    R = np.moveaxis(np.array(rows), -1, 0)
    steep = RANDOM // 10
    slope = rng.choice([-1, 1], steep) * (np.pi / 2 - 10.0 ** rng.uniform(-18, -6, steep))
    R[:steep] = weld_rotation(slope, rng.uniform(-np.pi, np.pi, steep), rng.uniform(-np.pi, np.pi, steep))
    return R


def frame(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the weld frame with these axes, shape (1, 3, 3)."""
    return np.column_stack([x, np.cross(z, x), z])[None]


def test_angles_give_the_frame_back_even_next_to_vertical() -> None:
    R = random_rotations(seed=1)
    again = weld_rotation(*weld_angles(R))
    assert np.abs(again - R).max() < 4e-12  # quaternions leave 1e-15; VERTICAL drops headings of 1e-12
    assert np.abs(again[RANDOM // 10 :] - R[RANDOM // 10 :]).max() < 1e-14


def test_angles_are_recovered_from_the_frame() -> None:
    rng = np.random.default_rng(2)
    slope = np.radians(rng.uniform(-89, 89, RANDOM))
    rotation, deviation = rng.uniform(-np.pi, np.pi, (2, RANDOM))
    found = weld_angles(weld_rotation(slope, rotation, deviation))
    assert np.abs(np.array(found) - [slope, rotation, deviation]).max() < 1e-12


def test_frames_are_right_handed_and_orthonormal() -> None:
    R = weld_rotation(*np.random.default_rng(3).uniform(-np.pi, np.pi, (3, RANDOM)))
    assert np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() < 1e-14
    assert np.linalg.det(R) == pytest.approx(np.ones(RANDOM), abs=1e-13)


def test_angles_stay_in_their_ranges_with_pi_and_without_minus_pi() -> None:
    minus_zero = frame(np.array([-1.0, -0.0, 0.0]), Z)
    assert weld_angles(minus_zero)[2][0] == np.pi
    slope, rotation, deviation = weld_angles(random_rotations(seed=4))
    assert np.abs(slope).max() <= np.pi / 2
    for angle in (rotation, deviation):
        assert angle.min() > -np.pi
        assert angle.max() <= np.pi


@pytest.mark.parametrize(
    ("x", "z", "expected"),
    [
        (X, Z, (0, 90, 0)),  # flat
        (X, Y, (0, 0, 0)),  # centre line along +y_B
        (X, -Z, (0, -90, 0)),  # overhead
        (Y, Z, (0, 90, 90)),  # flat, heading along y_B
        (Y, X, (0, 180, 90)),  # y_B turned by the deviation is -x_B
        ([0.6, 0, 0.8], [-0.8, 0, 0.6], (np.degrees(np.arcsin(0.8)), 90, 0)),  # uphill
        ([0.6, 0, -0.8], [0.8, 0, 0.6], (-np.degrees(np.arcsin(0.8)), 90, 0)),  # downhill
        (Z, Y, (90, 0, 0)),  # vertical: the deviation is 0 by convention
        (X, [0, -0.6, 0.8], (0, np.degrees(np.arctan2(0.8, -0.6)), 0)),
    ],
)
def test_angles_of_welds_that_can_be_pictured(x: list[float], z: list[float], expected: tuple[float, ...]) -> None:
    found = [np.degrees(a[0]) for a in weld_angles(frame(np.array(x), np.array(z)))]
    assert found == pytest.approx(expected, abs=1e-12)


@given(st.floats(-3.1, 3.1))
def test_level_weld_turned_a_quarter_has_its_centre_line_upright_at_any_deviation(deviation: float) -> None:
    R = weld_rotation(0.0, np.pi / 2, deviation)
    assert R[:, 2] == pytest.approx(Z, abs=1e-15)


def test_frames_of_a_seam_have_tangent_and_normal_as_axes() -> None:
    frames = weld_frames(load_cell("three_er16"), np.arange(36) / 36)
    R = weld_rotations(frames)
    assert (R[..., 0] == frames.tangent_C).all()
    assert (R[..., 2] == frames.normal_C).all()
    assert np.linalg.det(R) == pytest.approx(np.ones(36), abs=1e-13)


@pytest.mark.parametrize(("side", "rotation_deg"), [(1, 45.0), (-1, 135.0)])
def test_fillet_whose_auxiliary_frame_is_upright_is_in_position_pb(side: int, rotation_deg: float) -> None:
    upright = weld_rotation(0.0, np.pi / 2, np.array([0.7]))
    R = upright @ turn("x", np.array([-side * np.pi / 4]))
    assert fillet_rotation(R, np.pi / 4, side) == pytest.approx(upright, abs=1e-15)
    slope, rotation, _ = weld_angles(R)
    assert np.degrees(rotation) == pytest.approx([rotation_deg], abs=1e-12)
    assert iso_position(slope, rotation).name.tolist() == ["PB"]


ROWS = [(n, s, r) for n, (slopes, rotations) in MAIN_POSITIONS.items() for s in slopes for r in rotations or (33,)]


@pytest.mark.parametrize(("name", "slope", "rotation"), ROWS)
@pytest.mark.parametrize("turns", [-360, 0])
def test_every_main_position_is_itself_within_tolerances_and_nothing_just_beyond(
    name: str, slope: float, rotation: float, turns: int
) -> None:
    off = np.radians([[0, 0], [5, 10], [-5, -10], [5.01, 0], [0, 10.01]])
    found = iso_position(np.radians(slope + turns) + off[:, 0], np.radians(rotation + turns) + off[:, 1])
    vertical = name in ("PF", "PG")
    assert found.nearest.tolist() == [name] * 5
    assert found.name.tolist() == [name, name, name, OUTSIDE, name if vertical else OUTSIDE]
    assert found.slope_off == pytest.approx(off[:, 0], abs=1e-14)
    assert found.rotation_off == pytest.approx(off[:, 1] * (not vertical), abs=1e-14)


def test_flat_position_is_the_same_in_both_conventions_and_downhill_is_pg() -> None:
    found = iso_position(np.radians([0.0, 90.0, -90.0]), np.radians([90.0, 12.0, -77.0]))
    assert found.name.tolist() == ["PA", "PF", "PG"]


def test_wider_tolerances_let_more_in() -> None:
    weld = np.radians([7.0]), np.radians([105.0])
    assert iso_position(*weld).name.tolist() == [OUTSIDE]
    assert iso_position(*weld, slope_tolerance_deg=8.0, rotation_tolerance_deg=16.0).name.tolist() == ["PA"]
