"""The checker on a good plan, and on what is no plan at all."""

import subprocess
import sys

import numpy as np
import pytest

from nlpweld.errors import PlanError
from nlpweld.plan import Plan
from nlpweld.verify.check import verify
from nlpweld.verify.report import Report

from .helpers import BRANCH, ROBOTS, changed, with_path


def test_report_agrees_with_the_independent_prototype(report: Report):
    """The table of the model at the paper's placement, to its printed digits."""
    assert report.feasible
    assert report.violations == ()
    assert report.mmr_mean == pytest.approx(0.284151, rel=1e-5)
    assert report.mmr_min == pytest.approx(0.153509, rel=1e-5)
    assert report.mmr_max == pytest.approx(0.353748, rel=1e-5)
    assert report.m_tight_mean == pytest.approx(0.215940, rel=1e-5)
    assert report.m_loose_mean == pytest.approx(0.423846, rel=1e-5)
    assert [report.manipulability_mean[r] for r in ROBOTS] == pytest.approx([0.432087, 0.447137, 0.423846], rel=1e-5)
    assert report.manipulability_min["handler_1"] == pytest.approx(0.123421, rel=1e-5)
    assert report.profile["clearance_m"].min() == pytest.approx(0.0244, abs=5e-5)
    assert report.n_points == 72
    assert report.at == (0.023, -0.266, 0.404)


def test_closest_pair_is_a_forearm_and_the_torch(report: Report):
    """At the points it is handler_1's at point 0; handler_2's at point 36 ties, for the pair's distance does not
    depend on the placement: wrist centre and torch are both fixed to the work."""  # fmt: skip
    assert report.profile["clearance_m"][[0, 36]] == pytest.approx([0.0244174] * 2, abs=1e-7)
    assert report.profile["clearance_m"].argmin() in (0, 36)
    assert report.closest_pair in {f"handler_{k}.forearm - welder.torch_body" for k in (1, 2)}


def test_margins_are_looked_for_between_the_points(report: Report):
    assert report.clearance_along_m == pytest.approx(0.0242114, abs=1e-6)
    assert report.clearance_along_m < report.profile["clearance_m"].min()
    assert report.singularity_min["handler_1"] == pytest.approx(0.123318, abs=1e-6)
    assert report.singularity_min["handler_1"] < report.manipulability_min["handler_1"]


def test_profile_belongs_to_the_numbers(plan: Plan, report: Report):
    assert all(array.shape == (72,) for array in report.profile.values())
    assert report.profile["mmr"].mean() == report.mmr_mean
    assert report.profile["m_tight"].mean() == report.m_tight_mean
    assert report.profile["manipulability.welder"].min() == report.manipulability_min["welder"]
    assert (report.profile["common_volume"] > 0).all()
    assert min(report.profile[f"joint_margin_rad.{r}"].min() for r in ROBOTS) >= report.joint_margin_rad
    margin = min((np.abs(plan.paths[st.name][..., None] - st.robot.limits_rad)).min() for st in plan.cell.stations)
    assert 0 < report.joint_margin_rad <= margin


def test_true_branch_labels_are_accepted(plan: Plan):
    assert verify(changed(plan, branches=BRANCH)).feasible


def test_coarse_plan_is_filled_in_with_the_same_motion(coarse: Plan, report: Report):
    got = verify(coarse)
    assert got.feasible, str(got)
    assert got.n_points == 6
    assert got.clearance_m == pytest.approx(report.clearance_m, abs=1e-4)
    assert got.singularity_min == pytest.approx(report.singularity_min, abs=1e-4)


@pytest.mark.parametrize(
    ("spoil", "what"),
    [
        (lambda p: changed(p, paths={k: v for k, v in p.paths.items() if k != "welder"}), "paths"),
        (lambda p: with_path(p, "welder", p.paths["welder"][:, :5]), "paths.welder"),
        (lambda p: with_path(p, "welder", p.paths["welder"][:-1]), "paths.welder"),
        (lambda p: changed(p, s=p.s[::-1]), "s:"),
        (lambda p: changed(p, placement_m=p.placement_m[:2]), "placement_m"),
    ],
)
def test_shapes_that_contradict_the_cell_are_refused(plan: Plan, spoil, what):
    with pytest.raises(PlanError, match=what):
        verify(spoil(plan))


def test_verifying_twice_gives_the_same(plan: Plan, report: Report):
    assert verify(plan).to_json(profile=True) == report.to_json(profile=True)


@pytest.mark.parametrize(
    ("module", "banned"),
    [
        (
            "nlpweld.verify.check",
            (
                "casadi",
                "nlpweld.kinematics",
                "nlpweld.formulation",
                "nlpweld.solvers",
                *(f"nlpweld.geometry.{m}" for m in ("posture", "capsules", "weld_angles", "torch_angles")),
            ),
        ),
        ("nlpweld.verify.worker", ("casadi", "scipy", "pydantic")),
    ],
)
def test_checker_stands_on_its_own(module, banned):
    text = f"import sys, {module}; print([m for m in sys.modules if m.startswith({banned!r})])"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
