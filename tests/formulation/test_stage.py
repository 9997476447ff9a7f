"""The stage's graphs against poses, distances and determinants worked out apart."""

import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.kinematics.chain import Chain
from nlpweld.kinematics.ik import BRANCHES

from .helpers import PAPER, arm_outputs, base, tcp_in_base, workpiece_poses

STATIONS = pytest.mark.parametrize("k", range(3), ids=["handler_1", "handler_2", "welder"])


def joints(cell: Cell, k: int, cos_sin: np.ndarray) -> np.ndarray:
    """Return joint angles (N, 6) of an arm graph's cosines and sines (N, 12)."""
    cos, sin = cos_sin.reshape(-1, 2, 6).transpose(1, 0, 2)
    return np.arctan2(sin, cos) - cell.stations[k].robot.dh[:, 3]


def wanted_tcp(cell: Cell, k: int, x: np.ndarray) -> np.ndarray:
    """Return where T_W_E of station k has to have its origin at the seam points, shape (N, 3) [m]."""
    T_W_C = workpiece_poses(cell, x)
    coupling = cell.stations[k].coupling
    p = weld_frames(cell, seam_parameters(cell)).p_C if coupling.kind == "loose" else np.array([coupling.position_m])
    return np.einsum("nij,nj->ni", T_W_C[:, :3, :3], np.broadcast_to(p, (72, 3))) + T_W_C[:, :3, 3]


@STATIONS
def test_arm_graph_puts_the_tcp_where_the_coupling_wants_it_on_every_branch_in_reach(batch: Batch, k: int) -> None:
    cell, reached = batch.cell, 0
    for branch in BRANCHES:
        cos_sin, _, _, reach, *_ = arm_outputs(batch.stage, k, PAPER, branch)
        if reach.min() < 0.0:
            continue
        T_W_E = base(cell, k) @ tcp_in_base(cell, k, joints(cell, k, cos_sin))
        assert T_W_E[:, :3, 3] == pytest.approx(wanted_tcp(cell, k, PAPER), abs=1e-12)
        reached += 1
    assert reached >= 4


@STATIONS
def test_w_and_gram_are_the_determinants_of_the_jacobian_at_the_tcp(batch: Batch, k: int) -> None:
    station = batch.cell.stations[k]
    cos_sin, w, gram, *_ = arm_outputs(batch.stage, k, PAPER)
    T_F_E = np.array(station.tool.translation_m)
    chain = Chain(station.robot)
    J = np.array([np.array(chain.jacobian(q, T_F_E)) for q in joints(batch.cell, k, cos_sin)])
    assert w[:, 0] == pytest.approx(np.abs(np.linalg.det(J)), rel=1e-10)
    assert gram[:, 0] == pytest.approx(np.linalg.det(J[:, :3] @ J[:, :3].transpose(0, 2, 1)), rel=1e-10)


def named_pairs(stage: Stage, owners: tuple[int, int]) -> set[str]:
    a, b = (stage.shapes[owner] for owner in owners)
    return {f"{a[i].name} - {b[j].name}" for i, j in stage.pairs[owners]}


def test_pairs_with_the_workpiece_leave_out_what_may_touch(batch: Batch) -> None:
    arm, held, works = ["base_column", "upper_arm", "forearm"], ["wrist", "gripper"], ["main_pipe", "branch"]
    expected = {f"{b} - {w}" for b in arm for w in works} | {f"{b} - branch" for b in held}
    assert named_pairs(batch.stage, (0, 3)) == named_pairs(batch.stage, (1, 3)) == expected
    touching = [*arm, "wrist", "torch_body"]
    assert named_pairs(batch.stage, (2, 3)) == {f"{b} - {w}" for b in touching for w in works}


def test_floor_concerns_every_body_but_base_columns(batch: Batch) -> None:
    for shapes, height in zip(batch.stage.shapes, batch.stage.heights, strict=True):
        assert {s.name for s in shapes if not s.above_floor} <= {"base_column"}
        assert height.numel_out(0) == sum(s.above_floor for s in shapes)
    assert [len(shapes) for shapes in batch.stage.shapes] == [5, 5, 6, 2]


def sampled_gap(ends: np.ndarray, radii: tuple[float, float]) -> float:
    """Return the clearance of two capsules by sampling both axes, ends (4, 3) [m]."""
    s = np.linspace(0, 1, 401)[:, None]
    a, b = ends[0] + s * (ends[1] - ends[0]), ends[2] + s * (ends[3] - ends[2])
    return float(np.linalg.norm(a[:, None] - b[None], axis=2).min() - sum(radii))


@pytest.mark.parametrize("pair", [(0, 1), (0, 2), (1, 2)])
def test_meeting_gives_the_clearance_of_every_two_bodies_of_two_robots(batch: Batch, pair: tuple[int, int]) -> None:
    ends = [arm_outputs(batch.stage, k, PAPER)[4][0].reshape(-1, 3) for k in pair]
    bodies = [batch.cell.stations[k].bodies for k in pair]
    expected = [
        sampled_gap(np.concatenate([ends[0][2 * i : 2 * i + 2], ends[1][2 * j : 2 * j + 2]]), (a.radius_m, b.radius_m))
        for i, a in enumerate(bodies[0])
        for j, b in enumerate(bodies[1])
    ]
    got = np.array(batch.stage.meetings[pair](ends[0].T, ends[1].T)).ravel()
    assert got == pytest.approx(expected, abs=1e-4)


def test_meeting_with_the_workpiece_gives_the_clearance_to_the_pipes(batch: Batch) -> None:
    stage, station, T_W_C = batch.stage, batch.cell.stations[2], workpiece_poses(batch.cell, PAPER)[0]
    ends, works = arm_outputs(stage, 2, PAPER)[4][0].reshape(-1, 3), batch.cell.workpiece.bodies
    point = batch.points[:, 0]
    got = np.array(stage.meetings[2, 3](ends.T, stage.work(PAPER, point))).ravel()
    for (i, j), gap in zip(stage.pairs[2, 3], got, strict=True):
        pipe = [(T_W_C @ [*p, 1])[:3] for p in (works[j].start_m, works[j].end_m)]
        radii = (station.bodies[i].radius_m, works[j].radius_m)
        assert gap == pytest.approx(sampled_gap(np.array([*ends[2 * i : 2 * i + 2], *pipe]), radii), abs=1e-4)


def test_heights_are_those_of_the_lower_ends(batch: Batch) -> None:
    ends, bodies = arm_outputs(batch.stage, 2, PAPER)[4][0].reshape(-1, 2, 3), batch.cell.stations[2].bodies
    got = np.array(batch.stage.heights[2](ends.reshape(-1, 3).T)).ravel()
    assert got == pytest.approx([e[:, 2].min() - b.radius_m for e, b in zip(ends[1:], bodies[1:], strict=True)])


def test_workpiece_height_is_that_of_its_lowest_points(batch: Batch) -> None:
    ends = batch.stage.work(PAPER, np.array([*np.eye(3).ravel(), 0, 0, 0]))
    assert np.array(batch.stage.heights[3](ends)).ravel() == pytest.approx([0.404 - 0.1, 0.404 - 0.05], abs=1e-15)


def test_generic_gap_is_every_pairs_own(batch: Batch) -> None:
    stage = batch.stage
    ends = [arm_outputs(stage, k, PAPER)[4][0].reshape(-1, 3).T for k in (0, 2)]
    got = []
    for i, j in stage.pairs[0, 2]:
        p, q = stage.shapes[0][i], stage.shapes[2][j]
        numbers = np.array([p.sq_length, q.sq_length, p.radius_m + q.radius_m])
        got.append(float(stage.gap(ends[0][:, 2 * i : 2 * i + 2], ends[1][:, 2 * j : 2 * j + 2], numbers)))
    assert got == pytest.approx(np.array(stage.meetings[0, 2](*ends)).ravel(), abs=1e-13)


def test_closest_pair_at_the_papers_placement_is_the_forearm_of_handler_1_and_the_torch_at_point_0(cell: Cell) -> None:
    stage = Stage(cell)
    ends = [arm_outputs(stage, k, PAPER)[4].reshape(72, -1, 3).transpose(0, 2, 1) for k in (0, 2)]
    gaps = np.array([np.array(stage.meetings[0, 2](a, b)).ravel() for a, b in zip(*ends, strict=True)])
    point, pair = np.unravel_index(gaps.argmin(), gaps.shape)
    names = [f"{a.name} - {b.name}" for a in cell.stations[0].bodies for b in cell.stations[2].bodies]
    assert (point, names[pair]) == (0, "forearm - torch_body")
    assert gaps.min() == pytest.approx(0.0244, abs=5e-5)
