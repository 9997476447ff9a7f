"""The cells with a positioner: plans from closed forms of their own, numbers of the prototype."""

import math

import numpy as np
import pytest

from nlpweld.errors import PlanError
from nlpweld.geometry.seam import breaks
from nlpweld.plan import Plan
from nlpweld.verify import between
from nlpweld.verify import reference as ref
from nlpweld.verify.bodies import body_table
from nlpweld.verify.check import verify
from nlpweld.verify.report import Report
from nlpweld.verify.upright import off_upright

from .helpers import cell_with, changed, turned_about, with_path
from .welders import PLACES, plan

NUMBERS = {  # mean product; least and mean w of robot_1, of robot_2; least joint margin [deg]
    "A": (0.226960, (0.516773, 0.594635), (0.290926, 0.384579), 40.73),
    "B": (0.212600, (0.360662, 0.457683), (0.360662, 0.457683), 43.93),
    "C": (0.243867, (0.308062, 0.403788), (0.579656, 0.604262), 45.0),  # tilt axis at -90, limit -45 deg
    "D": (0.290770, (0.415394, 0.497261), (0.552803, 0.584137), 45.0),
}


@pytest.fixture(scope="module")
def reports(dual) -> dict[str, Report]:
    return {name: verify(plan(dual, at)) for name, at in PLACES.items()}


@pytest.mark.parametrize("place", PLACES)
def test_numbers_of_the_dual_cell(reports, place):
    got, (product, *robots, margin) = reports[place], NUMBERS[place]
    assert got.feasible, str(got)
    assert got.mmr_mean == pytest.approx(product, abs=1e-6)
    for name, (least, mean) in zip(("robot_1", "robot_2"), robots, strict=True):
        assert got.manipulability_min[name] == pytest.approx(least, abs=1e-6)
        assert got.manipulability_mean[name] == pytest.approx(mean, abs=1e-6)
        assert least - 1e-4 < got.singularity_min[name] < least + 1e-6
    assert got.clearance_m == pytest.approx(0.0566, abs=5e-5)
    assert got.closest_pair.endswith((".torch_body - workpiece.leg_a", ".torch_body - workpiece.leg_b"))
    assert math.degrees(got.joint_margin_rad) == pytest.approx(margin, abs=0.02)
    assert max(got.closure_m, got.closure_rad, got.posture_rad) < 1e-9


def test_positions_of_the_paper_are_placements_of_the_cell(dual):
    assert {name: at[:2] for name, at in dual.placements.items()} == PLACES


def test_numbers_of_the_single_cell(single_plan: Plan):
    got = verify(single_plan)
    assert got.feasible, str(got)
    assert got.mmr_mean == pytest.approx(0.489716, abs=1e-6)
    assert (got.mmr_min, got.mmr_max) == pytest.approx((0.426090, 0.549518), abs=1e-6)
    assert got.clearance_m == pytest.approx(0.0572, abs=5e-5)
    assert math.degrees(got.joint_margin_rad) == pytest.approx(45.6, abs=0.05)
    assert max(got.closure_m, got.closure_rad, got.posture_rad) < 1e-9


def test_helper_gives_the_joints_of_the_prototype(dual_plan: Plan, single_plan: Plan):
    """NOTES: golden, A, j = 0, and nominal, j = 0; angles of the positioner."""
    q = {name: np.degrees(path[0]) for name, path in dual_plan.paths.items()}
    np.testing.assert_allclose(q["robot_1"], [-42.742, 33.090, -0.465, 44.748, 80.857, 127.295], atol=6e-4)
    np.testing.assert_allclose(q["robot_2"], [-10.214, 9.323, 31.875, -68.615, 41.225, -145.698], atol=6e-4)
    np.testing.assert_allclose(np.degrees(dual_plan.paths["positioner"][[0, -1]]), [[-90, 90], [-90, -90]], atol=1e-9)
    q = np.degrees(single_plan.paths["robot_1"][0])
    np.testing.assert_allclose(q, [3.211, 8.567, 20.092, 23.805, 71.623, 85.505], atol=6e-4)
    np.testing.assert_allclose(single_plan.paths["positioner"][:, 0], np.radians(-135), atol=1e-9)


def test_all_robots_are_loose(dual_report: Report):
    assert math.isnan(dual_report.m_tight_mean)
    assert dual_report.m_loose_mean == dual_report.mmr_mean
    assert dual_report.to_json()["m_tight_mean"] is None
    assert dual_report.to_json(profile=True)["profile"]["m_tight"] == [None] * 72


def test_positioner_has_margins_and_no_manipulability(dual_report: Report):
    assert dual_report.profile["joint_margin_rad.positioner"] == pytest.approx(np.radians(45))
    assert set(dual_report.manipulability_mean) == {"robot_1", "robot_2"}


def test_open_seam_ends_where_it_ends(dual, dual_plan: Plan):
    motion = between.whole_motion(dual, dual_plan.placement, dual_plan.s, dual_plan.paths)
    assert (motion.s[0], motion.s[-1]) == (0, 1)
    np.testing.assert_array_equal(motion.s[motion.at], dual_plan.s)
    for name, path in dual_plan.paths.items():
        np.testing.assert_array_equal(motion.q[name][motion.at], path)
    assert motion.point[-1] == 71
    assert not motion.jumps
    assert not motion.unclosed


@pytest.mark.parametrize("step", [1, 71])
def test_there_is_a_sample_where_pieces_join(dual, dual_plan: Plan, step):
    """Line and arc join at s = 0.28005 and 0.71995, between points; also with both in one interval."""
    paths = {name: q[::step] for name, q in dual_plan.paths.items()}
    motion = between.whole_motion(dual, dual_plan.placement, dual_plan.s[::step], paths)
    assert breaks(dual) == pytest.approx([0.28005, 0.71995], abs=1e-5)
    at = np.searchsorted(motion.s, breaks(dual))
    np.testing.assert_array_equal(motion.s[at], breaks(dual))
    if step == 1:
        before, after = (np.diff(motion.q["positioner"][k : k + 2, 1])[0] for k in (at[0] - 1, at[0]))
        assert before == pytest.approx(0, abs=1e-12)  # the table stands still on the line
        assert after < -1e-3


def test_breaks_of_a_closed_seam_are_looked_for_past_its_end(single, single_plan: Plan):
    """Its one break, s = 0, is a point; seen from points moved along by half an interval it comes last."""
    s = single_plan.s[:-1] + 0.5 / 72
    after, at, share = between._joints_of_pieces(single, np.append(s, s[0] + 1))
    assert (after.tolist(), at.tolist()) == ([70], [1.0])
    assert share[0] == pytest.approx(0.75)
    assert not between._joints_of_pieces(single, np.append(single_plan.s, 1.0))[0].size


def test_nothing_moves_far_between_samples(dual, dual_plan: Plan):
    coarse = {name: q[::10] for name, q in dual_plan.paths.items()}
    motion = between.whole_motion(dual, dual_plan.placement, dual_plan.s[::10], coarse)
    ends = between._ends(dual, dual_plan.placement, motion.s, motion.q)
    assert ends["positioner"].shape[1] == 2 * (2 + 14)
    for x in ends.values():
        assert np.linalg.norm(np.diff(x, axis=0), axis=-1).max() <= dual.constraints.verify_step_m


@pytest.mark.parametrize("name", ["dual_plan", "single_plan"])
def test_every_sample_closes_on_where_the_positioner_is(request, name):
    good = request.getfixturevalue(name)
    motion = between.whole_motion(good.cell, good.placement, good.s, good.paths)
    table = motion.q["positioner"]
    assert off_upright(good.cell, ref.workpiece_pose(good.cell, good.placement, motion.s, table), motion.s).max() < 1e-9
    for station in good.cell.stations:
        T_W_E = ref.tcp_pose(station, ref.link_poses(station, motion.q[station.name]))
        wanted = ref.required_pose(good.cell, station, good.placement, motion.s, table)
        np.testing.assert_allclose(T_W_E, wanted, atol=1e-9)


def test_positioner_ends_a_turn_on_and_the_robot_does_not(single, single_plan: Plan):
    motion = between.whole_motion(single, single_plan.placement, single_plan.s, single_plan.paths)
    turns = {name: (q[-1] - q[0]) / (2 * np.pi) for name, q in motion.q.items()}
    np.testing.assert_allclose(turns["positioner"], [0, -1], atol=1e-12)
    np.testing.assert_allclose(turns["robot_1"], 0, atol=1e-12)


@pytest.mark.parametrize("step", [6, 24])
def test_coarse_plan_is_filled_in_with_the_same_motion(single, single_plan: Plan, step):
    points = 72 // step
    cell = cell_with(single, seam={"points": points})
    paths = {name: q[::step] for name, q in single_plan.paths.items()}
    got = verify(changed(single_plan, cell=cell, s=np.arange(points) / points, paths=paths))
    assert got.feasible, str(got)
    assert got.posture_rad < 1e-9
    assert got.singularity_min["robot_1"] == pytest.approx(0.426026, abs=1e-5)


@pytest.mark.parametrize("name", ["dual", "single", "three"])
@pytest.mark.parametrize("yaw", [0.4, -2.5])
def test_cell_turned_about_the_placement_is_the_same_cell(request, name, yaw):
    """Bases, headings and the placement's yaw turned alike: the same joints, the same numbers."""
    good = request.getfixturevalue({"three": "plan"}.get(name, f"{name}_plan"))
    want, got = verify(good), verify(changed(good, cell=turned_about(good.cell, good.placement_m, yaw), yaw_rad=yaw))
    assert got.feasible, str(got)
    assert got.yaw_rad == yaw
    assert got.mmr_mean == pytest.approx(want.mmr_mean, rel=1e-9)
    assert got.clearance_along_m == pytest.approx(want.clearance_along_m, abs=1e-6)
    assert got.closure_m < 1e-8


def test_pairs_of_the_dual_cell(dual):
    table = body_table(dual)
    labels = set(table.pair_labels)
    assert len(table.pairs) == 6 * 6 + 2 * (6 * 14 - 14) + 2 * 6 * 2 + 14
    assert len(table.above_floor) == 2 * 5 + 14 + 1
    assert len(labels) == len(table.pair_labels)
    wanted = {"robot_1.base_column - positioner.pedestal", "robot_2.nozzle - positioner.hub", "positioner.hub - floor"}
    assert wanted | {"workpiece.near_rim_3 - positioner.pedestal", "workpiece.core_arc - floor"} <= labels
    assert not [x for x in labels if "workpiece" in x and "positioner.hub" in x]
    assert not [x for x in labels if "nozzle - workpiece" in x or "pedestal - floor" in x or "hub - positioner" in x]


@pytest.mark.parametrize(
    ("spoil", "what"),
    [
        (lambda p: changed(p, paths={k: v for k, v in p.paths.items() if k != "positioner"}), "paths: "),
        (lambda p: with_path(p, "positioner", p.paths["positioner"][:, :1]), "paths.positioner: "),
        (lambda p: with_path(p, "table", p.paths["positioner"]), "paths: "),
        (lambda p: changed(p, s=p.s + 1e-3), "s: not at least two increasing numbers in "),
        (lambda p: changed(p, yaw_rad=np.zeros(1)), "yaw_rad: "),
    ],
)
def test_shapes_that_contradict_the_cell_are_refused(dual_plan: Plan, spoil, what):
    with pytest.raises(PlanError, match=what):
        verify(spoil(dual_plan))
