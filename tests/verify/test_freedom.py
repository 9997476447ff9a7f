"""Plans that use the freedom of the weld: poses built another way, and every way to take too much."""

import math

import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.errors import PlanError
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.plan import Plan
from nlpweld.verify import between
from nlpweld.verify import reference as ref
from nlpweld.verify.check import verify
from nlpweld.verify.freedom import Offsets
from nlpweld.verify.report import Report
from nlpweld.verify.scene import look

from .conftest import AT, START_DEG, within_limits
from .helpers import cell_with, changed, found, only, without_freedom
from .welders import PLACES, rot, turned
from .welders import plan as plan_of_welders

FLIP = np.diag([1.0, -1.0, -1.0])


def work_rotation(cell: Cell, s: np.ndarray, u: dict[str, np.ndarray]) -> np.ndarray:
    """Return Rz(yaw) R_P_p Ry(-slope) Rx(rotation) R_P_p^T R_flat by matrices of SciPy, shape (M, 3, 3)."""
    weld = weld_frames(cell, s)
    x, z = weld.tangent_C, weld.normal_C
    R_C_p = np.stack([x, np.cross(z, x), z], axis=-1) @ rot("X", np.radians(cell.posture.turn_deg))
    nx, ny, nz = z.T
    k = 1 / (1 + nz)
    rows = [[1 - k * nx * nx, -k * nx * ny, -nx], [-k * nx * ny, 1 - k * ny * ny, -ny], [nx, ny, nz]]
    R_flat = np.moveaxis(np.array(rows), -1, 0)
    R_P_p = R_flat @ R_C_p
    tilted = R_P_p @ rot("YX", -u["slope"], u["rotation"]) @ R_P_p.swapaxes(1, 2) @ R_flat
    return rot("Z", u["yaw"]) @ tilted


def poses(cell: Cell, s: np.ndarray, u: dict[str, np.ndarray], yaw: float = 0.0) -> dict[str, np.ndarray]:
    """Return T_W_E (M, 4, 4) of every robot of three_er16 with offsets u at AT, {P} turned by a yaw."""
    R = rot("Z", yaw) @ work_rotation(cell, s, u)
    asked = {}
    for station in cell.stations:
        T = np.tile(np.eye(4), (len(s), 1, 1))
        if station.coupling.kind == "tight":
            T_C_E = station.coupling.T_C_E
            T[:, :3, :3], p_C = R @ T_C_E[:3, :3], np.tile(T_C_E[:3, 3], (len(s), 1))
        else:
            heading = np.radians(station.coupling.heading_deg)
            T[:, :3, :3], p_C = rot("Z", heading) @ FLIP @ rot("Z", u[f"spin.{station.name}"]), weld_frames(cell, s).p_C
        T[:, :3, 3] = AT + turned(R, p_C)
        asked[station.name] = T
    return asked


def offsets(s: np.ndarray) -> dict[str, np.ndarray]:
    """Return offsets that are zero at the start of the seam and stay within every band."""
    way = 2 * np.pi * s
    tilt = {"slope": 0.06 * np.sin(2 * way), "rotation": -0.12 * np.sin(way)}
    return {"yaw": -0.2 * np.sin(2 * way), **tilt, "spin.welder": 0.5 * (1 - np.cos(way))}


def any_offsets(rng: np.random.Generator, m: int) -> dict[str, np.ndarray]:
    return {name: rng.uniform(-1, 1, size=m) for name in ("yaw", "slope", "rotation", "spin.welder")}


@pytest.fixture(scope="module")
def free_plan(cell: Cell) -> Plan:
    """The paper's placement, chains closed on poses of SciPy, each point from the one before."""
    s = seam_parameters(cell)
    u, paths = offsets(s), {}
    asked = poses(cell, s, u)
    for station in cell.stations:
        q, rows = np.radians(START_DEG[station.name]), []
        for pose in asked[station.name]:
            q = between.close_chain(station, pose[None], q[None])[0][0]
            rows.append(q)
        paths[station.name] = within_limits(np.array(rows), station.robot.limits_rad)
    return Plan(cell, AT, s, paths, freedom=u)


@pytest.fixture(scope="module")
def free_report(free_plan: Plan) -> Report:
    return verify(free_plan)


def welder_offsets(s: np.ndarray) -> dict[str, np.ndarray]:
    way, u = 2 * np.pi * s, {}
    for k, sense in ((1, 1.0), (2, -1.0)):
        u[f"spin.robot_{k}"] = sense * 0.4 * np.sin(way) + 0.1
        u[f"travel.robot_{k}"] = sense * 0.07 * np.cos(way)
        u[f"work.robot_{k}"] = 0.05 * np.sin(2 * way)
    return u


@pytest.fixture(scope="module")
def free_dual(dual: Cell) -> Plan:
    return plan_of_welders(dual, PLACES["C"], freedom=welder_offsets(np.linspace(0, 1, 72)))


def spoiled(plan: Plan, name: str, point: int, by: float) -> Plan:
    u = plan.freedom[name].copy()
    u[point] += by
    return plan.with_freedom({**plan.freedom, name: u})


@pytest.mark.parametrize("turn", [0.0, 35.0])
def test_poses_are_those_of_the_definition(cell: Cell, rng, turn):
    """Far beyond the bands, at any posture and any yaw of {P}."""
    cell = cell_with(cell, posture={"turn_deg": turn})
    s = np.sort(rng.random(9))
    u = any_offsets(rng, 9)
    asked = poses(cell, s, u, yaw=0.4)
    for station in cell.stations:
        got = ref.required_pose(cell, station, np.append(AT, 0.4), s, free=Offsets(s, True, u))
        np.testing.assert_allclose(got, asked[station.name], atol=1e-12)


def test_slope_and_rotation_tilt_the_weld_by_so_much(cell: Cell):
    """Slope lifts the tangent off the horizontal, rotation turns the normal about it (Zhang et al., 1.1)."""
    s = np.array([0.1, 0.4, 0.8])
    zero = np.zeros(3)
    u = {"yaw": zero, "slope": np.array([0.2, -0.3, 0.1]), "rotation": zero}
    flat = ref.workpiece_pose(cell, AT, s) @ ref.weld_pose(cell, s)
    T_W_p = ref.workpiece_pose(cell, AT, s, free=Offsets(s, True, u)) @ ref.weld_pose(cell, s)
    np.testing.assert_allclose(flat[:, 2, 0], 0, atol=1e-12)
    np.testing.assert_allclose(np.arcsin(T_W_p[:, 2, 0]), u["slope"], atol=1e-12)
    u = {**u, "slope": zero, "rotation": np.array([0.2, -0.3, 0.1])}
    T_W_p = ref.workpiece_pose(cell, AT, s, free=Offsets(s, True, u)) @ ref.weld_pose(cell, s)
    np.testing.assert_allclose(T_W_p[:, :3, 0], flat[:, :3, 0], atol=1e-12)
    np.testing.assert_allclose(np.arctan2(T_W_p[:, 2, 1], T_W_p[:, 2, 2]), u["rotation"], atol=1e-12)


def test_offsets_go_straight_from_point_to_point():
    s, u = np.array([0.1, 0.5, 0.8]), {"yaw": np.array([1.0, 3.0, 0.0])}
    closed = Offsets(s, True, u).at(np.array([0.1, 0.3, 0.5, 0.95, 1.025, 1.1, 0.025]))["yaw"]
    np.testing.assert_allclose(closed, [1.0, 2.0, 3.0, 0.5, 0.75, 1.0, 0.75], atol=1e-12)
    np.testing.assert_allclose(Offsets(s, False, u).at(np.array([0.3, 0.8]))["yaw"], [2.0, 0.0], atol=1e-12)


def test_plan_with_freedom_is_accepted(free_plan: Plan, free_report: Report):
    assert free_report.feasible, str(free_report)
    assert max(free_report.closure_m, free_report.closure_rad) < 1e-9
    assert free_report.mmr_mean != pytest.approx(0.284151, rel=1e-3)


def test_plan_with_free_torches_is_accepted(free_dual: Plan):
    got = verify(free_dual)
    assert got.feasible, str(got)
    assert max(got.closure_m, got.closure_rad, got.posture_rad) < 1e-9


def test_single_angle_may_be_free(single: Cell):
    """A plan need not name all; those left out are nominal."""
    way = 2 * np.pi * np.arange(single.seam.points) / single.seam.points
    for name in ("spin", "travel", "work"):
        got = verify(plan_of_welders(single, (0.0, -1.0), freedom={f"{name}.robot_1": 0.06 * np.sin(way)}))
        assert got.feasible, str(got)
        assert max(got.closure_m, got.closure_rad) < 1e-9


def test_every_sample_reaches_the_weld_as_it_is_turned(free_plan: Plan):
    plan = free_plan
    free = Offsets(plan.s, True, plan.freedom)
    motion = between.whole_motion(plan.cell, plan.placement, plan.s, plan.paths, free)
    assert not motion.jumps
    assert not motion.unclosed
    assert len(motion.s) > 2 * len(plan.s)
    ahead = {name: np.append(u, u[0]) for name, u in plan.freedom.items()}
    u = {name: np.interp(motion.s, np.append(plan.s, 1.0), values) for name, values in ahead.items()}
    asked = poses(plan.cell, motion.s % 1.0, u)
    for station in plan.cell.stations:
        T_W_E = ref.tcp_pose(station, ref.link_poses(station, motion.q[station.name]))
        np.testing.assert_allclose(T_W_E, asked[station.name], atol=1e-7)


def test_workpiece_is_seen_where_it_is_turned(free_plan: Plan):
    """Its height above the floor, and its ends that must not move far between samples."""
    plan, bodies = free_plan, free_plan.cell.workpiece.bodies
    free = Offsets(plan.s, True, plan.freedom)
    R = work_rotation(plan.cell, plan.s, plan.freedom)
    ends = np.stack([AT + turned(R, np.array(p)) for body in bodies for p in (body.start_m, body.end_m)], axis=1)
    np.testing.assert_allclose(between._ends(plan.cell, AT, plan.s, plan.paths, free)[""], ends, atol=1e-12)
    scene = look(plan.cell, plan.placement, between.whole_motion(plan.cell, AT, plan.s, plan.paths, free))
    for b, body in enumerate(bodies):
        column = scene.table.pair_labels.index(f"workpiece.{body.name} - floor")
        height = ends[:, 2 * b : 2 * b + 2, 2].min(axis=1) - body.radius_m
        np.testing.assert_allclose(scene.clearance_m[scene.motion.at, column], height, atol=1e-12)


def test_no_offset_is_no_difference(plan: Plan, report: Report):
    zero = dict.fromkeys(("yaw", "slope", "rotation", "spin.welder"), np.zeros(72))
    got, want = (r.to_json(profile=True) for r in (verify(plan.with_freedom(zero)), report))
    assert got["feasible"]
    assert got["samples"] == want["samples"]
    for name in ("mmr_mean", "clearance_along_m", "joint_margin_rad", "joint_step_rad"):
        assert got[name] == pytest.approx(want[name], abs=1e-9)
    assert verify(plan.with_freedom({})).to_json(profile=True) == want


@pytest.mark.parametrize(
    ("name", "robots"),
    [
        ("yaw", {"handler_1", "handler_2", "welder"}),
        ("slope", {"handler_1", "handler_2", "welder"}),
        ("rotation", {"handler_1", "handler_2", "welder"}),
        ("spin.welder", {"welder"}),
    ],
)
def test_offset_spoiled_at_one_point(free_plan: Plan, name, robots):
    violations = only(verify(spoiled(free_plan, name, 36, 1e-3)), "closure")
    assert {(v.robot, v.point) for v in violations} == {(robot, 36) for robot in robots}


@pytest.mark.parametrize("name", ["spin", "travel", "work"])
def test_torch_offset_spoiled_at_one_point(free_dual: Plan, name):
    violations = only(verify(spoiled(free_dual, f"{name}.robot_2", 20, 1e-3)), "closure")
    assert {(v.robot, v.point) for v in violations} == {("robot_2", 20)}
    assert max(v.value for v in violations) == pytest.approx(1e-3, rel=0.5)


def test_freedom_forgotten(free_plan: Plan, free_dual: Plan):
    for plan in (free_plan, free_dual):
        report = verify(plan.with_freedom(None))
        assert {v.robot for v in found(report, "closure")} == {s.name for s in plan.cell.stations}


BANDS = {  # a band, and the angle that leaves it: value, points of which one is named, who and which
    "yaw_deg": ((-10.0, 20.0), -0.2, {9, 45}, "workpiece", "yaw"),
    "slope_deg": ((-5.0, 3.0), 0.06, {9, 45}, "workpiece", "slope"),
    "rotation_deg": ((-10.0, 5.0), 0.12, {54}, "workpiece", "rotation"),
    "spin_deg": ((-180.0, 50.0), 1.0, {36}, "welder", "spin"),
}


@pytest.mark.parametrize(("field", "case"), BANDS.items(), ids=BANDS)
def test_angle_outside_its_band(free_plan: Plan, field, case):
    band, value, points, robot, angle = case
    cell = cell_with(free_plan.cell, freedom={field: band})
    (violation,) = only(verify(changed(free_plan, cell=cell)), "freedom")
    assert (violation.robot, violation.joint, violation.unit) == (robot, angle, "rad")
    assert violation.point in points
    assert violation.value == pytest.approx(value)
    assert violation.limit == pytest.approx(np.radians(band[0] if value < 0 else band[1]))
    assert f"freedom {robot} {angle} at point {violation.point}" in str(violation)


@pytest.mark.parametrize(("field", "angle"), [("travel_deg", "travel"), ("work_deg", "work"), ("spin_deg", "spin")])
def test_torch_angle_outside_its_band(free_dual: Plan, field, angle):
    cell = cell_with(free_dual.cell, freedom={field: (-1.0, 1.0)})
    violations = only(verify(changed(free_dual, cell=cell)), "freedom")
    assert {(v.robot, v.joint) for v in violations} == {("robot_1", angle), ("robot_2", angle)}


def test_band_itself_is_allowed(free_plan: Plan):
    lowest, highest = (math.degrees(f(free_plan.freedom["yaw"])) for f in (np.min, np.max))
    for slack, feasible in ((0.0, True), (-1e-6, False)):
        cell = cell_with(free_plan.cell, freedom={"yaw_deg": (lowest, highest + slack)})
        assert verify(changed(free_plan, cell=cell)).feasible is feasible


def test_cell_that_leaves_no_freedom(free_plan: Plan, plan: Plan):
    (violation,) = only(verify(without_freedom(free_plan)), "freedom")
    assert str(violation) == "freedom ; the cell has no [freedom] table, and the plan takes freedom"
    assert verify(without_freedom(plan)).feasible


def test_torch_direction_that_there_is_not(dual: Cell):
    """Work at -45 leaves the right angle by 45 deg; travel may leave it by as much and no more."""
    good, held = plan_of_welders(dual, PLACES["C"]), dual.stations[0].coupling.angles
    room = 90 - abs(held.travel_deg - 90) - abs(held.work_deg + 90)
    away = math.copysign(np.radians(room + 1), held.travel_deg - 90.5)
    cell = cell_with(dual, freedom={"travel_deg": (-180.0, 180.0)})
    u = np.zeros(72)
    u[7] = away
    (violation,) = found(verify(changed(good, cell=cell).with_freedom({"travel.robot_1": u})), "freedom")
    assert (violation.robot, violation.point, violation.joint) == ("robot_1", 7, "travel, work")
    assert math.degrees(violation.value) == pytest.approx(91)
    u[7] = away - math.copysign(np.radians(2), away)
    assert not found(verify(changed(good, cell=cell).with_freedom({"travel.robot_1": u})), "freedom")


def longest_step(plan: Plan, closed: bool) -> float:
    """Return the longest joint step by unit complex numbers, so less whole turns, the way back included if closed."""
    steps = []
    for station in plan.cell.stations:
        phase = np.exp(1j * plan.paths[station.name])
        steps.append(np.abs(np.angle(np.roll(phase, -1, axis=0) / phase))[: len(phase) if closed else -1].max())
    return max(steps)


def test_joint_step_is_the_longest_of_all(free_plan: Plan, free_report: Report, free_dual: Plan, report, plan):
    assert free_report.joint_step_rad == pytest.approx(longest_step(free_plan, True), abs=1e-12)
    assert report.joint_step_rad == pytest.approx(longest_step(plan, True), abs=1e-12)
    assert verify(free_dual).joint_step_rad == pytest.approx(longest_step(free_dual, False), abs=1e-12)
    assert f"joint step        {math.degrees(report.joint_step_rad):.3f} deg" in str(report)
    assert report.to_json()["joint_step_rad"] == report.joint_step_rad


def test_joint_step_too_long(free_plan: Plan, free_report: Report):
    step = math.degrees(free_report.joint_step_rad)
    for limit, feasible in ((step, True), (step - 1e-6, False)):
        cell = cell_with(free_plan.cell, freedom={"joint_step_deg": limit})
        assert verify(changed(free_plan, cell=cell)).feasible is feasible
    (violation,) = only(verify(changed(free_plan, cell=cell)), "joint_step")
    path = free_plan.paths[violation.robot][:, int(violation.joint[1]) - 1]
    ahead = abs(path[(violation.point + 1) % 72] - path[violation.point])
    assert violation.value == pytest.approx(ahead)
    assert violation.limit == pytest.approx(free_report.joint_step_rad)
    bare = changed(free_plan, cell=cell).with_freedom(None)
    assert not found(verify(bare), "joint_step")


def test_way_back_to_the_first_point_counts(plan: Plan):
    """The same motion begun elsewhere: its longest step is then the way back, and is found there."""
    path = plan.paths["welder"].copy()
    path[-1, 5] += np.radians(25)
    report = verify(changed(plan, paths={**plan.paths, "welder": path}).with_freedom({}))
    (violation,) = found(report, "joint_step")
    steps = np.degrees(np.abs(path[[-1, 0], 5] - path[[-2, -1], 5]))
    back = min(steps[1] % 360, -steps[1] % 360)
    assert (violation.robot, violation.joint) == ("welder", "J6")
    assert math.degrees(violation.value) == pytest.approx(max(steps[0], back))
    assert violation.point == (70 if steps[0] > back else 71)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1e200])
def test_offset_that_is_no_number(free_plan: Plan, value):
    (violation,) = only(verify(spoiled(free_plan, "spin.welder", 5, value)), "finite")
    assert (violation.robot, violation.joint, violation.point) == ("welder", "spin", 5)


@pytest.mark.parametrize(
    ("freedom", "what"),
    [
        ({"spin.handler_1": np.zeros(72)}, r"freedom\.spin\.handler_1: the cell has no free angle"),
        ({"travel.welder": np.zeros(72)}, r"freedom\.travel\.welder: "),
        ({"slope": np.zeros(72)}, r"freedom\.slope: alone"),
        ({"yaw": np.zeros(71)}, r"freedom\.yaw: shape \(71,\), not \(72,\)"),
    ],
)
def test_freedom_that_contradicts_the_cell_is_refused(plan: Plan, freedom, what):
    with pytest.raises(PlanError, match=what):
        verify(plan.with_freedom(freedom))


def test_positioner_decides_where_the_work_is(dual_plan: Plan):
    with pytest.raises(PlanError, match=r"freedom\.yaw: the cell has no free angle of that name"):
        verify(dual_plan.with_freedom({"yaw": np.zeros(72)}))
