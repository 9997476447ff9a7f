"""Poses of the model by hand, and the stage's graphs over one placement."""

import numpy as np

from nlpweld.cell import Cell
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.posture import flat
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.kinematics.chain import rpy_pose
from nlpweld.kinematics.ik import signs

PAPER = np.array([0.023, -0.266, 0.404])
FRONT = ("front", "up", "noflip")


def arm_outputs(stage: Stage, k: int, x: np.ndarray, branch: tuple[str, str, str] = FRONT) -> list[np.ndarray]:
    """Return every output of station k's graph over the seam, one row per seam point, column by column."""
    points = point_data(stage.cell, seam_parameters(stage.cell))
    graph, n = stage.arms[k], points.shape[1]
    out = graph.map(n)(np.tile(np.reshape(x, (3, 1)), n), points, np.tile(np.reshape(signs(branch), (3, 1)), n))
    shapes = [graph.size_out(i) for i in range(graph.n_out())]
    blocks = [np.array(o).reshape(r, n, c) for o, (r, c) in zip(out, shapes, strict=True)]
    return [block.transpose(1, 2, 0).reshape(n, -1) for block in blocks]


def workpiece_poses(cell: Cell, x: np.ndarray) -> np.ndarray:
    """Return T_W_C at the cell's seam points, shape (N, 4, 4)."""
    frames = weld_frames(cell, seam_parameters(cell))
    T = np.tile(np.eye(4), (len(frames.p_C), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = flat(frames.normal_C), x
    return T


def tcp_in_base(cell: Cell, k: int, q: np.ndarray) -> np.ndarray:
    """Return T_B_E of station k by its DH rows for joints q (m, 6), shape (m, 4, 4)."""
    station, T = cell.stations[k], np.tile(np.eye(4), (len(q), 1, 1))
    for (a, d, alpha, offset), angle in zip(station.robot.dh, q.T, strict=True):
        c, s, ca, sa = np.cos(angle + offset), np.sin(angle + offset), np.cos(alpha), np.sin(alpha)
        zero, one = np.zeros_like(c), np.ones_like(c)
        rows = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [zero, sa * one, ca * one, d * one]]
        T = T @ np.moveaxis(np.array([*rows, [zero, zero, zero, one]]), -1, 0)
    return T @ rpy_pose(station.tool.translation_m, station.tool.rpy_deg)


def base(cell: Cell, k: int) -> np.ndarray:
    """Return T_W_B of station k, shape (4, 4)."""
    return rpy_pose(cell.stations[k].base_position_m, cell.stations[k].base_rpy_deg)
