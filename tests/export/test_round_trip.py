"""What is exported is read back by other code, and the verifier accepts it as it accepted the plan."""

import dataclasses

import numpy as np
import pytest

from nlpweld.export import FORMATS, export_plan
from nlpweld.verify.check import verify
from tests.export.readers import READERS
from tests.export.timed import carried, read_back, turned

PLANS = {"three robots": carried, "robot and positioner": turned}
WRITTEN_RAD = {"csv": 1e-11, "ros2": 1e-12, "ros2-json": 1e-12, "rapid": 1e-8, "krl": 1e-8}  # half the last digit


@pytest.fixture(scope="module", params=PLANS)
def plan(request):
    return PLANS[request.param]()


@pytest.fixture(scope="module")
def report(plan):
    return verify(plan)


def test_every_format_has_a_reader():
    assert set(READERS) == set(FORMATS) == set(WRITTEN_RAD)


@pytest.mark.parametrize("format", FORMATS)
def test_what_is_read_back_is_the_plan_and_verifies(plan, report, format):
    made = export_plan(plan, format)
    t_s, tracks = READERS[format](made.files, plan)
    assert len(t_s) == made.points
    assert t_s[-1] == pytest.approx(plan.timeline.duration_s, abs=1e-6)
    assert set(tracks) == set(plan.timeline.tracks)
    for name, expected in plan.timeline.at(t_s).items():
        assert np.abs(tracks[name].q - expected).max() < 1.5 * WRITTEN_RAD[format], name
    again = verify(read_back(plan, t_s, tracks))
    assert report.feasible
    assert again.feasible, str(again)
    assert again.mmr_mean == pytest.approx(report.mmr_mean, abs=1e-6)
    assert again.joint_margin_rad == pytest.approx(report.joint_margin_rad, abs=1e-5)


@pytest.mark.parametrize("format", ["csv", "ros2-json"])
def test_rates_and_accelerations_make_the_same_motion_between_the_points(plan, format):
    t_s, tracks = READERS[format](export_plan(plan, format).files, plan)
    read = dataclasses.replace(plan.timeline, t_s=t_s, s=plan.timeline.s_at(t_s), tracks=tracks)
    fine = np.linspace(0, plan.timeline.duration_s, 3001)
    for derivative, limit in ((0, 1e-5), (1, 1e-3)):
        expected = plan.timeline.at(fine, derivative)
        for name, values in read.at(fine, derivative).items():
            assert np.abs(values - expected[name]).max() < limit, (name, derivative)


def test_a_flipped_axis_or_a_wrong_unit_is_refused_by_the_verifier():
    """So that the round trip can fail."""
    plan = turned()
    t_s, tracks = READERS["rapid"](export_plan(plan, "rapid").files, plan)
    for name, k in (("robot_1", 3), ("positioner", 1)):
        q = tracks[name].q * np.where(np.arange(tracks[name].q.shape[1]) == k, -1, 1)
        flipped = tracks | {name: dataclasses.replace(tracks[name], q=q)}
        assert not verify(read_back(plan, t_s, flipped)).feasible, (name, k)
    radians = {name: dataclasses.replace(track, q=np.radians(track.q)) for name, track in tracks.items()}
    assert not verify(read_back(plan, t_s, radians)).feasible
