"""The flat posture: the smallest rotation that turns weld normals up."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.cell import load_cell
from nlpweld.geometry.posture import flat
from nlpweld.geometry.seam import weld_frames


def normals(seed: int) -> np.ndarray:
    """Return random unit vectors, one of them +z and none within 5 degrees of -z, shape (m, 3)."""
    n = np.random.default_rng(seed).normal(size=(200, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    n[0] = (0.0, 0.0, 1.0)
    return n[n[:, 2] > -0.996]


BY_SEED = pytest.mark.parametrize("seed", range(5))


@BY_SEED
def test_flat_turns_every_normal_up(seed: int) -> None:
    n = normals(seed)
    up = np.einsum("mij,mj->mi", flat(n), n)
    assert up == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(n), 1)), abs=1e-13)


@BY_SEED
def test_flat_is_a_rotation(seed: int) -> None:
    R = flat(normals(seed))
    assert np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12
    assert np.linalg.det(R) == pytest.approx(np.ones(len(R)), abs=1e-12)


@BY_SEED
def test_flat_turns_by_no_more_than_the_normals_tilt(seed: int) -> None:
    n = normals(seed)
    cosine = (np.trace(flat(n), axis1=1, axis2=2) - 1) / 2
    assert cosine == pytest.approx(n[:, 2], abs=1e-12)


@given(st.floats(0.01, 3.0), st.floats(-np.pi, np.pi))
def test_flat_turns_about_the_horizontal_axis_across_the_normal(tilt: float, azimuth: float) -> None:
    n = np.array([[np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)]])
    across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    assert flat(n)[0] @ across == pytest.approx(across, abs=1e-12)


def test_flat_of_a_normal_that_is_up_is_exactly_the_identity() -> None:
    assert (flat(np.array([[0.0, 0.0, 1.0]]))[0] == np.eye(3)).all()


def test_mirrored_points_of_the_saddle_are_held_in_mirrored_postures() -> None:
    cell, mirror = load_cell("three_er16"), np.diag([-1.0, 1.0, 1.0])
    s = np.arange(72) / 72
    here, there = (flat(weld_frames(cell, t).normal_C) for t in (s, 0.5 - s))
    assert here == pytest.approx(mirror @ there @ mirror, abs=1e-13)
