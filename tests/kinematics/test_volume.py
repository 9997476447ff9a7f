"""Volumes of velocity ellipsoids, alone and in common."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nlpweld.kinematics.manipulability import ellipsoid_volume, intersection_volume

UNIT_BALL = 4 / 3 * np.pi
FEW = settings(max_examples=30, deadline=None)  # a rule of order 131 has 5810 points
half_axes = st.tuples(*[st.floats(0.3, 3.0)] * 3)
seeds = st.integers(0, 10_000)


def rotation(seed: int, n: int = 3) -> np.ndarray:
    """Return a random orthogonal matrix (n, n)."""
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(n, n)))[0]


@FEW
@given(half_axes, seeds)
def test_volume_of_an_ellipsoid_is_four_thirds_pi_times_its_half_axes(axes: tuple, seed: int) -> None:
    J_v = rotation(seed) @ np.diag(axes) @ rotation(seed + 1, 6)[:3]
    assert ellipsoid_volume(J_v) == pytest.approx(UNIT_BALL * np.prod(axes), rel=1e-9)


@FEW
@given(st.lists(st.floats(0.1, 10.0), min_size=1, max_size=4))
def test_concentric_balls_have_the_smallest_in_common(radii: list[float]) -> None:
    common = intersection_volume([radius * np.eye(3) for radius in radii])
    assert common == pytest.approx(UNIT_BALL * min(radii) ** 3, rel=1e-10)


@FEW
@given(half_axes, seeds)
def test_equal_ellipsoids_have_their_whole_volume_in_common(axes: tuple, seed: int) -> None:
    J_v = rotation(seed) @ np.diag(axes)
    assert intersection_volume([J_v, J_v, -J_v]) == pytest.approx(ellipsoid_volume(J_v), rel=1e-4)


@FEW
@given(half_axes, seeds)
def test_ellipsoid_inside_the_others_is_all_they_have_in_common(axes: tuple, seed: int) -> None:
    J_v = rotation(seed) @ np.diag(axes)
    others = [1.01 * max(axes) * np.eye(3), 1.5 * J_v]
    assert intersection_volume([others[0], J_v, others[1]]) == pytest.approx(ellipsoid_volume(J_v), rel=1e-4)


def test_two_crossed_spheroids_have_in_common_what_the_integral_by_hand_gives() -> None:
    # x^2 + y^2 + z^2/4 <= 1 and x^2/4 + y^2 + z^2 <= 1: by symmetry twice the part with |z| >= |x|, where the second
    # is the nearer; in cylinder coordinates about y, 2 * integral over the wedge of (2/3) (cos^2 u + sin^2 u / 4)^-1.
    u = np.pi / 4
    wedge = 2 * np.arctan(np.tan(u) / 2)  # integral of (cos^2 + sin^2/4)^-1 over [0, u], z along cos
    assert intersection_volume([np.diag([1, 1, 2]), np.diag([2, 1, 1])]) == pytest.approx(16 / 3 * wedge, rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_common_volume_is_what_monte_carlo_counts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    jacobians = [rotation(seed + k) @ np.diag(rng.uniform(0.4, 1.6, 3)) @ rotation(seed + k, 6)[:3] for k in range(3)]
    direction = rng.normal(size=(400_000, 3))
    ball = direction * (rng.random((400_000, 1)) ** (1 / 3) / np.linalg.norm(direction, axis=1, keepdims=True))
    inside_first = ball @ np.linalg.cholesky(jacobians[0] @ jacobians[0].T).T
    cores = [np.linalg.inv(J @ J.T) for J in jacobians[1:]]
    share = np.mean(np.all([np.einsum("ni,ij,nj->n", inside_first, c, inside_first) <= 1 for c in cores], axis=0))
    assert 0.05 < share < 0.95
    expected = share * ellipsoid_volume(jacobians[0])
    scatter = np.sqrt((1 - share) / (share * 400_000))
    assert intersection_volume(jacobians) == pytest.approx(expected, rel=4 * scatter + 1e-3)


@FEW
@given(seeds)
def test_common_volume_does_not_depend_on_the_order_and_is_at_most_the_smallest(seed: int) -> None:
    jacobians = list(np.random.default_rng(seed).normal(size=(3, 3, 6)))
    common = intersection_volume(jacobians)
    assert intersection_volume(jacobians[::-1]) == pytest.approx(common, rel=1e-12)
    assert 0.0 < common <= min(ellipsoid_volume(J) for J in jacobians) * (1 + 1e-2)
