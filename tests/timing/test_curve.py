import numpy as np
import pytest

from nlpweld.timing.curve import arc_length, curve_through, split


def bent(x: np.ndarray) -> np.ndarray:
    """A sine, and a path whose second derivative jumps at 0.5."""
    return np.stack([np.sin(7 * x), np.maximum(x - 0.5, 0.0) ** 2], axis=-1)


@pytest.fixture(scope="module")
def curve():
    return curve_through(bent, split(np.array([0.0, 0.5, 1.0]), 0.125))


def test_values_and_three_derivatives(curve):
    x = np.linspace(0, 1, 333)
    for k, (wave, size) in enumerate(zip((np.sin, np.cos), (1, 7), strict=True)):
        assert curve.at(x, k)[:, 0] == pytest.approx(size * wave(7 * x), abs=1e-11)
    assert curve.at(x, 3)[:, 0] == pytest.approx(-343 * np.cos(7 * x), abs=1e-5)


def test_a_jump_has_two_sides_and_is_named(curve):
    half = np.array([0.5])
    assert curve.at(half, 2)[0, 1] == pytest.approx(2.0)
    assert curve.at(half, 2, side="left")[0, 1] == pytest.approx(0.0, abs=1e-6)
    assert curve.joins == pytest.approx([0.5])


def test_arc_length_of_an_ellipse_s_quarter():
    def ellipse(s: np.ndarray) -> np.ndarray:
        a = np.pi / 2 * s
        return np.stack([3 * np.cos(a), np.sin(a), 0 * a], axis=-1)

    length, parameter = arc_length(ellipse, split(np.array([0.0, 1.0]), 1 / 16))
    assert length[-1] == pytest.approx(13.3648932205553 / 4, abs=1e-11)  # a perimeter by the elliptic integral
    way = np.linspace(0, length[-1], 50)
    s = parameter.at(way)[:, 0]
    chords = np.linalg.norm(np.diff(ellipse(s), axis=0), axis=1)
    assert chords == pytest.approx(np.full(49, length[-1] / 49), rel=3e-3)  # equal lengths, but for their bow
    assert s[[0, -1]] == pytest.approx([0.0, 1.0], abs=1e-13)
