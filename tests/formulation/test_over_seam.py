"""Mean, minimum and soft minimum over the seam: by hand, engines, derivatives, and optima found in different ways."""

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.cell.levels import Objective
from nlpweld.formulation import candidate
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.full import Full, full, full_start
from nlpweld.formulation.fused import OVER_SEAM
from nlpweld.formulation.inner import best, lattice
from nlpweld.formulation.nlp import Nlp, Relaxation, sobol
from nlpweld.formulation.over_seam import Worth, over_seam, smooth
from nlpweld.formulation.reduced import reduced
from nlpweld.formulation.redundant import Redundant
from nlpweld.solvers import Budget, Outcome, make_solver

from .helpers import PAPER

OVER = {
    "minimum": {"over_seam": "minimum"},
    "soft_minimum": {"over_seam": "soft_minimum", "exponent": 8.0},
}
ENGINES = ["numpy", "numba"]
STEPS = 10.0 ** np.arange(-2.0, -3.6, -0.5)
VALUES = np.array([0.2, 0.3, 0.25, 0.8])


def objective(over: str) -> Objective:
    return Objective(reading="paper", source="test", **OVER.get(over, {}))


def asked(name: str, over: str, points: int = 18) -> Cell:
    """Return a cell with a coarse seam and an objective over it."""
    return load_cell(name).with_(seam={"points": points}, objective=OVER.get(over, {}))


def solved(nlp: Nlp, solver: str, preset: str = "default") -> Outcome:
    return make_solver(solver, preset).solve(nlp, seed=0, budget=Budget())


def assert_slopes(relaxed: Relaxation, z: np.ndarray, d: np.ndarray, sharpness: float = 20.0) -> None:
    """Hold gradient and Hessian against values along a direction."""
    value, gradient, hessian = (
        np.array(getattr(relaxed, part)(z, sharpness)) for part in ("value", "gradient", "hessian")
    )
    first = [float(relaxed.value(z + h * d, sharpness) - value.item() - h * d @ gradient.ravel()) for h in STEPS]
    second = [e - h * h / 2 * d @ hessian @ d for e, h in zip(first, STEPS, strict=True)]
    assert np.polyfit(np.log(STEPS), np.log(np.abs(first)), 1)[0] > 1.85  # one, were the gradient wrong
    assert np.polyfit(np.log(STEPS), np.log(np.abs(second)), 1)[0] > 2.6  # two, were the Hessian wrong
    assert hessian == pytest.approx(hessian.T, abs=1e-9 * np.abs(hessian).max())


def test_values_along_the_seam_by_hand() -> None:
    assert over_seam(objective("mean"), VALUES) == pytest.approx(0.3875)
    assert over_seam(objective("minimum"), VALUES) == 0.2
    harmonic = Objective(reading="paper", source="test", over_seam="soft_minimum", exponent=1.0)
    assert over_seam(harmonic, VALUES) == pytest.approx(4 / (1 / 0.2 + 1 / 0.3 + 1 / 0.25 + 1 / 0.8))
    assert over_seam(objective("soft_minimum"), 3 * VALUES) == pytest.approx(
        3 * over_seam(objective("soft_minimum"), VALUES)
    )
    hard = Objective(reading="paper", source="test", over_seam="soft_minimum", exponent=2000.0)
    assert over_seam(hard, VALUES) == pytest.approx(0.2, rel=1e-3)


def test_a_value_of_zero_is_the_least_and_one_that_is_none_spoils_all() -> None:
    rows = np.array([[0.0, 0.3], [np.nan, 0.3], [np.inf, 0.3]])
    for over in OVER:
        assert over_seam(objective(over), rows)[0] == 0.0
        assert np.isnan(over_seam(objective(over), rows)[1:]).all()


@pytest.mark.parametrize("over", OVER)
def test_weights_are_the_derivatives(over: str) -> None:
    found, h = smooth(objective(over), VALUES, 25.0), 1e-6
    shifted = [[smooth(objective(over), VALUES + s * h * e, 25.0) for e in np.eye(4)] for s in (1, -1)]
    slope = [(a.value - b.value) / (2 * h) for a, b in zip(*shifted, strict=True)]
    hessian = [(a.slope - b.slope) / (2 * h) for a, b in zip(*shifted, strict=True)]
    assert found.slope == pytest.approx(np.array(slope), abs=1e-8)
    whole = found.shared * np.outer(found.slope, found.slope) - np.diag(found.bend)
    assert whole == pytest.approx(np.array(hessian), abs=1e-7)
    assert np.linalg.eigvalsh(whole).max() < 1e-9  # concave


def test_log_sum_exp_falls_from_the_mean_to_the_minimum_as_it_sharpens() -> None:
    found = [smooth(objective("minimum"), VALUES, sharpness).value for sharpness in (1e-6, 1e1, 1e3, 1e6)]
    assert found[0] == pytest.approx(VALUES.mean(), abs=1e-6)
    assert (np.diff(found) < 0).all()
    assert 0.0 < found[-1] - 0.2 < 2e-6


@pytest.mark.parametrize("over", OVER)
def test_loops_of_the_compiled_engine_are_the_same(over: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("N", 4), ("EXPONENT", OVER[over].get("exponent"))):
        monkeypatch.setattr(candidate, name, value, raising=False)
    monkeypatch.setattr(candidate, "least", np.min)
    loop = OVER_SEAM[over][-1]
    assert loop(VALUES) == pytest.approx(over_seam(objective(over), VALUES), rel=1e-14)
    assert loop(np.append(VALUES[:3], 0.0)) == 0.0
    assert not np.isfinite([loop(np.append(VALUES[:3], bad)) for bad in (np.nan, np.inf)]).any()


def test_engines_agree() -> None:
    pytest.importorskip("numba")
    cell = asked("robot_positioner", "soft_minimum")
    X = sobol(*cell.box, 3, 256)
    ours, theirs = (Batch(cell, engine).evaluate(X) for engine in ENGINES)
    seen = np.isfinite(ours.objective)
    assert 5 < seen.sum() < 256
    assert (np.isfinite(theirs.objective) == seen).all()
    assert ours.objective[seen] == pytest.approx(theirs.objective[seen], rel=1e-12)
    plain = Batch(asked("robot_positioner", "mean"), "numpy").evaluate(X).objective[seen]
    assert (ours.objective[seen] < plain).all()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("over", ["mean", *OVER])
def test_reduced_derivatives_by_taylors_slope(over: str, engine: str) -> None:
    if engine == "numba":
        pytest.importorskip("numba")
    d = np.random.default_rng(40).normal(size=3)
    assert_slopes(reduced(asked("three_er16", over), engine).relax(0, True), PAPER, d / np.linalg.norm(d))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("over", OVER)
def test_redundant_derivatives_by_taylors_slope(over: str, engine: str) -> None:
    if engine == "numba":
        pytest.importorskip("numba")
    form = Redundant(Batch(asked("robot_positioner", over, 12), engine), "spin_yaw_tilt", 5)
    rng = np.random.default_rng(5)
    z = form.coding.constant(np.array([[0.0, -1.0]]), np.zeros((1, len(form.names))))[0]
    z[2:] += 0.05 * rng.uniform(-1, 1, len(z) - 2)
    d = rng.normal(size=len(z))
    assert_slopes(form.relax(0, True), z, d / np.linalg.norm(d))


@pytest.mark.parametrize("over", OVER)
def test_relaxation_tends_to_minus_the_exact_objective(over: str) -> None:
    cell, x = asked("robot_positioner", over), np.array([0.0, -1.0])
    exact, relaxed = Batch(cell, "numpy").evaluate(x), reduced(cell, "numpy").relax(0, True)
    assert exact.feasible[0]
    assert float(relaxed.value(x, 1e6)) == pytest.approx(-exact.objective[0], abs=1e-5)


@pytest.mark.parametrize("over", OVER)
@pytest.mark.parametrize("name", ["three_er16", "robot_positioner"])
def test_ipopt_finds_what_the_genetic_algorithm_and_a_dense_sample_find(name: str, over: str) -> None:
    nlp = reduced(asked(name, over), "numpy")
    found, other = solved(nlp, "ipopt"), solved(nlp, "ga")
    assert found.status == other.status == "SOLVED"
    assert 0.997 * found.objective < other.objective <= found.objective * (1 + 1e-4)
    half = 0.05 * (nlp.upper - nlp.lower)
    low, high = np.maximum(found.x - half, nlp.lower), np.minimum(found.x + half, nlp.upper)
    near = nlp.evaluate(sobol(low, high, 1, 4096))
    densest = near.objective[near.feasible].max()
    assert 0.99 * found.objective < densest <= found.objective * (1 + 1e-4)


@pytest.mark.parametrize("over", OVER)
def test_full_space_finds_the_same_by_a_level_that_points_share(over: str) -> None:
    cell = asked("robot_positioner", over)
    small, large = reduced(cell, "numpy"), full(cell, "numpy")
    ours, theirs = solved(small, "ipopt"), solved(large, "ipopt", "full")
    assert theirs.status == "SOLVED"
    assert theirs.objective == pytest.approx(ours.objective, rel=2e-4)
    assert large.names[2] == "level"
    assert theirs.x[2] == pytest.approx(theirs.objective, rel=3e-3)


@pytest.mark.parametrize("over", OVER)
def test_full_space_derivatives_by_taylors_slope(over: str) -> None:
    cell = asked("robot_positioner", over, 8)
    z = full_start(reduced(cell, "numpy").unpack(np.array([0.0, -1.0]), 0))
    d = np.random.default_rng(2).normal(size=len(z))
    relaxed, sharpness = full(cell, "numpy").relax(0, True), 20.0
    assert_slopes(relaxed, z, d / np.linalg.norm(d), sharpness)
    if over == "soft_minimum":  # at its own value the level takes nothing off
        form = Full(Batch(cell, "numpy"))
        exact = form.evaluate(z[None]).objective[0]
        assert float(relaxed.value(z, 1e6)) == pytest.approx(-exact, abs=1e-6)
        assert np.array(relaxed.gradient(z, 1e6)).ravel()[2] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("over", ["mean", *OVER])
def test_best_paths_on_a_grid_are_worth_what_the_exact_model_says(over: str) -> None:
    form = Redundant(Batch(asked("robot_positioner", over), "numpy"), "spin", 6)
    states = lattice(form, {form.names[0]: np.radians(np.arange(-180, 180, 15.0))})
    found = best(states, np.array([0.0, -1.0]))
    assert found.holds
    judged = states.judged(found.x, np.array(list(found.angles.values())))
    assert found.value == pytest.approx(judged.objective[0], rel=1e-9)
    for other in {"mean", *OVER} - {over}:  # the best by another objective is no better by this one
        p = {"mean": 1e-3, "minimum": 200.0, "soft_minimum": 8.0}[other]
        theirs = best(states, found.x, exponent=p)
        paths = np.array(list(theirs.angles.values()))
        assert states.judged(found.x, paths).objective[0] <= found.value * (1 + 1e-9)


def test_worth_of_a_path_is_its_power_mean() -> None:
    worth = Worth(8.0, 1.0)
    total = worth.summands(VALUES).sum()
    assert worth.value(total, 4) == pytest.approx(over_seam(objective("soft_minimum"), VALUES))
    assert worth.summands(np.array([-np.inf, 0.0])).tolist() == [-np.inf, -1e300]
