"""A weld tilted on a positioner: the angles of Zhang et al. come back, bodies follow, joints keep limits and steps."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nlpweld.cell import Cell, load_cell, load_positioner
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.freedom import free_angles
from nlpweld.formulation.holder import held, posture_frames
from nlpweld.formulation.redundant import STEP_MARGIN_DEG, Redundant
from nlpweld.formulation.smooth import STEP_WEIGHT, Gaps, step_function, term_function
from nlpweld.formulation.tilting import table_data, tilted_table
from nlpweld.geometry.seam import seam_parameters
from nlpweld.geometry.weld_angles import weld_angles
from nlpweld.verify import reference as ref
from nlpweld.verify import verify

CELLS = ("dual_welder_positioner", "robot_positioner")
MANY = 10_000
BANDS = np.radians([5.0, 10.0])  # of slope and rotation


def form(cell: Cell, level: str = "spin_yaw_tilt", controls: int = 8) -> Redundant:
    return Redundant(Batch(cell, "numpy"), level, controls)


def at_place(cell: Cell) -> np.ndarray:
    return cell.coordinates(np.array(list(cell.placements.values())[-1]))


def tilted(own: Redundant, seed: int = 1, share: float = 0.9) -> np.ndarray:
    """Return variables whose tilts take a share of their bands at random control points, all else nominal."""
    z = own.coding.constant(at_place(own.cell)[None], np.zeros((1, len(own.names))))[0]
    control = z[own.coding.d :].reshape(-1, len(own.names))
    for name, band in zip(("slope", "rotation"), BANDS, strict=True):
        control[:, own.names.index(name)] = np.random.default_rng(seed).uniform(
            -share * band, share * band, len(control)
        )
        seed += 1
    return z


def with_limits(cell: Cell, joint: int, lower_deg: float, upper_deg: float) -> Cell:
    """Return a copy of a cell with other limits of one joint of its positioner."""
    joints = list(cell.positioner.robot.joints)
    joints[joint] = joints[joint].model_copy(update={"lower_deg": lower_deg, "upper_deg": upper_deg})
    robot = cell.positioner.robot.model_copy(update={"joints": tuple(joints)})
    return cell.model_copy(update={"positioner": cell.positioner.model_copy(update={"robot": robot})})


@pytest.mark.parametrize("k", [0, 1])
def test_tilted_frames_have_just_these_angles(k: int) -> None:
    """The chain is written out as Zhang et al. print it, eq. (6), and the angles are those of their definitions."""
    rng = np.random.default_rng(k)
    R_T_p = Rotation.random(MANY, rng=rng).as_matrix()
    slope, rotation = rng.uniform(-1, 1, (2, MANY)) * BANDS[:, None]
    symbols = ca.SX.sym("u", 2)
    table = tilted_table(load_cell("robot_positioner").positioner, symbols[0], symbols[1])
    graph = ca.Function("table", [symbols, *table.symbols[:2]], [table.cos, table.sin])
    columns = R_T_p.transpose(1, 0, 2).reshape(3, 3 * MANY)
    cos, sin = (
        np.array(out) for out in graph.map(MANY)(np.array([slope, rotation]), columns, np.full(MANY, 1 - 2 * k))
    )
    assert np.abs(cos**2 + sin**2 - 1).max() < 1e-14
    theta1, theta2 = np.arctan2(sin, cos)
    R_P_T = Rotation.from_euler("YXZ", np.transpose([theta1, np.full(MANY, np.pi), theta2])).as_matrix()
    found = weld_angles(R_P_T @ R_T_p)
    assert np.abs(found[0] - slope).max() < 1e-12
    assert np.abs(found[1] - np.pi / 2 - rotation).max() < 1e-12
    assert (np.sin(theta1) * (1 - 2 * k)).max() <= 1e-12


def on_dkp_400() -> Cell:
    """Return the single cell on a positioner whose DH angles are not its joints."""
    cell = load_cell("robot_positioner")
    fields = {"robot": load_positioner("dkp_400"), "may_touch": ()}
    return cell.model_copy(update={"positioner": cell.positioner.model_copy(update=fields)})


@pytest.mark.parametrize("cell", [*map(load_cell, CELLS), on_dkp_400()], ids=[*CELLS, "dkp_400"])
def test_bodies_and_path_follow_the_tilt(cell: Cell) -> None:
    """Against the verifier's kinematics: pose and angles of the weld, ends of workpiece and positioner."""
    own, s = form(cell), seam_parameters(cell)
    z = tilted(own)
    x, points = own.points(z)
    plan, place = own.unpack(z, 0), cell.placement(x)
    q = plan.paths["positioner"]
    T_W_C = ref.workpiece_pose(cell, place, s, q)
    slope, rotation, _ = weld_angles(T_W_C[:, :3, :3] @ posture_frames(cell, s))
    assert slope == pytest.approx(plan.freedom["slope"], abs=1e-12)
    assert rotation == pytest.approx(np.pi / 2 + plan.freedom["rotation"], abs=1e-12)
    assert np.abs(plan.freedom["slope"]).max() > 0.02
    assert np.abs(q - held(cell, s).q).max() < 0.5
    assert np.array(own.stage.table.map(len(s))(points)[1]).min() > 0.0
    ends = np.array(own.stage.work.map(len(s))(np.tile(x[:, None], len(s)), points))
    expected = [ref.workpiece_ends(cell, T_W_C), ref.positioner_ends(cell, ref.positioner_links(cell, place, q))]
    expected = np.concatenate(expected, axis=1).reshape(len(s), -1, 3)
    assert ends.reshape(3, len(s), -1).transpose(1, 2, 0) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", CELLS)
def test_without_tilt_everything_is_as_it_was(name: str) -> None:
    cell = load_cell(name)
    own, plain = form(cell), form(cell, "spin")
    plans = [f.unpack(f.coding.constant(at_place(cell)[None], np.zeros((1, len(f.names))))[0], 0) for f in (own, plain)]
    for robot, path in plans[1].paths.items():
        assert plans[0].paths[robot] == pytest.approx(path, abs=1e-12)
    assert (plans[1].paths["positioner"] == held(cell, seam_parameters(cell)).q).all()


@pytest.mark.parametrize("name", CELLS)
def test_verifier_accepts_a_tilted_plan_and_sees_its_tilt(name: str) -> None:
    own = form(load_cell(name))
    plan = own.unpack(tilted(own, seed=5), 0)
    report = verify(plan)
    assert report.feasible, str(report)
    assert max(report.posture_rad, report.closure_m, report.closure_rad) < 1e-9
    assert report.mmr_mean == pytest.approx(own.evaluate(tilted(own, seed=5)).objective[0], rel=1e-9)


def test_other_branch_of_the_untilted_path_is_kept() -> None:
    cell = with_limits(load_cell("robot_positioner"), 0, 45.0, 195.0)
    own, s = form(cell), seam_parameters(cell)
    assert (held(cell, s).branch == 1).all()
    assert (table_data(cell, cell.positioner, s)[1] == -1).all()
    cos_sin, kept = (np.array(out) for out in own.stage.table.map(len(s))(own.points(tilted(own))[1]))
    assert cos_sin[0, 1::2].min() > 0.5  # sin of theta1, which stands near 135 degrees
    assert kept.min() > 0.0


def test_limits_of_the_positioner_count_and_the_smooth_side_says_the_same() -> None:
    cell = with_limits(load_cell("dual_welder_positioner"), 0, -94.0, -86.0)  # -90 untilted
    own, seen = form(cell), set()
    for seed, share in ((1, 0.2), (2, 0.5), (3, 0.9), (4, 0.9)):
        z = tilted(own, seed, share)
        _, points = own.points(z)
        plan = own.unpack(z, 0)
        least = np.radians(4.0) - np.abs(plan.paths["positioner"][:, 0] + np.pi / 2)
        missed = max(0.0, np.radians(0.1) - least.min()) / np.pi
        assert own.evaluate(z).violation[0, 1] == pytest.approx(missed, abs=1e-12)
        kept = np.array(own.stage.table.map(points.shape[1])(points)[1])
        assert kept[[0, 2]].min(axis=0) == pytest.approx(np.sin(least - np.radians(0.1)), abs=1e-12)
        assert kept[[1, 3]].min() > 0.9  # the table may turn once either way
        seen.add(missed > 0.0)
    assert seen == {True, False}


def test_limits_of_the_positioner_are_penalised() -> None:
    """The smooth term grows by the sine of what is missed over that of a positioner with wider limits."""
    wide = load_cell("dual_welder_positioner")
    narrow, terms = with_limits(wide, 0, -94.0, -86.0), []
    for own in (form(wide), form(narrow)):
        x, points = own.points(tilted(own, 3))
        term = term_function(own.stage, own.batch.modes[0], Gaps({}, ((),) * 3), 72)
        f = len(own.names)
        lanes = np.vstack([np.tile(x[:, None], 72), points[-f:]])
        terms.append(np.array(term.map(72)(lanes, own.data, np.full((1, 72), 1e9))).ravel())
    missed = np.maximum(0.0, -np.array(own.stage.table.map(72)(points)[1])).sum(axis=0)
    assert (missed > 0.0).any()
    assert terms[1] - terms[0] == pytest.approx(missed, abs=1e-7)


def test_way_back_of_a_closed_seam_keeps_the_limits_too() -> None:
    """The table turns from 180 to -175 degrees at the last point, and on to -180."""
    cell = with_limits(load_cell("robot_positioner"), 1, -180.05, 360.0)
    own = form(cell)
    z = own.coding.constant(at_place(cell)[None], np.zeros((1, len(own.names))))[0]
    assert own.evaluate(z).violation[0, 1] == pytest.approx(0.05 / 180, abs=1e-12)
    kept = np.array(own.stage.table.map(72)(own.points(z)[1])[1])
    assert kept[3, 0] == pytest.approx(np.sin(np.radians(-0.05)), abs=1e-12)
    assert kept[3, 1:].min() > 0.08


def test_steps_of_the_positioner_count_where_it_tilts() -> None:
    """On the arc of the trough the table turns 5.8 degrees from point to point, the robots 2.5 at most."""
    cell = load_cell("dual_welder_positioner").with_(freedom={"joint_step_deg": 5.0})
    own, plain = form(cell), form(cell, "spin")
    missed = [
        f.evaluate(f.coding.constant(at_place(cell)[None], np.zeros((1, len(f.names))))).violation[0, 4]
        for f in (own, plain)
    ]
    step = np.abs(np.diff(held(cell, seam_parameters(cell)).q, axis=0)).max()
    assert missed == pytest.approx([(step - np.radians(5.0 - STEP_MARGIN_DEG)) / np.pi, 0.0], abs=1e-12)
    penalty = []
    for f in (own, plain):
        bound, sharpness = np.radians(5.0), 1e6
        step_at = step_function(f.stage, f.batch.modes[0], bound)
        zero = np.zeros(len(f.names))
        penalty.append(float(step_at([*at_place(cell), *zero, *zero], [*f.data[:, 35], *f.data[:, 36]], sharpness)))
    assert penalty[1] == pytest.approx(0.0, abs=1e-6)
    too_long = (np.cos(np.radians(5.0)) - np.cos(step)) / (1 - np.cos(np.radians(5.0)))
    assert penalty[0] == pytest.approx(STEP_WEIGHT * too_long, rel=1e-6)


def tilts_of(cell: Cell) -> list[str]:
    return [a.name for a in free_angles(cell, "spin_yaw_tilt") if a.name in ("slope", "rotation")]


def test_weld_near_the_table_axis_is_not_tilted() -> None:
    """It stands 45 degrees off the axis; the corner of the bands must stay a degree away from it."""
    cell = load_cell("robot_positioner")
    assert tilts_of(cell) == ["slope", "rotation"]
    for slope, free in ((43.9, True), (44.1, False)):
        bands = {"slope_deg": (-slope, 5.0), "rotation_deg": (-0.1, 0.1)}
        assert bool(tilts_of(cell.with_(freedom=bands))) is free
    assert not tilts_of(cell.with_(freedom={"slope_deg": (-180.0, 0.0), "rotation_deg": (-180.0, 0.0)}))
    assert not tilts_of(cell.with_(positioner={"base_rpy_deg": (-135.0, 0.0, 0.0)}))  # and where axis 1 is not level


def test_one_axis_reaches_one_rotation_for_a_slope_and_leaves_both_out() -> None:
    cell = load_cell("robot_positioner")
    one = cell.positioner.robot.model_copy(update={"joints": cell.positioner.robot.joints[1:], "bodies": ()})
    alone = cell.positioner.model_copy(update={"robot": one, "base_rpy_deg": (-45.0, 0.0, 0.0), "may_touch": ()})
    assert tilts_of(cell.model_copy(update={"positioner": alone})) == []
