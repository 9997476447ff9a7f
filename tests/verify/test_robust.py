"""Plans under errors of the set-up: paths closed anew in every scenario, and the worst of all told."""

import numpy as np
import pytest

from nlpweld.cell import Cell, uncertainty
from nlpweld.cell.uncertainty import samples
from nlpweld.errors import OptionError
from nlpweld.plan import Plan
from nlpweld.verify import reference as ref
from nlpweld.verify import verify, verify_robust
from nlpweld.verify.robust import closed_anew
from nlpweld.verify.worst_case import Worst

from .conftest import AT, march
from .helpers import cell_with, changed


def off(plan: Plan, **box: object) -> Plan:
    return changed(plan, cell=plan.cell.with_(uncertainty={**box, "source": "a test"}))


def test_worst_is_that_of_the_plan_marched_anew_at_the_vertices(cell: Cell, plan: Plan) -> None:
    report = verify_robust(off(plan, placement_m=(0.0, 0.0, 0.002)), extra=1)
    apart = {dz: verify(march(cell, AT + np.array([0.0, 0.0, dz]))) for dz in (-0.002, 0.002)}
    worst = report.worst_case
    assert report.feasible
    assert (worst.scenarios, worst.vertices, worst.samples, worst.feasible) == (4, 3, 1, 4)
    assert report.mmr_mean == verify(plan).mmr_mean
    assert worst.mmr_mean.value == pytest.approx(min(r.mmr_mean for r in apart.values()), abs=1e-12)
    least = {dz: min(r.singularity_min.values()) for dz, r in apart.items()}
    assert worst.singularity.value == pytest.approx(min(least.values()), abs=1e-9)
    assert worst.singularity.scenario == f"placement {1e3 * min(least, key=least.get):+.3g} mm in z"


def test_level_missed_in_one_scenario_alone_makes_the_plan_infeasible_and_says_where(coarse: Plan) -> None:
    up = off(coarse, placement_m=(0.0, 0.0, 0.002))
    tight = min(verify(coarse).singularity_min.values()) - 1e-6
    level = cell_with(up.cell, constraints={"singularity_floor_m3": tight})
    report = verify_robust(changed(up, cell=level), extra=0)
    assert verify(changed(up, cell=level)).feasible
    assert not report.feasible
    assert report.worst_case.feasible == 2
    assert {v.constraint for v in report.violations} == {"singularity"}
    assert "with placement +2 mm in z" in report.violations[0].note
    assert report.violations[0].value == pytest.approx(report.worst_case.singularity.value)


@pytest.mark.parametrize("name", ["coarse", "dual_plan"])
def test_chains_close_in_the_cell_as_it_is_near_the_plan(name: str, request: pytest.FixtureRequest) -> None:
    plan = off(
        request.getfixturevalue(name), placement_m=(0.003,) * 3, placement_deg=0.5, base_m=(0.001,) * 3, base_deg=0.1
    )
    (scenario,) = samples(plan.cell, 1, 6)
    found = closed_anew(plan, scenario)
    placement = plan.placement + scenario.placement
    table = found.paths.get("positioner")
    for k, (station, old) in enumerate(zip(found.cell.stations, plan.cell.stations, strict=True)):
        T_W_B = ref.base_pose(station)
        turned = ref.rpy_matrix((0.0, 0.0, float(np.degrees(scenario.bases[k, 3]))))
        assert T_W_B[:3, 3] - old.base_position_m == pytest.approx(scenario.bases[k, :3], abs=1e-12)
        assert T_W_B[:3, :3] == pytest.approx(turned @ ref.base_pose(old)[:3, :3], abs=1e-12)
        q = found.paths[station.name]
        wanted = ref.required_pose(plan.cell, station, placement, plan.s, table)
        error = ref.pose_error(wanted, ref.tcp_pose(station, ref.link_poses(station, q)))
        assert np.abs(error).max() < 1e-9
        assert 1e-5 < np.abs(q - plan.paths[station.name]).max() < 0.1


def test_all_bases_moved_alike_are_the_placement_moved_back(coarse: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """Heights above the floor apart, robots see the same work."""
    monkeypatch.setattr(uncertainty, "DRAWN", 0)
    bases = verify_robust(off(coarse, base_m=(0.0, 0.002, 0.0)), extra=0)
    placed = verify_robust(off(coarse, placement_m=(0.0, 0.002, 0.0)), extra=0)
    assert bases.worst_case.scenarios == placed.worst_case.scenarios == 3
    assert bases.worst_case.singularity.scenario.startswith("every base")
    assert bases.worst_case.singularity.value < min(verify(coarse).singularity_min.values())
    assert bases.worst_case.singularity.value == pytest.approx(placed.worst_case.singularity.value, abs=1e-9)


def test_scenario_that_robots_cannot_reach_is_not_feasible(coarse: Plan) -> None:
    report = verify_robust(off(coarse, placement_m=(0.0, 0.0, 3.0)), extra=0)
    assert not report.feasible
    assert "closure" in {v.constraint for v in report.violations}
    assert report.worst_case.feasible == 1


def test_report_tells_the_worst_within_its_width_and_as_json(coarse: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uncertainty, "DRAWN", 1)
    report = verify_robust(off(coarse, placement_m=(0.001, 0.0, 0.0), base_m=(0.001, 0.0, 0.0)), extra=2)
    text = str(report)
    assert max(len(line) for line in text.splitlines()) <= 80
    assert f"of {report.worst_case.scenarios} scenarios" in text
    found = report.to_json()["worst_case"]
    assert found["samples"] == 2
    assert found["clearance_m"] == {
        "value": report.worst_case.clearance_m.value,
        "scenario": report.worst_case.clearance_m.scenario,
    }
    assert verify(coarse).to_json()["worst_case"] is None


def test_a_number_that_is_none_is_the_worst() -> None:
    assert Worst.of([1.0, float("nan"), -2.0], ["a", "b", "c"]).scenario == "b"
    assert Worst.of([1.0, -2.0], ["a", "b"]) == Worst(-2.0, "b")


def test_broken_plan_is_reported_without_scenarios(coarse: Plan) -> None:
    path = coarse.paths["welder"].copy()
    path[2, 1] = np.nan
    report = verify_robust(off(changed(coarse, paths={**coarse.paths, "welder": path}), base_deg=0.1))
    assert not report.feasible
    assert report.worst_case is None


def test_a_plan_whose_cell_states_no_errors_is_refused(coarse: Plan) -> None:
    with pytest.raises(OptionError, match=r"no \[uncertainty\] table"):
        verify_robust(coarse)
