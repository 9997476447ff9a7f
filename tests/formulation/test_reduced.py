"""The reduced form: what solvers are told, and the plans it unpacks."""

import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.formulation.batch import CONSTRAINTS, Batch
from nlpweld.formulation.nlp import Evaluation, Nlp
from nlpweld.formulation.paths import limit_margins
from nlpweld.formulation.reduced import OutOfReach, Unpacker, reduced
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.plan import Plan

from .helpers import PAPER, base, tcp_in_base, workpiece_poses

AT_POINT_0 = {  # model.md: degrees, DH convention, one wrist
    "handler_1": (137.690, 26.848, 6.920, -1.237, 79.488, -66.037),
    "handler_2": (49.560, 45.061, 24.204, -107.459, 64.536, -178.979),
    "welder": (-90.655, 14.161, 3.397, 0.318, 50.443, 179.190),
}


@pytest.fixture(scope="module")
def plan(nlp: Nlp) -> Plan:
    return nlp.unpack(PAPER, 0)


def test_joints_at_point_0_of_the_papers_placement_are_the_models(plan: Plan) -> None:
    for name, expected in AT_POINT_0.items():
        off = np.degrees(plan.paths[name][0]) - expected
        assert off - 360 * np.round(off / 360) == pytest.approx(np.zeros(6), abs=1e-3)


def largest_closure_error(plan: Plan) -> float:
    """Return how far any TCP of a plan is from where its coupling wants it, as a pose and over the seam."""
    cell, T_W_C = plan.cell, workpiece_poses(plan.cell, plan.placement_m)
    p_W = np.einsum("nij,nj->ni", T_W_C[:, :3, :3], weld_frames(cell, plan.s).p_C) + T_W_C[:, :3, 3]
    errors = []
    for k, station in enumerate(cell.stations):
        T_W_E = base(cell, k) @ tcp_in_base(cell, k, plan.paths[station.name])
        if station.coupling.kind == "tight":
            errors.append(np.abs(T_W_E - T_W_C @ station.coupling.T_C_E).max())
        else:
            down = np.column_stack([(0, 1, 0), (1, 0, 0), (0, 0, -1)])
            errors += [np.abs(T_W_E[:, :3, 3] - p_W).max(), np.abs(T_W_E[:, :3, :3] - down).max()]
    return float(max(errors))


def test_plan_of_the_papers_placement_closes_every_chain(plan: Plan) -> None:
    assert largest_closure_error(plan) < 1e-9


def test_plans_of_all_modes_close_every_chain(any_batch: Batch) -> None:
    plans = [Unpacker(any_batch)(PAPER, mode) for mode in range(0, 64, 7)]
    closed = [plan for plan in plans if isinstance(plan, Plan)]
    assert len(closed) >= 2
    assert max(map(largest_closure_error, closed)) < 1e-9


def test_feasible_plan_keeps_the_solvers_joint_margin(plan: Plan) -> None:
    for station in plan.cell.stations:
        q = plan.paths[station.name]
        assert limit_margins(station.robot, q.T).min() >= np.radians(plan.cell.constraints.joint_margin_deg)


def test_paths_take_no_jump_along_the_seam(plan: Plan) -> None:
    for q in plan.paths.values():
        assert np.abs(np.diff(q, axis=0)).max() < np.radians(30)


def test_plan_states_placement_seam_and_branches(plan: Plan) -> None:
    assert (plan.placement_m == PAPER).all()
    assert (plan.s == seam_parameters(plan.cell)).all()
    assert {branch[:2] for branch in plan.branches.values()} == {("front", "up")}


@pytest.mark.parametrize("wrist", ["flip", "noflip"])
def test_named_wrist_is_the_side_to_which_the_hand_bends(cell: Cell, wrist: str) -> None:
    plan = reduced(cell.with_(configuration={"wrist": wrist})).unpack(PAPER, 0)
    for station in cell.stations:
        assert plan.branches[station.name][2] == wrist
        bend = np.sin(plan.paths[station.name][:, 4] + station.robot.dh[4, 3])
        assert ((bend > 0) == (wrist == "noflip")).all()


def test_wrist_chosen_among_both_is_named_as_the_hand_bends(cell: Cell) -> None:
    station = cell.stations[0]
    joints = list(station.robot.joints)
    joints[4] = joints[4].model_copy(update={"upper_deg": -1.0})  # handler_1's hand bends to one side only
    robot = station.robot.model_copy(update={"joints": tuple(joints)})
    one_sided = cell.model_copy(update={"stations": (station.model_copy(update={"robot": robot}), *cell.stations[1:])})
    plan = reduced(one_sided).unpack(PAPER, 0)
    assert [plan.branches[s.name][2] for s in cell.stations] == ["flip", "noflip", "noflip"]
    assert (plan.paths["handler_1"][:, 4] < 0).all()


def test_placement_out_of_reach_unpacks_to_who_cannot_reach_which_point(nlp: Nlp, batch: Batch) -> None:
    at = np.array([0.0, -1.0, 1.2])
    found = nlp.unpack(at, 0)
    assert isinstance(found, OutOfReach)
    assert found.station == "welder"
    reach = Unpacker(batch)._solve(2, at, ("front", "up"))[1]
    assert found.point == int(reach.argmin())
    assert reach.min() < 0.0


def test_solvers_see_three_named_variables_in_the_box(nlp: Nlp, cell: Cell) -> None:
    assert nlp.names == ("x_m", "y_m", "z_m")
    assert (np.array([nlp.lower, nlp.upper]) == cell.box).all()
    assert (nlp.problem, nlp.formulation, nlp.n_modes) == ("three_er16", "reduced", 1)


def test_constraints_are_named_column_by_column(nlp: Nlp) -> None:
    assert nlp.constraints == CONSTRAINTS
    assert nlp.evaluate(PAPER).violation.shape == (1, len(CONSTRAINTS))


@pytest.mark.parametrize("count", [1, 7, 8])
def test_starts_lie_in_the_box_as_many_as_asked(nlp: Nlp, count: int) -> None:
    starts = nlp.starts(seed=3, count=count)
    assert starts.shape == (count, 3)
    assert ((starts >= nlp.lower) & (starts <= nlp.upper)).all()


@pytest.mark.parametrize("count", [1, 8])
def test_starts_follow_the_seed(nlp: Nlp, count: int) -> None:
    first, again, other = (nlp.starts(seed, count) for seed in (3, 3, 4))
    assert (first == again).all()
    assert not (first == other).any()


def test_candidate_is_feasible_just_when_it_misses_nothing() -> None:
    found = Evaluation(np.zeros(3), np.array([[0, 0], [0, 1e-300], [2, 3]]), np.zeros(3, dtype=int))
    assert found.feasible.tolist() == [True, False, False]
    assert found.total[2] == 5.0
