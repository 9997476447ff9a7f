"""Which instants are written: few, but enough."""

import dataclasses

import numpy as np
import pytest

from nlpweld.errors import OptionError
from nlpweld.export.instants import DEVIATION_RAD, chosen, deviation_rad
from nlpweld.timeline import Timeline, Track
from tests.export.timed import carried


@pytest.fixture(scope="module")
def plan():
    return carried()


def off_lines(timeline, t_s, count=20_001):
    """Return how far the plan is from straight lines between instants, at even places of its own choice."""
    fine = np.linspace(0, timeline.duration_s, count)
    worst = 0.0
    for name, q in timeline.at(fine).items():
        corners = timeline.at(t_s)[name]
        for k in range(q.shape[1]):
            worst = max(worst, np.abs(np.interp(fine, t_s, corners[:, k]) - q[:, k]).max())
    return worst


def test_without_a_step_lines_stay_near_and_hardly_a_point_could_be_spared(plan):
    t_s = chosen(plan.timeline, plan.s)
    assert off_lines(plan.timeline, t_s) <= deviation_rad(plan.timeline, t_s) * 1.01 <= DEVIATION_RAD
    spared = np.delete(t_s, np.arange(1, len(t_s) - 1, 2))
    assert off_lines(plan.timeline, spared) > DEVIATION_RAD


def test_seam_points_and_ends_of_phases_are_written(plan):
    t_s = chosen(plan.timeline, plan.s)
    passed = plan.timeline.s_at(t_s)
    for point in plan.s:
        assert np.abs(passed - point).min() < 1e-6
    for _, until in plan.timeline.phases:
        assert np.abs(t_s - until).min() < 1e-6
    assert t_s[0] == 0
    assert np.abs(t_s * 1e6 - np.round(t_s * 1e6)).max() < 1e-6


@pytest.mark.parametrize("every_s", [0.05, 0.3, 100.0, 1e12])
def test_a_step_is_kept_and_its_deviation_told(plan, every_s):
    t_s = chosen(plan.timeline, plan.s, every_s)
    assert np.diff(t_s).max() <= every_s + 1e-6
    assert len(t_s) == 1 + sum(int(np.ceil(span / every_s)) for span in (1.5, 20.0))
    assert deviation_rad(plan.timeline, t_s) == pytest.approx(off_lines(plan.timeline, t_s), rel=1e-2)


def test_a_coarse_timeline_gets_middles():
    """One quintic over a second turns by a radian; no line between its ends is near it."""
    zero = np.zeros((2, 1))
    timeline = Timeline(
        np.array([0.0, 1.0]), np.zeros(2), (("approach", 1.0),), {"a": Track(np.array([[0.0], [1.0]]), zero, zero)}
    )
    t_s = chosen(timeline, np.array([0.0, 0.5]))
    assert len(t_s) > 30
    assert off_lines(timeline, t_s) <= DEVIATION_RAD


def test_ends_that_nearly_meet_are_one(plan):
    ends = (("approach", 1.5 - 2e-7), ("plunge", 1.5), ("weld", plan.timeline.duration_s))
    t_s = chosen(dataclasses.replace(plan.timeline, phases=ends), plan.s)
    assert np.diff(t_s).min() > 5e-7


@pytest.mark.parametrize("every_s", [0.0, -1.0, float("nan"), float("inf"), 1e-6])
def test_a_step_of_no_use_is_refused_in_one_line(plan, every_s):
    with pytest.raises(OptionError, match=r"^--every.*; .*give (a longer step|one)|^--every.*give a longer step"):
        chosen(plan.timeline, plan.s, every_s)
