"""The law of slowing, on paths of a formula."""

import numpy as np
import pytest
import toppra
from scipy.interpolate import BSpline
from toppra import algorithm, constraint

from nlpweld.motion import Limits, s_curve
from nlpweld.timeline import Track, quintic
from nlpweld.timing.curve import Curve, curve_through, split
from nlpweld.timing.law import Run, Task, slowed
from nlpweld.timing.moves import in_a_row

PACE = Limits(np.array(0.05), np.array(0.5), np.array(5.0))
EASY = np.array([[50.0, 50.0], [500.0, 500.0], [5000.0, 5000.0]])
TIGHT = np.array([[0.35, 50.0], [3.0, 500.0], [30.0, 5000.0]])
JERKY = np.array([[50.0, 50.0], [3.0, 500.0], [2.0, 5000.0]])
LENGTH = 1.0


def hump(x: np.ndarray) -> np.ndarray:
    """One joint turns quickly near the middle, the other evenly; the third stands for the seam parameter."""
    return np.stack([np.tanh(20 * (x - 0.5)), 0.5 * x, x], axis=-1)


@pytest.fixture(scope="module")
def path() -> Curve:
    return curve_through(hump, split(np.array([0.0, LENGTH]), 1 / 64))


def run_of(path: Curve, limits: np.ndarray):
    return slowed(path, PACE, np.hstack([limits, np.full((3, 1), np.inf)]), 0.0, LENGTH, 0.05)


@pytest.fixture(scope="module")
def runs(path: Curve):
    return {"free": run_of(path, EASY), "slowed": run_of(path, TIGHT)}


def test_where_nothing_binds_it_is_the_pace_s_own_s_curve(runs):
    run = runs["free"]
    assert run.clock is None
    assert run.duration_s == pytest.approx(LENGTH / 0.05 + 0.05 / 0.5 + 0.5 / 5.0, rel=1e-12)


def test_slowing_keeps_every_limit_between_instants_and_the_pace_elsewhere(runs):
    run = runs["slowed"]
    states = in_a_row([run], np.append(TIGHT[2], np.inf), 0.05)
    curve = quintic(states.t_s, Track(*states.x))
    t = np.linspace(0, states.t_s[-1], 20_001)
    for order in (1, 2, 3):
        assert (np.abs(curve(t, nu=order)[:, :2]) / TIGHT[order - 1]).max() <= 1 + 1e-6
    speed = curve(t, nu=1)[:, 2]
    x = curve(t)[:, 2]
    assert speed.max() <= 0.05 * (1 + 1e-6)
    far = (np.abs(x - 0.5) > 0.2) & (x > 0.05) & (x < 0.95)
    assert speed[far] == pytest.approx(0.05, rel=1e-6)
    assert speed[np.abs(x - 0.5) < 0.001].max() <= 0.35 / 20 * (1 + 1e-3)  # the rate's own bound in the middle
    assert speed[np.abs(x - 0.5) < 0.001].min() >= 0.35 / 20 * 0.9  # and no slower than it asks
    assert curve(t[-1:])[0] == pytest.approx(hump(np.array([LENGTH]))[0], abs=1e-9)


def test_what_a_clock_uses_of_limits_is_what_differences_say(path):
    task = Task(
        Run(path, 0.0, s_curve(np.array(LENGTH), PACE)), np.hstack([JERKY, np.full((3, 1), np.inf)]), PACE, 0.05
    )
    end = float(task.run.pace.duration_s)
    knots = np.arange(-3, 84) * (end / 80)
    clock = BSpline(knots, 0.6 + 0.3 * np.cos(1.9 * np.arange(83)), 3)
    run = Run(path, 0.0, task.run.pace, clock)
    u = np.linspace(0.48 * end, 0.52 * end, 40_001)
    t, (_, rate, acceleration) = run.times(u), run.motion(u)
    jerk = np.diff(acceleration, axis=0) / np.diff(t)[:, None]
    used = [(np.abs(x[:, :2]) / JERKY[k]).max() ** (1 / (k + 1)) for k, x in enumerate((rate, acceleration, jerk))]
    inside = (task.u >= u[0]) & (task.u <= u[-1])
    assert used[2] == max(used)
    assert task.over([clock(task.u, nu=k) for k in range(3)])[inside].max() == pytest.approx(used[2], rel=5e-3)


@pytest.mark.parametrize(("which", "limits", "at_most"), [("free", EASY, 1.006), ("slowed", TIGHT, 1.05)])
def test_no_quicker_than_time_optimal_without_jerk_and_near_it(path, runs, which, limits, at_most):
    toppra.setup_logging("ERROR")
    x = np.linspace(0, LENGTH, 801)
    way = toppra.SplineInterpolator(x, path.at(x))
    rate, acceleration = np.append(limits[0], 0.05), np.append(limits[1], 0.5)
    rules = [
        constraint.JointVelocityConstraint(np.stack([-rate, rate], axis=1)),
        constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
    ]
    optimal = algorithm.TOPPRA(rules, way, gridpoints=x, parametrizer="ParametrizeConstAccel").compute_trajectory(0, 0)
    ratio = runs[which].duration_s / optimal.duration
    assert 1 - 1e-4 <= ratio <= at_most
