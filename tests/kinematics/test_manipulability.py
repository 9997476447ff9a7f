"""Manipulability w of one robot and the multi-robot manipulability (16) in all its readings."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.cell import READINGS, Robot
from nlpweld.kinematics.chain import Chain, Frame
from nlpweld.kinematics.ik import BRANCHES, signs, spherical_arm
from nlpweld.kinematics.manipulability import det_gram, ellipsoid_volume, intersection_volume, manipulability, mmr

from .helpers import NAMES, ROBOTS, between_limits, link_frames

BY_ROBOT = pytest.mark.parametrize("robot", ROBOTS, ids=NAMES)
positive = st.floats(0.01, 10.0)
triples = st.tuples(positive, positive, positive)
TIGHT = (True, True, False)
W, GRAM = (2.0, 3.0, 5.0), (1.0, 4.0, 16.0)  # shares of the common volume 1, 1/2, 1/4: beta_1 = 3/4, beta_2 = 1/4
BY_HAND = {
    "paper": 5.75,  # 3/4 * 6 + 1/4 * 5
    "equal": 5.5,  # (6 + 5) / 2
    "harmonic": 40 / 7,  # 1 / (3/4 / 6 + 1/4 / 5)
    "sqrt_tight": 0.75 * 6**0.5 + 1.25,
    "millimetres": 4.5e18 + 1.25e9,
    "product": 30.0,
    "mean": 10 / 3,
}


CHAINS = {robot.name: Chain(robot) for robot in ROBOTS}


def jacobian(robot: Robot, q: np.ndarray, tcp: np.ndarray) -> np.ndarray:
    """Return the Jacobian at one configuration and point of the flange, shape (6, 6)."""
    return np.array(CHAINS[robot.name].jacobian(q, tcp))


def three_jacobians(seed: int) -> list[np.ndarray]:
    """Return Jacobians of three robots of the library with tools of different length."""
    tools = np.random.default_rng(seed).uniform(-0.4, 0.4, (3, 3))
    return [jacobian(r, between_limits(r, 1, seed)[0], p) for r, p in zip(ROBOTS[:3], tools, strict=True)]


def test_manipulability_is_the_root_of_the_determinant_of_jacobian_times_transpose() -> None:
    J = three_jacobians(30)[0]
    expected = np.sqrt(np.linalg.det(J @ J.T))
    assert float(ca.evalf(manipulability(ca.SX(J)))) == pytest.approx(expected, rel=1e-9)


def test_manipulability_of_a_wide_jacobian_is_the_volume_its_rows_span() -> None:
    assert float(ca.evalf(manipulability(ca.SX([[3, 0, 0], [0, 0, 4]])))) == pytest.approx(12.0)


@BY_ROBOT
def test_closed_form_determinant_is_the_manipulability_whatever_the_tool(robot: Robot) -> None:
    q = between_limits(robot, 30, seed=31)
    tools = np.random.default_rng(32).uniform(-0.6, 0.6, (30, 3))
    arm, T, side = spherical_arm(robot), ca.SX.sym("T", 4, 4), ca.SX.sym("side", 3)
    closed = ca.Function("w", [T, side], [arm.abs_det_jacobian(arm.solve(Frame(T[:3, :3], T[:3, 3]), side))])
    for qi, pose, tool in zip(q, link_frames(robot, q)[-1], tools, strict=True):
        w = abs(np.linalg.det(jacobian(robot, qi, tool)))
        assert min(abs(float(closed(pose, signs(branch))) - w) for branch in BRANCHES) < 1e-12


@given(st.integers(0, 10_000))
def test_gram_determinant_is_that_of_the_translational_jacobian(seed: int) -> None:
    J_v = np.random.default_rng(seed).normal(size=(3, 6))
    assert float(ca.evalf(det_gram(ca.SX(J_v)))) == pytest.approx(np.linalg.det(J_v @ J_v.T), rel=1e-10)


@pytest.mark.parametrize("reading", READINGS)
def test_every_reading_gives_the_number_worked_out_by_hand(reading: str) -> None:
    assert mmr(reading, W, GRAM, TIGHT) == pytest.approx(BY_HAND[reading], rel=1e-14)


@pytest.mark.parametrize("reading", READINGS)
def test_order_of_the_robots_does_not_matter(reading: str) -> None:
    back = mmr(reading, W[::-1], GRAM[::-1], TIGHT[::-1])
    assert back == pytest.approx(mmr(reading, W, GRAM, TIGHT), rel=1e-14)


@pytest.mark.parametrize("reading", READINGS)
def test_symbols_and_arrays_take_the_same_reading(reading: str) -> None:
    w, gram = ca.SX.sym("w", 3), ca.SX.sym("gram", 3)
    graph = ca.Function("mmr", [w, gram], [mmr(reading, ca.vertsplit(w), ca.vertsplit(gram), TIGHT)])
    arrays = mmr(reading, np.array([W, W]).T, np.array([GRAM, GRAM]).T, TIGHT)
    assert arrays == pytest.approx(np.full(2, float(graph(W, GRAM))), rel=1e-14)


@given(triples, triples, st.floats(0.1, 10.0))
def test_root_of_the_tight_part_makes_mmr_a_volume(w: tuple, gram: tuple, scale: float) -> None:
    scaled = mmr("sqrt_tight", [scale**3 * x for x in w], [scale**6 * x for x in gram], TIGHT)
    assert scaled == pytest.approx(scale**3 * mmr("sqrt_tight", w, gram, TIGHT), rel=1e-12)


def test_eq_16_as_it_stands_ranks_two_placements_by_the_unit_of_length() -> None:
    here, there = ((0.1, 0.1, 2.0), (1.0, 1.0, 1.0)), ((0.4, 0.4, 0.5), (1.0, 1.0, 1.0))
    assert mmr("paper", *here, TIGHT) > mmr("paper", *there, TIGHT)
    assert mmr("millimetres", *here, TIGHT) < mmr("millimetres", *there, TIGHT)


@given(triples, triples)
def test_millimetres_is_the_papers_reading_of_numbers_in_millimetres(w: tuple, gram: tuple) -> None:
    expected = mmr("paper", [1e9 * x for x in w], [1e18 * x for x in gram], TIGHT)
    assert mmr("millimetres", w, gram, TIGHT) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("reading", ["paper", "equal", "harmonic"])
@given(triples, triples)
def test_mmr_lies_between_its_tight_and_its_loose_part(reading: str, w: tuple, gram: tuple) -> None:
    low, high = sorted([w[0] * w[1], w[2]])
    assert low * (1 - 1e-12) <= mmr(reading, w, gram, TIGHT) <= high * (1 + 1e-12)


@pytest.mark.parametrize("seed", range(33, 38))
def test_mmr_is_eq_16_with_the_common_volume_it_cancels(seed: int) -> None:
    jacobians = three_jacobians(seed)
    w = [abs(np.linalg.det(J)) for J in jacobians]
    common = intersection_volume([J[:3] for J in jacobians])
    r = [common / ellipsoid_volume(J[:3]) for J in jacobians]
    beta_1, beta_2 = (r[0] + r[1]) / 2, r[2]
    literal = (beta_1 * w[0] * w[1] + beta_2 * w[2]) / (beta_1 + beta_2)
    gram = [np.linalg.det(J[:3] @ J[:3].T) for J in jacobians]
    assert all(0.0 < x < 1.0 for x in r)
    assert mmr("paper", w, gram, TIGHT) == pytest.approx(literal, rel=1e-12)
