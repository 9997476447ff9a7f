"""Joint paths along the seam: from cosines and sines to continuous angles inside their limits."""

from collections.abc import Sequence

import numpy as np

from nlpweld.cell.robot import Robot


def joint_paths(robot: Robot, cos_sin: Sequence[np.ndarray]) -> np.ndarray:
    """Return continuous joint paths of the noflip wrist, closed by a repeat of the first point.

    Args:
        robot: a six-axis robot; its DH offsets are taken off.
        cos_sin: twelve arrays (m, N): cosines, then sines, of the DH angles.

    Returns:
        q, shape (m, 6, N + 1) [rad], unwrapped along the last axis.
    """
    cos, sin = np.stack(cos_sin[:6], axis=1), np.stack(cos_sin[6:], axis=1)
    theta = np.arctan2(sin, cos)
    theta = np.concatenate([theta, theta[..., :1]], axis=-1)
    return np.unwrap(theta, axis=-1) - robot.dh[:, 3][:, None]


def flip(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return the same tool paths with the other wrist: theta4 + pi, -theta5, theta6 + pi; shape (..., 6, M)."""
    other = q.copy()
    other[..., 3, :] += np.pi
    other[..., 4, :] = -q[..., 4, :] - 2 * robot.dh[4, 3]
    other[..., 5, :] += np.pi
    return other


def settle(robot: Robot, q: np.ndarray, need: float = 0.0) -> np.ndarray:
    """Shift joint paths by multiples of 2 pi into their limits, only where they do not already keep a margin.

    Args:
        robot: the robot whose limits count.
        q: paths that start in (-pi, pi], shape (..., 6, M) [rad].
        need: margin that makes a shift unnecessary [rad].
    """
    middle = robot.limits_rad.mean(axis=1)[:, None]
    centre = (q.max(axis=-1, keepdims=True) + q.min(axis=-1, keepdims=True)) / 2
    turns = np.round((middle - centre) / (2 * np.pi))
    return q + 2 * np.pi * np.where(limit_margins(robot, q)[..., None] >= need, 0.0, turns)


def limit_margins(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return how far each joint path stays inside its limits, shape (..., 6) [rad]; negative outside."""
    lower, upper = robot.limits_rad.T
    return np.minimum(upper - q.max(axis=-1), q.min(axis=-1) - lower)


def on_best_wrist(
    robot: Robot, q: np.ndarray, wrists: Sequence[str], need: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Choose for each candidate the first allowed wrist that keeps a margin, or else the one that keeps most.

    Args:
        robot: the robot.
        q: noflip paths, shape (m, 6, M) [rad].
        wrists: allowed wrists in order of preference.
        need: joint margin that is enough [rad].

    Returns:
        settled paths (m, 6, M) [rad], their worst joint margins (m,) [rad], and indices into ``wrists`` (m,).
    """
    paths = np.stack([settle(robot, on_wrist(robot, q, wrist), need) for wrist in wrists])
    margins = limit_margins(robot, paths).min(axis=-1)
    best = np.argmax(np.minimum(margins, need), axis=0)
    rows = np.arange(len(q))
    return paths[best, rows], margins[best, rows], best


def on_wrist(robot: Robot, q: np.ndarray, wrist: str) -> np.ndarray:
    """Return noflip paths on the named wrist."""
    return q if wrist == "noflip" else flip(robot, q)
