"""Bases as variables: the same physics as a cell whose bases stand there, its symmetries, and its derivatives."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.bench.answer import FORMULATIONS, solve
from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.coupling import base_frame
from nlpweld.formulation.full import full_start
from nlpweld.formulation.nlp import Relaxation
from nlpweld.formulation.reduced import reduced
from nlpweld.formulation.smooth import relaxation
from nlpweld.formulation.stage import Stage
from nlpweld.kinematics.chain import rpy_pose
from nlpweld.plan import Plan, load_plan
from nlpweld.verify import verify

from .helpers import PAPER
from .test_smooth import models, slope

STEPS = 10.0 ** np.arange(-2, -4.1, -0.5)
WIDE, TURN = (-3.0, 3.0), (-180.0, 180.0)
Table = dict[str, tuple[float, float]]


def laid_open(cell: Cell, tables: dict[str, Table]) -> Cell:
    """Return a cell with the bases of named robots free, and a yaw of the placement where it is asked for."""
    data = cell.model_dump(mode="python", exclude_unset=True)
    for station in data["stations"]:
        if station["name"] in tables:
            station["layout"] = {**tables[station["name"]], "source": "test"}
    return Cell.model_validate(data)


def all_open(cell: Cell) -> Cell:
    """Return a cell with everything free."""
    free = {"x_m": WIDE, "y_m": WIDE, "yaw_deg": TURN}
    return laid_open(cell, {s.name: free for s in cell.stations}).with_(search={"yaw_deg": TURN})


@pytest.fixture(scope="module")
def coarse() -> Cell:
    return load_cell("three_er16").with_(seam={"points": 18})


@pytest.fixture(scope="module")
def free(coarse: Cell) -> Cell:
    return all_open(coarse)


@pytest.fixture(scope="module")
def single() -> Cell:
    return load_cell("robot_positioner").with_(seam={"points": 18})


def near(cell: Cell, m: int, seed: int) -> np.ndarray:
    """Return candidates about the paper's placement with bases and turns about their own, shape (m, d)."""
    rng = np.random.default_rng(seed)
    x = cell.coordinates(np.array([*PAPER, 0.0]))
    return x + rng.uniform(-0.1, 0.1, (m, len(x)))


def held(cell: Cell) -> Cell:
    """Return a cell with no layout."""
    stations = tuple(station.model_copy(update={"layout": None}) for station in cell.stations)
    return cell.model_copy(update={"stations": stations})


def test_moved_bases_are_judged_as_a_cell_that_has_them_there(free: Cell) -> None:
    free = free.with_(constraints={"clearance_m": 0.1})  # which some candidates miss
    X = near(free, 60, 1)
    found, seen = Batch(free, "numpy").evaluate(X), 0
    looked = np.flatnonzero(np.isfinite(found.objective))
    order = looked[found.violation[looked, 3].argsort()]
    assert found.violation[order[-1], 3] > 0.0
    for i in [0, *order[:2], *order[-3:]]:
        there = held(free.laid_out(X[i]))
        apart = Batch(there, "numpy").evaluate(there.coordinates(free.placement(X[i])))
        assert apart.objective[0] == pytest.approx(found.objective[i], rel=1e-12)
        assert apart.violation[0] == pytest.approx(found.violation[i], abs=1e-12)
        seen += bool(np.isfinite(found.objective[i]))
    assert seen >= 3


def test_base_that_leans_is_turned_about_the_vertical(coarse: Cell) -> None:
    stations = [
        station.model_copy(update={"base_rpy_deg": (10.0, 20.0, 30.0), "source": "test"}) for station in coarse.stations
    ]
    cell = laid_open(
        coarse.model_copy(update={"stations": tuple(stations)}), {"welder": {"y_m": WIDE, "yaw_deg": TURN}}
    )
    x = ca.DM([0.0, -0.2, 0.4, 0.7, np.radians(-50.0)])
    T = base_frame(cell, 2, ca.SX(x))
    expected = rpy_pose((0.0, 0.7, 0.0), (10.0, 20.0, -50.0))
    assert np.array(ca.DM(T.R)) == pytest.approx(expected[:3, :3], abs=1e-15)
    assert np.array(ca.DM(T.p)).ravel() == pytest.approx(expected[:3, 3], abs=1e-15)
    assert np.array(ca.DM(base_frame(cell, 0, ca.SX(x)).p)).ravel().tolist() == [1.0, -1.0, 0.05]


def test_shifting_everything_alike_changes_nothing(free: Cell) -> None:
    X, by = near(free, 60, 2), np.zeros(len(free.variables))
    for axis, shift in (("x_m", 0.37), ("y_m", -0.21)):
        by[[i for i, name in enumerate(free.variables) if name.split(".")[-1] == axis]] = shift
    batch = Batch(free, "numpy")
    here, there = batch.evaluate(X), batch.evaluate(X + by)
    assert here.feasible.sum() > 5
    assert there.objective == pytest.approx(here.objective, rel=1e-10)
    assert there.violation == pytest.approx(here.violation, abs=1e-10)


def turned(cell: Cell, X: np.ndarray, yaw: float) -> np.ndarray:
    """Return candidates with placement and bases turned about z_W, shape (m, d)."""
    c, s = np.cos(yaw), np.sin(yaw)
    out, columns = X.copy(), {name: i for i, name in enumerate(cell.variables)}
    for owner in ("", *(f"{station.name}." for station in cell.stations)):
        xy = [columns[f"{owner}x_m"], columns[f"{owner}y_m"]]
        out[:, xy] = X[:, xy] @ np.array([[c, s], [-s, c]])
        out[:, columns[f"{owner}yaw_rad"]] += yaw
    return out


def headed(cell: Cell, by_deg: float) -> Cell:
    """Return a cell whose torch heads elsewhere in W."""
    welder = cell.stations[2]
    coupling = welder.coupling.model_copy(update={"heading_deg": welder.coupling.heading_deg + by_deg})
    return cell.model_copy(update={"stations": (*cell.stations[:2], welder.model_copy(update={"coupling": coupling}))})


def test_turning_everything_changes_nothing_if_the_torch_heads_along(free: Cell) -> None:
    X, yaw = near(free, 60, 3), 0.4
    here, there = Batch(free, "numpy").evaluate(X), turned(free, X, yaw)
    along = Batch(headed(free, np.degrees(yaw)), "numpy").evaluate(there)
    both = np.isfinite(here.objective)
    assert here.feasible.sum() > 5
    assert along.objective[both] == pytest.approx(here.objective[both], rel=1e-9)
    assert along.violation == pytest.approx(here.violation, abs=1e-9)
    stays = Batch(free, "numpy").evaluate(there).objective  # a heading fixed in W is no part of the symmetry
    assert np.abs(stays[both] - here.objective[both]).max() > 1e-3


def test_yaw_of_a_base_is_taken_up_by_joint_1(coarse: Cell) -> None:
    cell = laid_open(coarse, {"welder": {"yaw_deg": (-30.0, 30.0)}})
    straight, twisted = (reduced(cell, "numpy").unpack(np.array([*PAPER, yaw]), 0) for yaw in (0.0, 0.3))
    off = twisted.paths["welder"] - straight.paths["welder"]
    assert np.abs(off[:, 0]) == pytest.approx(np.full(18, 0.3), abs=1e-12)
    assert np.abs(off[:, 1:]).max() < 1e-9


@pytest.fixture(scope="module")
def rails() -> Cell:
    """Two welders on rails along x, before a positioner; coarse."""
    data = load_cell("dual_welder_positioner").model_dump(mode="python", exclude_unset=True)
    data["seam"]["points"] = data["other_seams"]["second"]["points"] = 18
    return laid_open(Cell.model_validate(data), {"robot_1": {"x_m": WIDE}, "robot_2": {"x_m": WIDE}})


BEYOND = 0.19  # of either column from the middle between them: 0.02 m of overlap
MEETING = np.array([-0.8, -1.3, 0.4 + BEYOND, 0.4 - BEYOND])
APART = MEETING + np.array([0.0, 0.0, 0.02, -0.02])


@pytest.mark.parametrize("engine", ["numpy", "numba"])
def test_columns_that_meet_miss_the_clearance_by_their_overlap(rails: Cell, engine: str) -> None:
    if engine == "numba":
        pytest.importorskip("numba")
    found = Batch(rails, engine).evaluate(np.array([MEETING, APART]))
    level = rails.constraints.clearance_at_points_m
    assert found.violation[:, :3].max() == 0.0
    assert found.violation[:, 3] == pytest.approx([(level + 0.02) / 0.1, 0.0], abs=1e-5)


def test_verifier_sees_columns_that_meet_in_the_plan_alone(rails: Cell) -> None:
    plan = reduced(rails, "numpy").unpack(MEETING, 0)
    assert isinstance(plan, Plan)
    first = verify(plan).violations[0]
    assert first.constraint == "clearance"
    assert first.pair == "robot_1.base_column - robot_2.base_column"
    assert first.value == pytest.approx(-0.02, abs=1e-9)


def test_column_and_positioner_keep_their_distance(rails: Cell) -> None:
    stage, batch = Stage(rails), Batch(rails, "numpy")
    fixed = [i for i, shape in enumerate(stage.shapes[2]) if not shape.above_floor]
    pairs = [n for n, (i, j) in enumerate(stage.pairs[0, 2]) if i == 0 and j in fixed]
    point, placed = batch.points[:, 0], APART[:2]
    gaps = []
    for x in (0.0, 1.5):  # of the column, on the rail's line, while the positioner stands before it
        at = np.array([*placed, placed[0] + x, 3.0])
        ends = stage.arms[0](at, point, [1, 1, 1])[4]
        gaps.append(np.array(stage.meetings[0, 2](ends, stage.work(at, point))).ravel()[pairs])
    assert len(pairs) >= 1
    assert (gaps[1] > gaps[0] + 0.3).all()


def test_engines_judge_layouts_alike(rails: Cell) -> None:
    pytest.importorskip("numba")
    rng = np.random.default_rng(5)
    X = np.column_stack([rng.uniform([-1.0, -1.8], [1.0, -0.8], (150, 2)), rng.uniform(-0.5, 2.0, (150, 2))])
    ours, theirs = (Batch(rails, engine).evaluate(X) for engine in ("numpy", "numba"))
    assert ours.violation == pytest.approx(theirs.violation, abs=1e-12)
    assert ours.objective == pytest.approx(theirs.objective, rel=1e-12)
    assert ours.feasible.sum() > 5


@pytest.fixture(scope="module")
def smooth(free: Cell) -> Relaxation:
    return relaxation(Stage(free), (("front", "up"),) * 3)


@pytest.mark.parametrize("at", [0, 1], ids=["feasible", "infeasible"])
def test_derivatives_leave_errors_of_second_and_third_order_in_every_variable(
    free: Cell, smooth: Relaxation, at: int
) -> None:
    x = free.coordinates(np.array([*PAPER, 0.1])) + np.array([0.0, 0.3])[at] * np.eye(13)[2]
    value, gradient, hessian = models(smooth, x, 20.0)
    axes = np.vstack([np.eye(13)[4:], np.random.default_rng(6).normal(size=(2, 13)) / 4])
    for d in axes:
        truth = np.array([float(smooth.value(x + h * d, 20.0)) for h in STEPS])
        linear = value + STEPS * (gradient @ d)
        square = linear + STEPS**2 / 2 * (d @ hessian @ d)
        if np.abs(truth - value).max() < 1e-9:
            continue  # the turn of a base far from the limits of joint 1, which takes it up: flat
        assert slope(list(np.abs(truth - linear))) > 1.85
        assert slope(list(np.abs(truth - square))) > 2.7


def test_derivatives_by_jets_are_casadis(single: Cell) -> None:
    pytest.importorskip("numba")
    stage = Stage(all_open(single))
    ours, theirs = (relaxation(stage, (("front", "up"),), engine=engine) for engine in ("numba", "numpy"))
    at = np.array([0.1, -1.2, 0.05, 0.05, 0.02, -1.5])
    for mine, other in zip(models(ours, at, 50.0), models(theirs, at, 50.0), strict=True):
        assert np.array(mine) == pytest.approx(np.array(other), rel=1e-9, abs=1e-9)


def test_collapsed_bounds_give_the_answer_of_bases_that_are_held(single: Cell) -> None:
    station = single.stations[0]
    (x, y, _), yaw = station.base_position_m, station.base_rpy_deg[2]
    collapsed = laid_open(single, {station.name: {"x_m": (x, x), "y_m": (y, y), "yaw_deg": (yaw, yaw)}})
    ours, theirs = (solve(reduced(cell, "numpy"), "ipopt") for cell in (collapsed, single))
    assert ours.outcome.x == pytest.approx(theirs.outcome.x, abs=1e-9)
    assert ours.report.mmr_mean == pytest.approx(theirs.report.mmr_mean, abs=1e-9)
    assert ours.verified
    assert theirs.verified


def test_a_base_that_moves_about_a_held_work_finds_what_the_work_would(single: Cell, tmp_path) -> None:
    by_work = solve(reduced(single, "numpy"), "ipopt")
    station, found = single.stations[0], by_work.plan.placement_m
    at = np.array(next(iter(single.placements.values())))
    box = station.base[:2] + at[:2] - single.search.bounds[::-1, :2]  # mirror image of the placement's
    table = {axis: tuple(box[:, i].tolist()) for i, axis in enumerate(("x_m", "y_m"))}
    stuck = laid_open(single, {station.name: table}).with_(search={"lower_m": tuple(at), "upper_m": tuple(at)})
    by_base = solve(reduced(stuck, "numpy"), "ipopt")
    assert by_base.verified
    assert by_base.report.mmr_mean == pytest.approx(by_work.report.mmr_mean, rel=1e-5)
    assert by_base.outcome.x == pytest.approx(station.base[:2] + at[:2] - found[:2], abs=2e-3)
    assert by_base.report.mmr_mean > 1.05 * verify(reduced(single, "numpy").unpack(at[:2], 0)).mmr_mean
    kept = load_plan(by_base.plan.save(tmp_path / "plan.json"))
    assert verify(kept).feasible
    assert kept.cell.coordinates(kept.placement) == pytest.approx(by_base.outcome.x)


@pytest.mark.parametrize("formulation", ["full", "redundant_spin"])
def test_other_forms_take_a_layout(single: Cell, formulation: str) -> None:
    free = laid_open(single, {single.stations[0].name: {"x_m": WIDE}})
    form = FORMULATIONS[formulation](free, "numpy")
    plain = reduced(free, "numpy")
    x = free.coordinates(np.array(next(iter(single.placements.values())))) + np.array([0.0, 0.0, 0.05])
    z = np.concatenate([x, np.zeros(len(form.names) - len(x))])
    plan = plain.unpack(x, 0)
    if formulation == "full":
        z = full_start(plan)
    assert z[: len(x)] == pytest.approx(x, abs=1e-12)
    found, expected = form.evaluate(z), plain.evaluate(x)
    assert found.objective == pytest.approx(expected.objective, rel=1e-9)
    if formulation == "full":
        assert found.violation[0, form.constraints.index("closure")] == 0.0
    again = form.unpack(z, 0)
    assert again.cell.stations[0].base == pytest.approx(plan.cell.stations[0].base, abs=1e-12)
    assert verify(again).mmr_mean == pytest.approx(verify(plan).mmr_mean, rel=1e-9)
