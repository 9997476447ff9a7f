"""How far a positioner is from holding the weld upright, or tilted as asked, and joints near others that hold it so."""

import numpy as np

from nlpweld.cell import Cell
from nlpweld.verify import reference as ref
from nlpweld.verify.freedom import Offsets

TWO_AXES_RAD = 1e-6  # two axes can hold any direction upright
ONE_AXIS_RAD = np.radians(5.0)  # ISO 6947, 3.3: test pieces within 5 deg of slope and 10 deg of rotation
ITERATIONS = 50
SETTLED_RAD = 1e-13
LONGEST_STEP_RAD = 0.3


def posture_limit(cell: Cell) -> float:
    """Return how far from upright the cell's positioner may be [rad]; a single axis cannot hold every direction."""
    assert cell.positioner is not None
    return ONE_AXIS_RAD if len(cell.positioner.robot.joints) == 1 else TWO_AXES_RAD


def off_upright(cell: Cell, T_W_C: np.ndarray, s: np.ndarray, free: Offsets | None = None) -> np.ndarray:
    """Return the angles between the direction that is to be upright and +z_W, shape (M,) [rad].

    Args:
        cell: the cell; its main seam and ``posture.turn_deg`` are used.
        T_W_C: workpiece poses, shape (M, 4, 4).
        s: seam parameter, shape (M,).
        free: offsets of free angles; by slope and rotation the weld is to be off its position.
    """
    up = _turned(T_W_C, _asked(cell, s, free))
    return np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2])


def tilt(cell: Cell, T_W_C: np.ndarray, s: np.ndarray) -> dict[str, np.ndarray]:
    """Return how far the main seam's weld is off its position, whatever a plan says of it.

    Args:
        cell: the cell; its main seam and ``posture.turn_deg`` are used.
        T_W_C: workpiece poses, shape (M, 4, 4).
        s: seam parameter, shape (M,).

    Returns:
        ``slope``: the tangent above the horizontal; ``rotation``: about the tangent, from where the direction across
        is level (Zhang et al., Fig. 1, less a right angle). Each of shape (M,) [rad].
    """
    x, y, z = (_turned(T_W_C, axis_C)[:, 2] for axis_C in _posture_axes(cell, s))
    return {"slope": np.arctan2(x, np.hypot(y, z)), "rotation": np.arctan2(y, z)}


def turn_upright(
    cell: Cell, placement: np.ndarray, s: np.ndarray, start: np.ndarray, free: Offsets | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Find the positioner's joints near a start that hold the weld as upright as they can, by damped Gauss-Newton.

    A joint that does not move the direction, as the table's where the direction is along its axis, stays.

    Args:
        cell: a cell with a positioner.
        placement: of {P} in W, shape (3,) or (4,) [m; rad].
        s: seam parameter, shape (M,).
        start: joint angles to start from, shape (M, n) [rad].
        free: offsets of free angles; by slope and rotation the weld is to be off its position.

    Returns:
        Joint angles (M, n), and how far from upright they leave the weld (M,) [rad].
    """
    q, asked = np.array(start, dtype=float), _asked(cell, s, free)
    for _ in range(ITERATIONS):
        axes = ref.positioner_links(cell, placement, q)[:, :-1, :3, 2]
        step = _step(axes, _turned(ref.workpiece_pose(cell, placement, s, q), asked))
        q += step
        if np.abs(step).max(initial=0.0) < SETTLED_RAD:
            break
    return q, off_upright(cell, ref.workpiece_pose(cell, placement, s, q), s, free)


def _step(axes: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return steps (M, n) that turn directions (M, 3) towards +z_W about axes (M, n, 3)."""
    towards = np.array([0.0, 0.0, 1.0]) - up[:, 2:] * up
    sine = np.linalg.norm(towards, axis=-1)
    towards *= (np.arctan2(sine, up[:, 2]) / np.maximum(sine, 1e-300))[:, None]
    moves = np.cross(axes, up[:, None])  # of the direction, a radian of each joint
    pull = np.einsum("mni,mi->mn", moves, towards)
    damping = np.clip((pull * pull).sum(axis=-1), 1e-12, 1e-2)
    core = moves @ moves.swapaxes(-1, -2) + damping[:, None, None] * np.eye(moves.shape[1])
    step = np.linalg.solve(core, pull[..., None])[..., 0]
    size = np.linalg.norm(step, axis=-1, keepdims=True)
    return step * np.minimum(1.0, LONGEST_STEP_RAD / np.maximum(size, 1e-300))


def _asked(cell: Cell, s: np.ndarray, free: Offsets | None = None) -> np.ndarray:
    """Return the direction in C that is to be upright, shape (M, 3).

    It is z of the frame that lies in position, leant towards its y axis by the rotation, then to its x axis by the
    slope: a tangent that rises by the slope has that much of the vertical along it.
    """
    x, y, z = _posture_axes(cell, s)
    u = free.at(s) if free else {}
    slope, rotation = (u.get(name, np.zeros(len(z)))[:, None] for name in ("slope", "rotation"))
    return np.sin(slope) * x + np.cos(slope) * (np.sin(rotation) * y + np.cos(rotation) * z)


def _posture_axes(cell: Cell, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return in C the axes, each (M, 3), of the frame that lies in position: {p} turned about x (Zhang et al., 1.1)."""
    turn, T_C_p = np.radians(cell.posture.turn_deg), ref.weld_pose(cell, s)
    x, y, z = T_C_p[:, :3, 0], T_C_p[:, :3, 1], T_C_p[:, :3, 2]
    return x, np.cos(turn) * y + np.sin(turn) * z, np.cos(turn) * z - np.sin(turn) * y


def _turned(T_W_C: np.ndarray, direction_C: np.ndarray) -> np.ndarray:
    """Return directions in W, shape (M, 3)."""
    return np.einsum("mij,mj->mi", T_W_C[:, :3, :3], direction_C)
