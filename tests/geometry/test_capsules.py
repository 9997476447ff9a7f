"""The distance between two segments against a search that needs no case distinction."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.geometry.capsules import segment_distance

ROUNDING = 1e-7  # the stated rounding
Segments = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def distance(a0: np.ndarray, a1: np.ndarray, b0: np.ndarray, b1: np.ndarray) -> float:
    """Return the package's distance between the segments a0-a1 and b0-b1 [m]."""
    squares = float(np.sum((a1 - a0) ** 2)), float(np.sum((b1 - b0) ** 2))
    return float(segment_distance(*map(ca.DM, (a0, a1, b0, b1)), *squares))


def true_distances(cases: list[Segments]) -> np.ndarray:
    """Return the distances by ternary search on a of its convex distance to b, exact to round-off [m]."""
    a0, a1, b0, b1 = (np.array(ends) for ends in zip(*cases, strict=True))
    low, high = np.zeros((len(a0), 1)), np.ones((len(a0), 1))

    def to_b(s: np.ndarray) -> np.ndarray:
        p, v = a0 + s * (a1 - a0), b1 - b0
        square = np.sum(v * v, axis=1, keepdims=True)
        t = np.clip(np.sum((p - b0) * v, axis=1, keepdims=True) / np.where(square > 0, square, 1.0), 0, 1)
        return np.linalg.norm(p - b0 - t * v, axis=1, keepdims=True)

    for _ in range(120):
        left, right = low + (high - low) / 3, high - (high - low) / 3
        nearer_left = to_b(left) < to_b(right)
        low, high = np.where(nearer_left, low, left), np.where(nearer_left, right, high)
    return np.minimum(to_b(low), np.minimum(to_b(0 * low), to_b(0 * low + 1))).ravel()


def case(kind: str, rng: np.random.Generator) -> Segments:
    """Draw two segments of robot size, some in a special position to each other."""
    a0, a1, b0, b1 = rng.uniform(-1, 1, (4, 3))
    u = a1 - a0
    if kind == "parallel":
        b1 = b0 + rng.uniform(-2, 2) * u
    if kind == "nearly_parallel":
        b1 = b0 + rng.uniform(-2, 2) * u + 10 ** rng.uniform(-12, -1) * rng.normal(size=3)
    if kind == "crossing":
        middle, v = a0 + rng.random() * u, b1 - b0
        b0 = middle - rng.random() * v
        b1 = b0 + v
    if kind == "coaxial":
        b0, b1 = a0 + rng.uniform(-3, 3) * u, a0 + rng.uniform(-3, 3) * u
    if kind == "touching_at_an_end":
        b0 = a1
    if kind == "point_and_segment":
        b1 = b0
    if kind == "segment_and_point":
        a1 = a0
    if kind == "two_points":
        a1, b1 = a0, b0
    if kind.startswith("short"):  # a millimetre, a fraction of it apart
        b0, v = a0 + 3e-4 * rng.normal(size=3), b1 - b0
        a1, b1 = a0 + 1e-3 * u, b0 + 1e-3 * (u + 1e-2 * v if kind == "short_nearly_parallel" else v)
    return a0, a1, b0, b1


KINDS = ["random", "parallel", "nearly_parallel", "crossing", "coaxial", "touching_at_an_end", "point_and_segment",
         "segment_and_point", "two_points", "short", "short_nearly_parallel"]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_distance_is_never_above_the_true_one_nor_more_than_the_rounding_below(kind: str) -> None:
    rng = np.random.default_rng(KINDS.index(kind))
    cases = [case(kind, rng) for _ in range(10_000 if kind == "random" else 600)]
    excess = np.array([distance(*segments) for segments in cases]) - true_distances(cases)
    assert excess.min() >= -ROUNDING - 1e-12
    assert excess.max() <= 1e-12


@given(st.sampled_from(KINDS), st.integers(0, 10_000))
def test_distance_does_not_depend_on_which_segment_or_end_comes_first(kind: str, seed: int) -> None:
    a0, a1, b0, b1 = case(kind, np.random.default_rng(seed))
    others = [distance(b0, b1, a0, a1), distance(a1, a0, b0, b1), distance(a0, a1, b1, b0)]
    assert others == pytest.approx([distance(a0, a1, b0, b1)] * 3, abs=1e-6)


@given(st.sampled_from(KINDS), st.integers(0, 10_000))
def test_distance_has_a_gradient_no_steeper_than_the_motion_of_its_ends(kind: str, seed: int) -> None:
    ends = case(kind, np.random.default_rng(seed))
    squares = float(np.sum((ends[1] - ends[0]) ** 2)), float(np.sum((ends[3] - ends[2]) ** 2))
    shift = ca.SX.sym("shift", 3)  # of segment a as a whole
    moving = (ca.SX(ca.DM(end)) + shift for end in ends[:2])
    moved = segment_distance(*moving, *map(ca.DM, ends[2:]), *squares)
    gradient = np.array(ca.Function("g", [shift], [ca.gradient(moved, shift)])(0))
    assert np.isfinite(gradient).all()
    assert np.linalg.norm(gradient) <= 1 + 1e-3


def test_parallel_rods_side_by_side_are_as_far_apart_as_their_axes() -> None:
    a0, a1, b0, b1 = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.3, 0], [2.5, 0.3, 0]], dtype=float)
    assert distance(a0, a1, b0, b1) == pytest.approx(0.3, abs=2e-7)


def test_crossing_axes_are_no_distance_apart() -> None:
    a0, a1, b0, b1 = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]], dtype=float)
    assert distance(a0, a1, b0, b1) == 0.0
