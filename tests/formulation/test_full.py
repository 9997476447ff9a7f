"""The full-space form: closed chains, sparse derivatives by Taylor's slope, and the reduced form's answers."""

from collections.abc import Callable

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.full import CONSTRAINTS, Full, full, full_start
from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.formulation.paths import flip
from nlpweld.formulation.reduced import reduced
from nlpweld.solvers import Budget, make_solver
from nlpweld.verify import verify

from .helpers import PAPER

AT = {"three_er16": PAPER, "dual_welder_positioner": [0.2, -1.4], "robot_positioner": [0.0, -1.0]}
STEPS = 10.0 ** np.arange(-2.5, -4.6, -0.5)


@pytest.fixture(scope="module")
def form(cell: Cell) -> Nlp:
    return full(cell)


@pytest.fixture(scope="module")
def z(nlp: Nlp) -> np.ndarray:
    """The paper's placement, feasible and closed."""
    return full_start(nlp.unpack(PAPER, 0))


@pytest.fixture(scope="module")
def relaxation(form: Nlp) -> Relaxation:
    return form.relax(0, False)


def missed(form: Nlp, z: np.ndarray) -> dict[str, float]:
    """Return what a candidate misses, by name, leaving out what it does not."""
    found = form.evaluate(z[None]).violation[0]
    return {name: float(value) for name, value in zip(CONSTRAINTS, found, strict=True) if value > 0}


def at(form: Nlp, point: int, station: str, joint: int) -> int:
    """Return the index of a joint, counted from 1, at a seam point."""
    return form.names.index(f"{station}.J{joint}[{point}]_rad")


@pytest.mark.parametrize("name", AT)
def test_reduced_answer_is_closed_feasible_and_as_good_in_full_space(name: str) -> None:
    cell, x = load_cell(name), np.array(AT[name])
    small, large = reduced(cell), full(cell)
    z = full_start(small.unpack(x, 0))
    assert len(z) == len(large.lower) == len(large.names) == len(x) + 72 * 6 * len(cell.stations)
    assert missed(large, z) == {}
    assert large.evaluate(z[None]).objective == pytest.approx(small.evaluate(x[None]).objective, rel=1e-12)
    equalities = large.relax(0, False).equalities
    assert np.abs(np.array(equalities.value(z))).max() < 1e-8
    assert ((large.lower <= z) & (z <= large.upper)).all()


def test_plan_of_variables_of_a_plan_is_that_plan(form: Nlp, nlp: Nlp, z: np.ndarray) -> None:
    plan, again = nlp.unpack(PAPER, 0), form.unpack(z, 0)
    assert (again.placement == plan.placement).all()
    assert again.branches == plan.branches
    for name, q in plan.paths.items():
        assert again.paths[name] == pytest.approx(q, abs=1e-12)


def test_plan_behind_a_positioner_has_its_joints_too() -> None:
    single = load_cell("robot_positioner")
    plan = reduced(single).unpack(np.array([0.0, -1.0]), 0)
    again = full(single).unpack(full_start(plan), 0)
    assert again.paths["positioner"] == pytest.approx(plan.paths["positioner"], abs=1e-12)
    assert verify(again).feasible


def test_starts_are_judged_as_their_placements_are(form: Nlp, batch: Batch) -> None:
    Z = form.starts(5, 48)
    ours, theirs = form.evaluate(Z), batch.evaluate(Z[:, :3])
    seen = np.isfinite(theirs.objective)
    assert 3 < seen.sum() < 48
    assert ours.objective[seen] == pytest.approx(theirs.objective[seen], rel=1e-12)
    assert ours.feasible.tolist() == theirs.feasible.tolist()
    reached = theirs.violation[:, 0] == 0.0
    assert (ours.violation[:, 0] == 0.0).tolist() == reached.tolist()
    assert ours.violation[reached, 4] == pytest.approx(theirs.violation[reached, 2], abs=1e-12)


def test_starts_follow_the_seed_the_best_first_and_inside_the_bounds(form: Nlp) -> None:
    first, again, other = form.starts(3, 2), form.starts(3, 2), form.starts(4, 2)
    assert (first == again).all()
    assert not (first == other).any()
    assert form.evaluate(first[:1]).total[0] <= form.evaluate(first[1:]).total[0]
    assert ((form.lower <= first) & (first <= form.upper)).all()


def test_chain_opened_by_a_joint_is_told_by_the_turn(form: Nlp, z: np.ndarray) -> None:
    bent = z.copy()
    bent[at(form, 7, "welder", 6)] += 0.01
    assert missed(form, bent) == {"closure": pytest.approx(0.01, abs=2e-7)}


def test_half_a_turn_of_a_tool_is_open_though_its_sine_is_none(form: Nlp, relaxation: Relaxation) -> None:
    plan = reduced(form.evaluate.__self__.cell).unpack(PAPER, 0)
    tool = np.zeros(6)
    tool[5] = np.pi  # about the gripper's axis, which is the flange's
    plan.paths["handler_1"] = plan.paths["handler_1"] - tool
    turned = full_start(plan)
    assert np.abs(np.array(relaxation.equalities.value(turned))).max() < 1e-8
    assert missed(form, turned)["closure"] == pytest.approx(np.pi, abs=1e-6)


def test_a_wrist_that_flips_between_points_is_off_its_branch_there(form: Nlp, z: np.ndarray, cell: Cell) -> None:
    flipped = z.copy()
    here = slice(at(form, 7, "welder", 1), at(form, 7, "welder", 6) + 1)
    flipped[here] = flip(cell.stations[2].robot, z[here][:, None])[:, 0]
    found = missed(form, flipped)
    assert found["branch"] == pytest.approx(1 / 72)
    assert "closure" not in found


def test_side_that_the_cell_does_not_allow_counts_at_every_point(z: np.ndarray, cell: Cell) -> None:
    found = missed(full(cell.with_(configuration={"wrist": "flip"}), "numpy"), z)
    assert found == {"branch": 1.0}


def test_a_jump_by_a_turn_is_no_path(form: Nlp, z: np.ndarray) -> None:
    torn = z.copy()
    torn[at(form, 7, "welder", 4)] += 2 * np.pi
    assert missed(form, torn)["continuity"] == pytest.approx(1.0, abs=0.01)


def test_a_winding_joint_is_shifted_by_its_turn_with_its_way_back(form: Nlp, z: np.ndarray, nlp: Nlp) -> None:
    plan = nlp.unpack(PAPER, 0)
    q = plan.paths["handler_1"][:, 5]
    assert abs(q[-1] - q[0]) > np.radians(300)
    beyond = z.copy()
    beyond[at(form, 0, "handler_1", 6) :: 18] += 2 * np.pi
    assert missed(form, beyond) == {}
    assert form.unpack(beyond, 0).paths["handler_1"][:, 5] == pytest.approx(q, abs=1e-9)


def test_joint_beyond_its_limit_is_told_by_how_much(form: Nlp, z: np.ndarray, cell: Cell) -> None:
    bent = z.copy()
    bent[at(form, 7, "welder", 5)] = np.radians(131.0)
    margin = np.radians(1.0 + cell.constraints.joint_margin_deg)
    assert missed(form, bent)["joint_limit"] == pytest.approx(margin / np.pi, rel=1e-9)


def slope(errors: list[float]) -> float:
    """Return the order at which errors fall with the step."""
    return float(np.polyfit(np.log(STEPS), np.log(errors), 1)[0])


def directions(n: int) -> np.ndarray:
    """Return three random directions of entries of order one."""
    return np.random.default_rng(41).normal(size=(3, n))


def taylor(f: Callable[[np.ndarray], float], z: np.ndarray, d: np.ndarray, *terms: float) -> float:
    """Return the order of what a Taylor model in a direction, terms from the slope on, leaves."""
    model = [f(z) + sum(t * h ** (i + 1) / (i + 1) for i, t in enumerate(terms)) for h in STEPS]
    return slope([abs(f(z + h * d) - m) for h, m in zip(STEPS, model, strict=True)])


def test_gradient_and_hessian_of_the_value_leave_second_and_third_order(relaxation: Relaxation, z: np.ndarray) -> None:
    gradient, hessian = np.array(relaxation.gradient(z, 20.0)).ravel(), np.array(relaxation.hessian(z, 20.0))
    assert np.abs(hessian - hessian.T).max() < 1e-12
    for d in directions(len(z)):
        first, second = gradient @ d, d @ hessian @ d
        assert taylor(lambda at: float(relaxation.value(at, 20.0)), z, d, first) == pytest.approx(2.0, abs=0.15)
        assert taylor(lambda at: float(relaxation.value(at, 20.0)), z, d, first, second) > 2.7


def test_jacobian_and_lagrangian_of_the_closure_leave_second_and_third_order(
    relaxation: Relaxation, z: np.ndarray
) -> None:
    same = relaxation.equalities
    weights = np.random.default_rng(42).normal(size=len(z) - 3)
    jacobian = np.array(same.jacobian(z))
    upper = np.array(same.hessian(z, 20.0, 0.0, weights))
    hessian = upper + np.triu(upper, 1).T

    def weighed(at: np.ndarray) -> float:
        return float(weights @ np.array(same.value(at)).ravel())

    for d in directions(len(z)):
        first, second = weights @ jacobian @ d, d @ hessian @ d
        assert taylor(weighed, z, d, first) == pytest.approx(2.0, abs=0.15)
        assert taylor(weighed, z, d, first, second) > 2.7


def test_lagrangian_adds_value_and_closure(relaxation: Relaxation, z: np.ndarray) -> None:
    weights = np.random.default_rng(43).normal(size=len(z) - 3)
    both, value, closure = (
        np.array(relaxation.equalities.hessian(z, 20.0, f, g * weights)) for f, g in ((2, 3), (2, 0), (0, 3))
    )
    assert np.abs(closure).max() > 1.0
    assert np.abs(both - value - closure).max() < 1e-9
    assert np.abs(value - 2 * np.triu(np.array(relaxation.hessian(z, 20.0)))).max() < 1e-9


def test_relaxation_on_closed_chains_is_the_reduced_forms(relaxation: Relaxation, nlp: Nlp, z: np.ndarray) -> None:
    assert float(relaxation.value(z, 1e3)) == pytest.approx(float(nlp.relax(0, False).value(PAPER, 1e3)), abs=1e-9)


def test_every_seam_point_adds_the_same_number_of_nonzeros(cell: Cell) -> None:
    counts = []
    for points in (10, 20, 40):
        relaxation = full(cell.with_(seam={"points": points}), "numpy").relax(0, False)
        z = np.zeros(3 + 18 * points)
        same = relaxation.equalities
        counts.append((same.jacobian(z).nnz(), same.hessian(z, 1.0, 1.0, np.zeros(18 * points)).nnz()))
    (a, b, c) = np.array(counts)
    assert (c - b == 2 * (b - a)).all()
    assert (b - a <= 10 * np.array([18 * 9, 18 * 19 // 2 + 3 * 18])).all()


@pytest.mark.parametrize(("name", "points"), [("robot_positioner", 72), ("three_er16", 36)])
def test_ipopt_in_full_space_finds_the_reduced_optimum(name: str, points: int) -> None:
    cell = load_cell(name).with_(seam={"points": points})
    large, ipopt = full(cell, "numpy"), make_solver("ipopt", "full")
    outcome = ipopt.solve(large, seed=1, budget=Budget())
    known = make_solver("ipopt").solve(reduced(cell, "numpy"), seed=0, budget=Budget())
    assert (outcome.status, known.status) == ("SOLVED", "SOLVED")
    assert outcome.objective == pytest.approx(known.objective, abs=1e-5)
    assert outcome.x[:2] == pytest.approx(known.x[:2], abs=5e-3)
    assert verify(large.unpack(outcome.x, outcome.mode)).feasible


def test_modes_are_those_the_joints_are_on(cell: Cell) -> None:
    opened = Full(Batch(cell.with_(configuration={"shoulder": "any", "elbow": "any"}), "numpy"))
    reached = 0
    for mode in range(0, 64, 7):
        z = opened.start(PAPER, mode)[None]
        found = opened.evaluate(z)
        if found.violation[0, 0] == 0.0:
            reached += 1
            assert found.mode[0] == mode
            assert [b[:2] for b in opened.unpack(z[0], 0).branches.values()] == list(opened.batch.modes[mode])
    assert reached >= 2
