"""The robust form: graphs with errors against moved cells, the worst over scenarios, and its relaxation."""

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.cell.uncertainty import Scenario, samples, vertices
from nlpweld.errors import OptionError
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.formulation.reduced import reduced
from nlpweld.formulation.robust import SoftWorst, robust
from nlpweld.formulation.set_up import with_errors
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.manipulability import magnitude
from nlpweld.solvers import Budget, make_solver

from .helpers import PAPER

BOX = {"placement_m": (0.002,) * 3, "placement_deg": 0.5, "base_m": (0.001,) * 3, "base_deg": 0.1, "source": "a test"}
FEW = {"placement_m": (0.0, 0.0, 0.004), "base_m": (0.0, 0.001, 0.0), "source": "a test"}
NONE = {"placement_m": (0.0, 0.0, 0.0), "source": "a test"}
STEPS = 10.0 ** np.arange(-2, -4.1, -0.5)
STANDS = np.array([[0.0, -1.2], [0.3, -1.0], [-0.2, -1.3], [0.9, -1.5]])


def three(box: dict[str, object]) -> Cell:
    return load_cell("three_er16").with_(seam={"points": 18}, uncertainty=box)


def single(box: dict[str, object], **configuration: object) -> Cell:
    return load_cell("robot_positioner").with_(seam={"points": 18}, uncertainty=box, configuration=configuration)


def placements(cell: Cell) -> np.ndarray:
    """Return placements near and far, shape (m, d)."""
    if cell.positioner:
        return STANDS
    return PAPER + np.random.default_rng(8).uniform(-0.05, 0.05, (12, 3)) * np.linspace(0, 4, 12)[:, None]


def moved(cell: Cell, scenario: Scenario) -> Cell:
    """Return the cell with its bases and its placement frame moved, as a file would state it; all coordinates shift."""
    data = cell.model_dump(mode="python", exclude_unset=True)
    for station, error in zip(data["stations"], scenario.bases, strict=True):
        roll, pitch, yaw = station.get("base_rpy_deg", (0.0, 0.0, 0.0))
        station["base_position_m"] = tuple(float(v) for v in np.add(station["base_position_m"], error[:3]))
        station["base_rpy_deg"] = (roll, pitch, yaw + float(np.degrees(error[3])))
        station["source"] = "moved"
    for name in ("lower_m", "upper_m"):
        data["search"][name] = tuple(float(v) for v in np.add(data["search"][name], scenario.placement[:3]))
    yaw = float(np.degrees(scenario.placement[3]))
    data["search"] |= {"yaw_deg": (yaw, yaw), "source": "moved"}
    return Cell.model_validate(data)


@pytest.mark.parametrize("make", [three, single], ids=["carried", "positioner"])
def test_graphs_with_errors_are_those_of_the_moved_cell(make) -> None:
    cell = make(BOX)
    X, batch = placements(cell), Batch(cell, "numpy", errors=True)
    free = [("x_m", "y_m", "z_m").index(name) for name in cell.variables]
    for scenario in samples(cell, 3, 2):
        data = with_errors(point_data(cell, seam_parameters(cell)), scenario)
        got = batch.evaluator.at(data).evaluate(X)
        want = Batch(moved(cell, scenario), "numpy").evaluate(X + scenario.placement[free])
        assert np.isfinite(want.objective).any()
        assert got.objective == pytest.approx(want.objective, abs=1e-12)
        assert got.violation == pytest.approx(want.violation, abs=1e-12)


def test_worst_is_the_least_objective_and_the_greatest_violation_of_all_scenarios() -> None:
    cell = three(FEW)
    X, found = placements(cell), robust(cell, "numpy").evaluate(placements(cell))
    each = [Batch(moved(cell, s), "numpy").evaluate(X + s.placement[:3]) for s in vertices(cell)]
    near = np.isfinite(each[0].objective)
    assert 0 < near.sum() < len(X)
    assert found.objective[near] == pytest.approx(np.min([e.objective for e in each], axis=0)[near], abs=1e-12)
    assert found.violation[near] == pytest.approx(np.max([e.violation for e in each], axis=0)[near], abs=1e-12)
    assert (found.violation[~near] == each[0].violation[~near]).all()
    assert (found.objective[near] < each[0].objective[near]).all()


@pytest.mark.parametrize("engine", ["numpy", "numba"])
def test_engines_agree_and_all_scenarios_share_the_mode_of_the_stated_cell(engine: str) -> None:
    if engine == "numba":
        pytest.importorskip("numba")
    cell = single(BOX, shoulder="any", elbow="any")
    batch = Batch(cell, engine, errors=True)
    stated, data = batch.evaluate(STANDS), with_errors(batch.points[:-10], samples(cell, 1, 3)[0])
    for mode in range(len(batch.modes)):
        alone = batch.evaluator.at(data, mode).evaluate(STANDS)
        assert (alone.mode == mode).all()
        shoulder, elbow = batch.modes[mode][0]
        own = Batch(single(BOX, shoulder=shoulder, elbow=elbow), "numpy", errors=True).evaluator.at(data)
        assert alone.objective == pytest.approx(own.evaluate(STANDS).objective, abs=1e-12)
        assert alone.violation == pytest.approx(own.evaluate(STANDS).violation, abs=1e-12)
    assert (robust(cell, engine).evaluate(STANDS).mode == stated.mode).all()


def test_errors_of_zero_leave_every_answer_as_it_is() -> None:
    plain, same, X = reduced(single(NONE), "numpy"), robust(single(NONE), "numpy"), STANDS
    a, b = plain.evaluate(X), same.evaluate(X)
    assert (a.objective == b.objective).all()
    assert (a.violation == b.violation).all()
    p, q = plain.relax(0, True), same.relax(0, True)
    for x in X[:2]:
        for part in ("value", "gradient", "hessian"):
            one, other = (np.array(getattr(r, part)(x, 50.0)).ravel() for r in (p, q))
            assert one == pytest.approx(other, rel=1e-9, abs=1e-9)
    one, other = (make_solver("ipopt", scouts=32).solve(f, seed=0, budget=Budget()) for f in (plain, same))
    assert one.status == other.status == "SOLVED"
    assert one.x == pytest.approx(other.x, abs=1e-6)
    assert one.objective == pytest.approx(other.objective, abs=1e-9)


@pytest.fixture(scope="module")
def nlp() -> Nlp:
    return robust(single(BOX), "numpy")


@pytest.fixture(scope="module")
def relaxation(nlp: Nlp) -> Relaxation:
    return nlp.relax(0, True)


@pytest.mark.parametrize("x", [STANDS[0], np.array([0.75, -0.85])], ids=["feasible", "infeasible"])
def test_combined_derivatives_leave_errors_of_second_and_third_order(relaxation: Relaxation, x: np.ndarray) -> None:
    sharpness = 20.0
    value, gradient, H = (np.array(getattr(relaxation, p)(x, sharpness)) for p in ("value", "gradient", "hessian"))
    d = np.random.default_rng(40).normal(size=(2, 2))
    for u in d / np.linalg.norm(d, axis=1, keepdims=True):
        there = np.array([float(relaxation.value(x + h * u, sharpness)) for h in STEPS])
        first = np.abs(there - value.item() - STEPS * (gradient.ravel() @ u))
        second = np.abs(there - value.item() - STEPS * (gradient.ravel() @ u) - STEPS**2 / 2 * (u @ H @ u))
        slopes = [np.polyfit(np.log(STEPS), np.log(errors), 1)[0] for errors in (first, second)]
        assert slopes[0] > 1.85
        assert slopes[1] > 2.7


def test_soft_worst_of_known_losses() -> None:
    """Two scenarios of one point: losses x^2 and 1 - x, without penalties."""

    def lanes(z: np.ndarray, p: float, slopes: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        x = z[0, 0]
        return np.array([x * x, 1 - x]), np.array([[2 * x, -1.0]]), np.array([[[2.0, 0.0]]])

    def nothing(z: np.ndarray, p: float, slopes: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return np.zeros(2), np.zeros((1, 2)), np.zeros((1, 1, 2))

    worst = SoftWorst(lanes, nothing, (2, 1))
    x, p, h = np.array([0.55]), 7.0, 1e-5
    assert worst.value(x, 1e4) == pytest.approx(0.45, abs=1e-4)
    assert worst.value(x, p) == pytest.approx(np.log(np.exp(p * 0.3025) + np.exp(p * 0.45)) / p, rel=1e-12)
    g, H = worst.slopes(x, p)
    assert g[0] == pytest.approx((worst.value(x + h, p) - worst.value(x - h, p)) / (2 * h), rel=1e-6)
    assert H[0, 0] == pytest.approx((worst.slopes(x + h, p)[0] - worst.slopes(x - h, p)[0])[0] / (2 * h), rel=1e-6)


def test_relaxation_tends_to_the_worst_objective_at_a_robustly_feasible_point(nlp: Nlp, relaxation: Relaxation) -> None:
    x = STANDS[0]
    found, unit = nlp.evaluate(x), magnitude("product", [False])
    assert found.feasible[0]
    errors = [float(relaxation.value(x, p)) + found.objective[0] / unit for p in (1e2, 1e3, 1e4, 1e6)]
    assert min(errors) > -1e-12
    assert errors[-1] < 1e-5


def test_a_cell_without_errors_is_refused_by_name() -> None:
    with pytest.raises(OptionError, match=r"no \[uncertainty\] table"):
        robust(load_cell("three_er16"))
