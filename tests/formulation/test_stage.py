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


def test_gap_names_leave_out_what_may_touch_and_what_stands_on_the_floor(batch: Batch) -> None:
    handler = [name.removeprefix("handler_1.") for name in batch.stage.gap_names[0]]
    welder = [name.removeprefix("welder.") for name in batch.stage.gap_names[2]]
    arm, held, works = ["base_column", "upper_arm", "forearm"], ["wrist", "gripper"], ["main_pipe", "branch"]
    expected = {f"{b} - {w}" for b in arm for w in works} | {f"{b} - branch" for b in held}
    assert set(handler) == expected | {f"{b} - floor" for b in [*arm[1:], *held]}
    touching = [*arm, "wrist", "torch_body"]
    expected = {f"{b} - {w}" for b in touching for w in works}
    assert set(welder) == expected | {f"{b} - floor" for b in [*touching[1:], "nozzle"]}


@STATIONS
def test_every_named_gap_has_one_number(batch: Batch, k: int) -> None:
    assert batch.stage.arms[k].numel_out("gaps") == len(batch.stage.gap_names[k])


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


def test_solo_gaps_give_the_clearance_to_pipes_and_floor(batch: Batch) -> None:
    station, T_W_C = batch.cell.stations[2], workpiece_poses(batch.cell, PAPER)[0]
    _, _, _, _, ends, gaps = (out[0] for out in arm_outputs(batch.stage, 2, PAPER))
    ends = ends.reshape(-1, 3)
    works = {b.name: b for b in batch.cell.workpiece.bodies}
    for name, gap in zip(batch.stage.gap_names[2], gaps, strict=True):
        body, other = name.removeprefix("welder.").split(" - ")
        i = [b.name for b in station.bodies].index(body)
        mine, radius = ends[2 * i : 2 * i + 2], station.bodies[i].radius_m
        if other == "floor":
            expected = mine[:, 2].min() - radius
        else:
            pipe = [(T_W_C @ [*p, 1])[:3] for p in (works[other].start_m, works[other].end_m)]
            expected = sampled_gap(np.array([*mine, *pipe]), (radius, works[other].radius_m))
        assert gap == pytest.approx(expected, abs=1e-4)


def test_workpiece_height_is_that_of_its_lowest_points(batch: Batch) -> None:
    heights = np.array(batch.stage.workpiece_height(PAPER, np.array([*np.eye(3).ravel(), 0, 0, 0]))).ravel()
    assert heights == pytest.approx([0.404 - 0.1, 0.404 - 0.05], abs=1e-15)


def test_closest_pair_at_the_papers_placement_is_the_forearm_of_handler_1_and_the_torch_at_point_0(cell: Cell) -> None:
    stage = Stage(cell)
    ends = [arm_outputs(stage, k, PAPER)[4].reshape(72, -1, 3).transpose(0, 2, 1) for k in (0, 2)]
    gaps = np.array([np.array(stage.meetings[0, 2](a, b)).ravel() for a, b in zip(*ends, strict=True)])
    point, pair = np.unravel_index(gaps.argmin(), gaps.shape)
    names = [f"{a.name} - {b.name}" for a in cell.stations[0].bodies for b in cell.stations[2].bodies]
    assert (point, names[pair]) == (0, "forearm - torch_body")
    assert gaps.min() == pytest.approx(0.0244, abs=5e-5)
