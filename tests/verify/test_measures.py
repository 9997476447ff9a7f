"""Measures against Monte Carlo, and the laws they obey."""

import numpy as np
import pytest

from nlpweld.verify import measures

from .helpers import cell_with


@pytest.fixture
def cores(rng) -> np.ndarray:
    A = rng.normal(size=(4, 3, 3, 3))
    return A @ A.swapaxes(-1, -2) + 0.1 * np.eye(3)


def test_common_volume_agrees_with_monte_carlo(cores, rng):
    got = measures.common_volume(cores)
    for volume, three in zip(got, cores, strict=True):
        size = np.sqrt(three.diagonal(axis1=1, axis2=2).min(axis=0))  # no ellipsoid reaches farther along an axis
        x = rng.uniform(-1, 1, size=(400_000, 3)) * size
        inside = np.all([(x @ np.linalg.inv(core) * x).sum(axis=1) <= 1 for core in three], axis=0)
        assert inside.sum() > 10_000
        assert volume == pytest.approx(inside.mean() * 8 * size.prod(), rel=0.02)


def test_common_volume_of_one_ellipsoid_is_its_own(cores):
    own = np.repeat(cores[:, :1], 3, axis=1)
    np.testing.assert_allclose(measures.common_volume(own), measures.ellipsoid_volume(cores[:, 0]), rtol=2e-3)


def test_common_volume_is_below_every_volume(cores):
    assert (measures.common_volume(cores) < measures.ellipsoid_volume(cores).min(axis=1)).all()


def test_flat_ellipsoid_has_no_common_volume(cores):
    cores[0, 1] = np.diag([1.0, 1.0, 0.0])
    assert measures.common_volume(cores)[0] == 0
    assert (measures.common_volume(cores)[1:] > 0).all()


def test_directions_are_spread_evenly():
    u = measures.sphere_directions()
    np.testing.assert_allclose(np.linalg.norm(u, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(u.mean(axis=0), 0, atol=2e-3)
    np.testing.assert_allclose(u.T @ u / len(u), np.eye(3) / 3, atol=2e-3)


@pytest.fixture
def inputs(cell, rng):
    names = [station.name for station in cell.stations]
    return {n: rng.uniform(0.1, 0.6, size=4) for n in names}, {n: rng.normal(size=(4, 3, 6)) for n in names}


def by_hand(w, Jv):
    """Eq. (16) with the common volume cancelled: the shortcut that the code does not take."""
    one, two, three = (
        [1 / np.sqrt(np.linalg.det(J @ J.T)) for J in Jv[n]] for n in ("handler_1", "handler_2", "welder")
    )
    b1, b2 = (np.array(one) + np.array(two)) / 2, np.array(three)
    return b1, b2, w["handler_1"] * w["handler_2"], w["welder"]


def test_common_volume_cancels_in_mmr(cell, inputs):
    b1, b2, tight, loose = by_hand(*inputs)
    got = measures.measure(cell, *inputs)
    np.testing.assert_allclose(got.mmr, (b1 * tight + b2 * loose) / (b1 + b2), rtol=1e-12)
    np.testing.assert_allclose(got.m_tight, tight)
    np.testing.assert_allclose(got.m_loose, loose)


def test_ratios_are_shares_of_each_volume(cell, inputs):
    got = measures.measure(cell, *inputs)
    for name, J in inputs[1].items():
        volume = 4 / 3 * np.pi * np.sqrt(np.linalg.det(J @ J.swapaxes(-1, -2)))
        np.testing.assert_allclose(got.ratio[name] * volume, got.common_volume, rtol=1e-12)
        assert (got.ratio[name] < 1).all()


READINGS = {
    "equal": lambda b1, b2, t, m: (t + m) / 2,
    "harmonic": lambda b1, b2, t, m: (b1 + b2) / (b1 / t + b2 / m),
    "sqrt_tight": lambda b1, b2, t, m: (b1 * np.sqrt(t) + b2 * m) / (b1 + b2),
    "millimetres": lambda b1, b2, t, m: (b1 * t * 1e18 + b2 * m * 1e9) / (b1 + b2),
}


@pytest.mark.parametrize("reading", READINGS)
def test_other_readings(cell, inputs, reading):
    other = cell_with(cell, objective={"reading": reading})
    got = measures.measure(other, *inputs).mmr
    np.testing.assert_allclose(got, READINGS[reading](*by_hand(*inputs)), rtol=1e-12)
    assert not np.allclose(got, measures.measure(cell, *inputs).mmr)


OF_ALL = {"product": lambda a, b, c: a * b * c, "mean": lambda a, b, c: (a + b + c) / 3}


@pytest.mark.parametrize("reading", OF_ALL)
def test_readings_that_tell_no_robots_apart(cell, inputs, reading):
    got = measures.measure(cell_with(cell, objective={"reading": reading}), *inputs)
    np.testing.assert_allclose(got.mmr, OF_ALL[reading](*inputs[0].values()), rtol=1e-12)
    np.testing.assert_allclose(got.m_tight, inputs[0]["handler_1"] * inputs[0]["handler_2"])


def test_cell_without_handlers_has_no_tight_product(dual, rng):
    w = {name: rng.uniform(0.1, 0.6, size=4) for name in ("robot_1", "robot_2")}
    got = measures.measure(dual, w, {name: rng.normal(size=(4, 3, 6)) for name in w})
    assert np.isnan(got.m_tight).all()
    np.testing.assert_allclose(got.m_loose, w["robot_1"] * w["robot_2"])
    np.testing.assert_array_equal(got.mmr, got.m_loose)


@pytest.mark.parametrize("factor", [1.0, 1e-200, 1e200])
def test_objective_along_the_seam_by_its_definition(cell, factor):
    values = factor * np.array([0.2, 0.3, 0.25, 0.8])
    least, soft = {"over_seam": "minimum"}, {"over_seam": "soft_minimum", "exponent": 2.0}
    asked = {name: cell_with(cell, objective=fields).objective for name, fields in (("min", least), ("soft", soft))}
    assert measures.along_seam(cell.objective, values) == pytest.approx(0.3875 * factor)
    assert measures.along_seam(asked["min"], values) == 0.2 * factor
    by_hand_ = ((1 / 0.04 + 1 / 0.09 + 1 / 0.0625 + 1 / 0.64) / 4) ** -0.5
    assert measures.along_seam(asked["soft"], values) == pytest.approx(by_hand_ * factor)
    assert measures.along_seam(asked["soft"], np.array([0.0, 0.3])) == 0.0


@pytest.mark.parametrize("reading", ["paper", *READINGS, *OF_ALL])
def test_least_along_a_motion_needs_no_common_volume(cell, inputs, reading):
    other = cell_with(cell, objective={"reading": reading})
    assert measures.least_along(other, *inputs) == pytest.approx(measures.measure(other, *inputs).mmr.min(), rel=1e-12)
