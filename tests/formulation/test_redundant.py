"""The redundant form: nothing is lost where nothing is free, derivatives, bounds on joint steps, and what it gains."""

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.errors import OptionError
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.freedom import LEVELS, free_angles
from nlpweld.formulation.redundant import Redundant, redundant
from nlpweld.formulation.splines import basis
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.geometry.weld_angles import weld_angles, weld_rotations
from nlpweld.solvers import Budget, make_solver
from nlpweld.verify import verify

PAPER = np.array([0.023, -0.266, 0.404])
CELLS = ("three_er16", "dual_welder_positioner", "robot_positioner")


def form(cell: Cell, level: str, engine: str = "numpy", controls: int = 8) -> Redundant:
    return Redundant(Batch(cell, engine), level, controls)


def wiggled(coding, x: np.ndarray, seed: int = 1, size: float = 0.05) -> np.ndarray:
    """Return variables with small random paths about a placement."""
    z = coding.constant(x[None], np.zeros((1, len(coding.angles))))[0]
    z[len(x) :] += size * np.random.default_rng(seed).uniform(-1, 1, len(z) - len(x))
    return z


@pytest.mark.parametrize("closed", [True, False])
def test_splines_sum_to_one_and_bend_smoothly(closed: bool) -> None:
    s = np.linspace(0, 1, 401, endpoint=not closed)
    B = basis(s, 9, closed)
    assert B.sum(axis=1) == pytest.approx(np.ones(401), abs=1e-12)
    assert B.min() >= 0.0
    path = B @ np.random.default_rng(0).normal(size=9)
    ends = np.append(path, path[0]) if closed else path
    assert np.abs(np.diff(ends, 2)).max() < 2e-3
    if not closed:
        assert B[[0, -1], [0, -1]] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("level", LEVELS)
def test_nominal_angles_give_the_reduced_form(name: str, level: str) -> None:
    cell = load_cell(name)
    own, x = form(cell, level), cell.coordinates(np.array(next(iter(cell.placements.values()))))
    nominal = own.evaluate(own.coding.constant(x[None], np.zeros((1, len(own.names)))))
    plain = own.batch.evaluate(x)
    assert nominal.objective == pytest.approx(plain.objective, rel=1e-12)
    assert nominal.violation[:, :4] == pytest.approx(plain.violation, abs=1e-12)


@pytest.mark.parametrize("name", CELLS)
def test_engines_agree_where_angles_are_free(name: str) -> None:
    pytest.importorskip("numba")
    cell = load_cell(name)
    x = cell.coordinates(np.array(next(iter(cell.placements.values()))))
    ours, theirs = (form(cell, "spin_yaw_tilt", engine) for engine in ("numpy", "numba"))
    Z = np.array([wiggled(ours.coding, x, seed, size) for seed, size in ((1, 0.02), (2, 0.05), (3, 0.1))])
    a, b = ours.evaluate(Z), theirs.evaluate(Z)
    assert a.objective == pytest.approx(b.objective, rel=1e-12)
    assert a.violation == pytest.approx(b.violation, abs=1e-12)


def test_slope_rotation_and_yaw_are_those_of_the_weld(cell: Cell) -> None:
    own = form(cell, "spin_yaw_tilt")
    offsets = np.radians([20.0, 30.0, 4.0, -7.0])  # spin, yaw, slope, rotation
    assert own.names == ("spin.welder", "yaw", "slope", "rotation")
    _, points = own.points(own.coding.constant(PAPER[None], offsets[None])[0])
    ends = own.stage.work.map(72)(np.tile(PAPER[:, None], 72), points)
    axis = np.array(ends)[:, 1::4] - np.array(ends)[:, 0::4]  # of the main pipe, along x_C
    branch = np.array(ends)[:, 3::4] - np.array(ends)[:, 2::4]  # along z_C
    x, z = (v / np.linalg.norm(v, axis=0) for v in (axis, branch))
    R_W_C = np.stack([x, np.cross(z.T, x.T).T, z], axis=1).transpose(2, 0, 1)
    seam = weld_rotations(weld_frames(cell, seam_parameters(cell)))
    nominal = weld_angles(own.data[:9].T.reshape(-1, 3, 3).transpose(0, 2, 1) @ seam)
    slope, rotation, deviation = weld_angles(R_W_C @ seam)
    assert slope == pytest.approx(np.full(72, offsets[2]), abs=1e-9)
    assert rotation == pytest.approx(np.full(72, np.pi / 2 + offsets[3]), abs=1e-9)
    turned = (deviation - nominal[2] - offsets[1] + np.pi) % (2 * np.pi) - np.pi
    assert turned == pytest.approx(np.zeros(72), abs=1e-9)


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("engine", ["numpy", "numba"])
def test_gradient_and_hessian_by_taylors_slope(name: str, engine: str) -> None:
    if engine == "numba":
        pytest.importorskip("numba")
    cell = load_cell(name).with_(seam={"points": 12}, **_other_points(name, 12))
    own = form(cell, "spin_yaw_tilt", engine, controls=5)
    x = cell.coordinates(np.array(next(iter(cell.placements.values()))))
    relaxed, z = own.relax(0, True), wiggled(own.coding, x)
    value, gradient, hessian = (np.array(getattr(relaxed, part)(z, 20.0)) for part in ("value", "gradient", "hessian"))
    d = np.random.default_rng(5).normal(size=len(z))
    d /= np.linalg.norm(d)
    steps = 10.0 ** np.arange(-2.0, -3.6, -0.5)
    first = [float(relaxed.value(z + h * d, 20.0) - value.item() - h * d @ gradient.ravel()) for h in steps]
    second = [e - h * h / 2 * d @ hessian @ d for e, h in zip(first, steps, strict=True)]
    assert np.polyfit(np.log(steps), np.log(np.abs(first)), 1)[0] > 1.85
    assert np.polyfit(np.log(steps), np.log(np.abs(second)), 1)[0] > 2.6
    assert hessian == pytest.approx(hessian.T, abs=1e-9 * np.abs(hessian).max())


def _other_points(name: str, points: int) -> dict:
    if name != "dual_welder_positioner":
        return {}
    second = load_cell(name).other_seams["second"].model_dump(exclude_unset=True)
    return {"other_seams": {"second": {**second, "points": points}}}


def test_joint_steps_beyond_the_bound_count_in_half_turns(cell: Cell) -> None:
    tight, loose = (form(cell.with_(freedom={"joint_step_deg": step}), "spin") for step in (2.0, 170.0))
    z = tight.coding.constant(PAPER[None], np.zeros((1, 1)))
    missed = tight.evaluate(z).violation[0, 4]
    assert loose.evaluate(z).violation[0, 4] == 0.0
    steps = [np.abs(np.diff(np.vstack([q, q[:1]]), axis=0)) for q in loose.unpack(z[0], 0).paths.values()]
    longest = max(float(np.minimum(step, 2 * np.pi - step).max()) for step in steps)
    assert missed == pytest.approx((longest - np.radians(2.0 - 0.05)) / np.pi, abs=1e-9)


def test_starts_keep_their_angles_along_the_seam_and_differ_by_seed(cell: Cell) -> None:
    own = form(cell, "spin_yaw_tilt")
    Z = own.starts(3, 16)
    lower, upper = own.coding.bounds
    assert ((lower <= Z) & (upper >= Z)).all()
    _, angles = own.coding.decode(Z[5])
    assert np.ptp(angles, axis=1) == pytest.approx(np.zeros(4), abs=1e-12)
    assert angles[2:] == pytest.approx(np.zeros((2, 72)))
    assert (own.starts(3, 16) == Z).all()
    assert (own.starts(4, 16) != Z).any()


def test_positioner_leaves_no_yaw_and_torches_tilt_besides() -> None:
    cell = load_cell("dual_welder_positioner")
    assert [a.name for a in free_angles(cell, "spin_yaw")] == ["spin.robot_1", "spin.robot_2"]
    assert [a.name for a in free_angles(cell, "spin_yaw_tilt")][2:] == [
        "slope",
        "rotation",
        "travel.robot_1",
        "travel.robot_2",
        "work.robot_1",
        "work.robot_2",
    ]


def test_tilt_on_a_positioner_gains_over_the_best_without() -> None:
    """Without slope and rotation the best is 0.6097."""
    coarse = load_cell("robot_positioner").with_(seam={"points": 18}, freedom={"joint_step_deg": 60.0})
    nlp = redundant(coarse, "numpy", controls=6)
    found = make_solver("ipopt").solve(nlp, seed=0, budget=Budget())
    assert found.status == "SOLVED"
    assert found.objective > 1.02 * 0.6097
    assert verify(nlp.unpack(found.x, found.mode)).feasible


def test_cell_without_freedom_and_unknown_level_are_named(cell: Cell) -> None:
    with pytest.raises(OptionError, match=r"no \[freedom\] table"):
        redundant(cell.model_copy(update={"freedom": None}))
    with pytest.raises(OptionError, match="spin, spin_yaw, spin_yaw_tilt"):
        free_angles(cell, "tilt")


def test_spin_alone_gains_more_than_forty_percent_at_the_points(cell: Cell) -> None:
    nlp = redundant(cell, level="spin")
    found = make_solver("ipopt").solve(nlp, seed=3, budget=Budget())
    assert found.status == "SOLVED"
    assert found.objective > 1.40 * 0.29666
