"""Populations: the numbers of the model, the symmetry of the cell, and evaluation whatever the company."""

import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.staged import NEAR

from .helpers import PAPER, arm_outputs

# The model's table: placement, mean MMR with the tolerance its last digit leaves, feasible with the solvers' margins.
ROWS = [
    (PAPER, 0.284151, 1e-6, True),
    ((0.0, -0.1653, 0.4052), 0.29703, 1e-5, False),
    ((0.0, -0.1623, 0.4026), 0.29682, 1e-5, False),
]


def sample(cell: Cell, m: int, seed: int) -> np.ndarray:
    """Return random placements; a quarter of them near the feasible part, shape (m, 3) [m]."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(*cell.box, (m, 3))
    X[::4] = (0.0, -0.2, 0.4) + 0.1 * rng.normal(size=(len(X[::4]), 3))
    return X


@pytest.mark.parametrize(("at", "mean", "tolerance", "feasible"), ROWS, ids=["paper", "at_72", "continuous"])
def test_mean_mmr_and_feasibility_are_the_models(
    batch: Batch, at: tuple, mean: float, tolerance: float, feasible: bool
) -> None:
    found = batch.evaluate(np.array([at]))
    assert found.objective[0] == pytest.approx(mean, abs=tolerance)
    assert bool(found.feasible[0]) is feasible


@pytest.mark.parametrize("at", [row[0] for row in ROWS[1:]], ids=["at_72", "continuous"])
def test_models_optima_keep_the_floor_at_the_points_but_not_the_solvers_margin(batch: Batch, at: tuple) -> None:
    w = arm_outputs(batch.stage, 0, np.array(at))[1]
    assert w.min() == pytest.approx(0.1200, abs=6e-4)
    assert list(batch.evaluate(np.array([at])).violation[0] > 0) == [False, False, True, False]


def test_papers_placement_has_the_models_means_and_extremes_over_the_seam(batch: Batch) -> None:
    out = [arm_outputs(batch.stage, k, PAPER) for k in range(3)]
    w, gram = (np.array([o[i][:, 0] for o in out]) for i in (1, 2))
    beta_1, beta_2 = (gram[0] ** -0.5 + gram[1] ** -0.5) / 2, gram[2] ** -0.5
    values = (beta_1 * w[0] * w[1] + beta_2 * w[2]) / (beta_1 + beta_2)  # eq. 16
    got = [values.mean(), values.min(), values.max(), (w[0] * w[1]).mean(), *w.mean(axis=1), w[0].min()]
    expected = [0.284151, 0.153509, 0.353748, 0.215940, 0.432087, 0.447137, 0.423846, 0.123421]
    assert got == pytest.approx(expected, abs=1.5e-6)


def test_optimum_of_the_models_points_has_its_means(batch: Batch) -> None:
    w = np.array([arm_outputs(batch.stage, k, np.array([0, -0.1653, 0.4052]))[1][:, 0] for k in range(3)])
    assert (w[0] * w[1]).mean() == pytest.approx(0.2470, abs=6e-5)
    assert w[2].mean() == pytest.approx(0.3787, abs=6e-5)


def test_about_one_percent_of_the_box_is_feasible(batch: Batch) -> None:
    X = np.random.default_rng(1).uniform(*batch.cell.box, (3000, 3))
    assert batch.evaluate(X).feasible.mean() == pytest.approx(0.0087, abs=0.0035)  # two standard deviations


def test_all_branches_raise_the_optimum_to_the_models(any_batch: Batch) -> None:
    found = any_batch.evaluate(np.array([[0.0, -0.067, 0.349]]))
    assert found.objective[0] == pytest.approx(0.3217, abs=1e-4)
    assert found.feasible[0]


def test_no_singularity_floor_raises_the_optimum_to_the_models(cell: Cell) -> None:
    free = Batch(cell.with_(constraints={"singularity_floor_m3": 0.0, "singularity_margin_m3": 0.0}))
    found = free.evaluate(np.array([[0.0, -0.127, 0.544]]))
    assert found.objective[0] == pytest.approx(0.3117, abs=1e-4)
    assert found.violation[0, 2] == 0.0


@pytest.fixture(scope="module")
def tireless(any_batch: Batch) -> Batch:
    """The evaluator with all branches open and no joint limit that counts.

    Joints 4 and 6 wind once along the seam on some placements; how far they then reach depends on where the seam is
    started, and the mirror image starts half a turn on. So joint limits are not part of the symmetry.
    """
    stations = []
    for station in any_batch.cell.stations:
        joints = tuple(j.model_copy(update={"lower_deg": -9e3, "upper_deg": 9e3}) for j in station.robot.joints)
        robot = station.robot.model_copy(update={"joints": joints})
        stations.append(station.model_copy(update={"robot": robot}))
    return Batch(any_batch.cell.model_copy(update={"stations": tuple(stations)}))


def test_mirrored_placement_has_the_same_objective_on_the_same_branches(batch: Batch) -> None:
    X = sample(batch.cell, 700, seed=2)
    here, there = batch.evaluate(X).objective, batch.evaluate(X * [-1, 1, 1]).objective
    both = np.isfinite(here) & np.isfinite(there)  # joint limits, which come before the objective, are not symmetric
    assert both.sum() > 60
    assert here[both] == pytest.approx(there[both], rel=1e-9)


def test_objective_is_told_only_where_reach_joints_and_nearly_the_floor_are_kept(batch: Batch) -> None:
    found = batch.evaluate(sample(batch.cell, 400, seed=3))
    near = (found.violation[:, :2] == 0.0).all(axis=1) & (found.violation[:, 2] < NEAR)
    assert 0 < near.sum() < 400
    assert (np.isfinite(found.objective) == near).all()


def test_mirrored_placement_misses_everything_but_joint_limits_by_as_much(tireless: Batch) -> None:
    X = sample(tireless.cell, 120, seed=3)
    here, there = tireless.evaluate(X), tireless.evaluate(X * [-1, 1, 1])
    assert here.violation.any(axis=0).tolist() == [True, False, True, True]
    assert here.violation == pytest.approx(there.violation, abs=1e-9)
    assert here.objective == pytest.approx(there.objective, rel=1e-9)


def test_mirrored_placement_is_as_feasible_where_both_keep_the_joint_limits(batch: Batch) -> None:
    X = sample(batch.cell, 400, seed=4)
    here, there = batch.evaluate(X), batch.evaluate(X * [-1, 1, 1])
    both = (here.violation[:, 1] == 0.0) & (there.violation[:, 1] == 0.0)
    assert here.feasible[both].sum() > 10
    assert here.violation[both] == pytest.approx(there.violation[both], abs=1e-9)


def test_mirrored_placement_swaps_the_handlers_and_runs_the_seam_backwards(batch: Batch) -> None:
    mirror = (36 - np.arange(72)) % 72
    w = [arm_outputs(batch.stage, k, PAPER)[1] for k in range(3)]
    swapped = [arm_outputs(batch.stage, k, PAPER * [-1, 1, 1])[1][mirror] for k in (1, 0, 2)]
    assert swapped == pytest.approx(np.array(w), abs=1e-12)


def test_candidate_is_judged_alike_alone_and_in_any_company_or_order(batch: Batch) -> None:
    X = sample(batch.cell, 100, seed=4)
    whole, order = batch.evaluate(X), np.random.default_rng(5).permutation(100)
    shuffled = batch.evaluate(X[order])
    for i in (0, 31, 32, 99):
        alone = batch.evaluate(X[i])
        assert alone.objective[0] == pytest.approx(whole.objective[i], rel=1e-13)
        assert alone.violation[0] == pytest.approx(whole.violation[i], rel=1e-12)
    assert batch.evaluate(X[:31]).objective == pytest.approx(whole.objective[:31], rel=1e-13)
    assert shuffled.objective == pytest.approx(whole.objective[order], rel=1e-13)
    assert shuffled.violation == pytest.approx(whole.violation[order], rel=1e-12)
    assert (shuffled.mode == whole.mode[order]).all()


@pytest.mark.parametrize("fixture", ["batch", "any_batch"])
def test_unreachable_placements_have_finite_violations_that_grow_with_distance(
    fixture: str, request: pytest.FixtureRequest
) -> None:
    far = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 3.0], [9.0, 9.0, 9.0], [1e3, -1e3, 1e3], [-1e6, 0.0, 1e6]])
    found = request.getfixturevalue(fixture).evaluate(far)
    assert np.isfinite(found.violation).all()
    assert (np.diff(found.total) > 0).all()
    assert (found.violation[:, 0] > 0).all()


def test_placement_on_a_robots_own_axis_has_finite_violations(batch: Batch) -> None:
    on_axes = np.array([s.base_position_m for s in batch.cell.stations])
    assert np.isfinite(batch.evaluate(on_axes).violation).all()


def test_all_branches_are_at_least_as_good_as_front_and_elbow_up(batch: Batch, any_batch: Batch) -> None:
    X = sample(batch.cell, 150, seed=6)
    front, best = batch.evaluate(X), any_batch.evaluate(X)
    assert (best.total <= front.total + 1e-12).all()
    level = best.total == front.total
    assert (best.objective[level] >= front.objective[level] - 1e-12).all()
    assert ((best.total < front.total) | (best.objective > front.objective + 1e-3)).any()


def test_modes_name_every_combination_of_arm_branches_once(any_batch: Batch) -> None:
    assert len(any_batch.modes) == len(set(any_batch.modes)) == 4**3
    assert {len(mode) for mode in any_batch.modes} == {3}


def test_best_mode_is_the_one_that_gives_the_objective(any_batch: Batch) -> None:
    found = any_batch.evaluate(PAPER)
    mode = any_batch.modes[int(found.mode[0])]
    out = [arm_outputs(any_batch.stage, k, PAPER, (*mode[k], "noflip")) for k in range(3)]
    w, gram = (np.array([o[i][:, 0] for o in out]) for i in (1, 2))
    beta_1, beta_2 = (gram[0] ** -0.5 + gram[1] ** -0.5) / 2, gram[2] ** -0.5
    assert found.objective[0] == pytest.approx(np.mean((beta_1 * w[0] * w[1] + beta_2 * w[2]) / (beta_1 + beta_2)))


def test_singularity_is_missed_by_the_share_of_the_level_that_lacks(cell: Cell) -> None:
    strict = Batch(cell.with_(constraints={"singularity_floor_m3": 0.2}))
    assert strict.evaluate(PAPER).violation[0] == pytest.approx([0, 0, 1 - 0.123421 / 0.2008, 0], abs=1e-5)


def test_clearance_is_missed_in_tenths_of_a_metre(cell: Cell) -> None:
    strict = Batch(cell.with_(constraints={"clearance_m": 0.04}))
    assert strict.evaluate(PAPER).violation[0] == pytest.approx([0, 0, 0, (0.0405 - 0.0244) / 0.1], abs=1e-3)


def test_joint_limit_is_missed_in_half_turns(cell: Cell) -> None:
    strict = Batch(cell.with_(constraints={"joint_margin_deg": 60.0}))
    more = Batch(cell.with_(constraints={"joint_margin_deg": 69.0}))
    first, second = (b.evaluate(PAPER).violation[0, 1] for b in (strict, more))
    assert first > 0.0
    assert second - first == pytest.approx(9 / 180, abs=1e-12)


def test_reach_is_missed_by_the_worst_arms_squared_sine(batch: Batch) -> None:
    at = np.array([0.0, 0.0, 2.0])
    reach = min(arm_outputs(batch.stage, k, at)[3].min() for k in range(3))
    assert batch.evaluate(at).violation[0, 0] == pytest.approx(-reach, rel=1e-12)
