"""S-curves: the printed cases, a million random moves, and what ruckig makes of the same."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.s_curves import by_ruckig
from nlpweld.errors import MotionError
from nlpweld.motion import Limits, s_curve, synchronised
from tests.motion.moves import edges, moves

MILLION = 1_000_000
scale = st.floats(-6.0, 6.0).map(lambda power: 10.0**power)


def test_cruising_move_takes_what_equations_7_to_9_print() -> None:
    move = s_curve(2.0, Limits(1.5, 5.04, 100.8))
    assert move.duration_s == pytest.approx(2.0 / 1.5 + 1.5 / 5.04 + 5.04 / 100.8, rel=1e-14)
    t3 = 1.5 / 5.04 + 5.04 / 100.8
    t = np.linspace(1.5 / 5.04, t3, 7)  # the third piece, eq. (9)
    a, J, V = 5.04, 100.8, 1.5
    constant = a**3 / (6 * J**2) + J * V**3 / (6 * a**3)
    printed = -J / 6 * t**3 + (a + J * V / a) / 2 * t**2 - (a**2 / (2 * J) + J * V**2 / (2 * a**2)) * t + constant
    assert move.at(t) == pytest.approx(printed, rel=1e-12)


def test_move_without_cruise_takes_what_equation_10_prints() -> None:
    L, a, J = 0.4, 5.0, 50.0
    move = s_curve(L, Limits(9.0, a, J))
    root = np.sqrt(L / a + a**2 / (4 * J**2))
    t2, t3 = root - a / (2 * J), root + a / (2 * J)
    assert move.duration_s == pytest.approx(a / J + np.sqrt(a**2 / J**2 + 4 * L / a), rel=1e-14)
    t = np.linspace(t3, 2 * t3 - t2, 7)
    assert move.at(t) == pytest.approx(a * t2 * t - J / 6 * (t - t3) ** 3 - L / 2, rel=1e-12)


def test_shortest_move_takes_what_equation_11_prints() -> None:
    L, J = 0.01, 50.0
    move = s_curve(L, Limits(9.0, 5.0, J))
    t3, peak = (4 * L / J) ** (1 / 3), (J * L**2 / 4) ** (1 / 3)
    assert move.duration_s == pytest.approx((32 * L / J) ** (1 / 3), rel=1e-14)
    assert move.peak_velocity == pytest.approx(peak, rel=1e-14)
    t = np.linspace(t3, 1.4 * t3, 7)
    assert move.at(t) == pytest.approx(peak * t - J / 6 * (t - t3) ** 3 - L / 2, rel=1e-12)


def test_velocity_limit_that_jerk_meets_first_is_kept() -> None:
    """The case that Cao et al. leave out: V below a^2 / jerk."""
    move = s_curve(3.0, Limits(0.5, 10.0, 2.0))
    assert move.duration_s == pytest.approx(3.0 / 0.5 + 2 * np.sqrt(0.5 / 2.0), rel=1e-14)
    assert move.peak_velocity == pytest.approx(0.5, rel=1e-14)
    assert move.peak_acceleration < 10.0


def test_move_of_no_length_takes_no_time() -> None:
    move = s_curve(np.array([0.0, 1.0]), Limits(1.0, 1.0, 1.0))
    assert move.duration_s[0] == 0.0
    assert [move.at(np.array([0.0, 0.0]), k)[0] for k in range(4)] == [0.0] * 4
    assert move.time_at(np.zeros(2))[0] == 0.0


def test_a_move_rests_before_and_after() -> None:
    move = s_curve(-2.0, Limits(1.0, 1.0, 1.0))
    assert move.duration_s.shape == ()
    t = np.array([-0.1, move.duration_s + 0.1])
    assert move.at(t).tolist() == [0.0, -2.0]
    assert [move.at(t, k).tolist() for k in (1, 2, 3)] == [[0.0, 0.0]] * 3


def test_million_moves_are_continuous_and_end_where_asked() -> None:
    """Up to twelve orders of magnitude between limits: no more than rounding at any edge."""
    L, limits = moves(MILLION, 6.0)
    move = s_curve(L, limits)
    units = (np.abs(L), move.peak_velocity, move.peak_acceleration)
    for t in edges(move):
        before, after = np.nextafter(t, 0.0), np.nextafter(t, np.inf)
        for k, unit in enumerate(units):
            slope = (*units, move.jerk)[k + 1] * (after - before)  # what the motion itself moves between two doubles
            assert (np.abs(move.at(after, k) - move.at(before, k)) <= 1e-12 * unit + slope).all()
    assert np.array_equal(move.at(move.duration_s), L)
    assert not move.at(move.duration_s, 1).any()
    assert not move.at(move.duration_s, 2).any()


def test_million_moves_keep_their_limits() -> None:
    L, limits = moves(MILLION, 6.0, seed=1)
    move = s_curve(L, limits)
    t = np.random.default_rng(2).random(MILLION) * move.duration_s
    for instants in (t, move.duration_s / 2, move.jerk_s, move.rise_s):
        assert (np.abs(move.at(instants, 1)) <= limits.velocity * (1 + 1e-12)).all()
        assert (np.abs(move.at(instants, 2)) <= limits.acceleration * (1 + 1e-12)).all()
        assert (np.abs(move.at(instants, 3)) <= limits.jerk * (1 + 1e-12)).all()
        assert (np.abs(move.at(instants)) <= np.abs(L)).all()
    reached = [move.peak_velocity / limits.velocity, move.peak_acceleration / limits.acceleration]
    assert min(peak.max() for peak in reached) == pytest.approx(1.0, rel=1e-12)


def test_hundred_thousand_moves_take_as_long_as_ruckig_says() -> None:
    L, limits = moves(100_000, 1.5, seed=3)
    ours = s_curve(L, limits).duration_s
    theirs = by_ruckig(L, limits)
    assert ours == pytest.approx(theirs, rel=1e-9)


def test_each_derivative_is_that_of_the_one_before() -> None:
    L, limits = moves(2000, 1.0, seed=4)
    move = s_curve(L, limits)
    t = (0.05 + 0.9 * np.random.default_rng(5).random(2000)) * move.duration_s
    h = 1e-6 * move.duration_s
    far = (np.abs(edges(move) - t) > 3 * h).all(axis=0)  # from edges, where jerk jumps
    for k in range(3):
        slope = (move.at(t + h, k) - move.at(t - h, k)) / (2 * h)
        unit = (move.peak_velocity, move.peak_acceleration, move.jerk)[k]
        assert (np.abs(slope - move.at(t, k + 1))[far] <= 1e-7 * unit[far]).all()


@given(scale, scale, scale, scale, st.floats(0.0, 1.0), st.sampled_from([-1.0, 1.0]))
def test_time_at_inverts_position(L: float, V: float, a: float, J: float, share: float, sign: float) -> None:
    move = s_curve(sign * L, Limits(V, a, J))
    position = share * sign * L
    assert move.at(move.time_at(position)) == pytest.approx(position, abs=1e-12 * L)


def test_time_at_grows_along_the_way_from_0_to_the_duration() -> None:
    L, limits = moves(2000, 2.0, seed=6)
    move = s_curve(L, limits)
    passed = move.time_at(np.linspace(0.0, 1.0, 41)[:, None] * L)
    assert (np.diff(passed, axis=0) > 0).all()
    assert passed[0] == pytest.approx(np.zeros(2000), abs=0)
    assert np.array_equal(passed[-1], move.duration_s)


def test_axes_end_together_within_their_limits() -> None:
    rng = np.random.default_rng(7)
    L = rng.normal(size=(500, 6)) * (rng.random((500, 6)) > 0.2)
    limits = Limits(*(10 ** rng.uniform(-1, 1, (3, 6))))
    move, alone = synchronised(L, limits), s_curve(L, limits)
    longest = np.where(L != 0, alone.duration_s.max(axis=1, keepdims=True), 0.0)
    assert move.duration_s == pytest.approx(longest, rel=1e-14)
    assert move.at(longest / 2) == pytest.approx(L / 2, rel=1e-12)
    assert (move.jerk <= limits.jerk * (1 + 1e-12)).all()
    assert (move.peak_velocity <= limits.velocity * (1 + 1e-12)).all()
    assert (move.peak_acceleration <= limits.acceleration * (1 + 1e-12)).all()
    assert np.array_equal(move.at(move.duration_s), L)


def test_move_cannot_be_made_shorter_than_its_quickest() -> None:
    move = s_curve(1.0, Limits(1.0, 1.0, 1.0))
    with pytest.raises(MotionError, match="shorter than the quickest"):
        move.stretched(0.9 * move.duration_s)


@pytest.mark.parametrize(
    ("limits", "told"),
    [
        ((0.0, 1.0, 1.0), "velocity limit 0 is not above 0"),
        ((1.0, -2.0, 1.0), "acceleration limit -2 is not above 0"),
        ((1.0, 1.0, [1.0, np.nan]), "jerk: holds NaN"),
        ((np.inf, 1.0, 1.0), "velocity: holds NaN or infinity"),
        (("fast", 1.0, 1.0), "velocity: not a number"),
    ],
)
def test_limits_that_bound_nothing_are_named(limits: tuple, told: str) -> None:
    with pytest.raises(MotionError, match=told):
        Limits(*limits)


@pytest.mark.parametrize(
    ("length", "limits", "told"),
    [
        (np.nan, (1.0, 1.0, 1.0), "displacement: holds NaN"),
        (1e308, (1e-10, 1.0, 1.0), r"displacement 1e\+308 and its limits are too far apart"),
        (1.0, (1.0, 1e-300, 1e300), "displacement 1 and its limits are too far apart"),
    ],
)
def test_displacements_that_cannot_be_planned_are_named(length: float, limits: tuple, told: str) -> None:
    with pytest.raises(MotionError, match=told):
        s_curve(length, Limits(*limits))


def test_position_off_the_move_is_named() -> None:
    for position in (-0.1, 1.1):
        with pytest.raises(MotionError, match="not between start and end"):
            s_curve(1.0, Limits(1.0, 1.0, 1.0)).time_at(position)
