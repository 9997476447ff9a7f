"""Joint paths along the seam: from cosines and sines to continuous angles inside their limits."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nlpweld.cell.robot import Robot
from nlpweld.engine.lanes import Lanes


def joint_paths(robot: Robot, cos_sin: Lanes, closed: bool) -> np.ndarray:
    """Return continuous joint paths of the noflip wrist; those of a closed seam repeat the first point at the end.

    Args:
        robot: a six-axis robot; its DH offsets are taken off.
        cos_sin: twelve arrays (m, N): cosines, then sines, of the DH angles.
        closed: whether the seam is.

    Returns:
        q, shape (m, 6, N) or, closed, (m, 6, N + 1) [rad], unwrapped along the last axis.
    """
    cos, sin = np.stack(list(cos_sin[:6]), axis=1), np.stack(list(cos_sin[6:]), axis=1)
    theta = np.arctan2(sin, cos)
    if closed:
        theta = np.concatenate([theta, theta[..., :1]], axis=-1)
    return np.unwrap(theta, axis=-1) - robot.dh[:, 3][:, None]


def turns(phase: np.ndarray, closed: bool) -> np.ndarray:
    """Return how far joints turn from each seam point to the next, and back to the first if the seam is closed.

    Args:
        phase: cosines plus i times sines of joint angles, shape (..., N).
        closed: whether the seam is.

    Returns:
        signed steps within half a turn, shape (..., N) or, open, (..., N - 1) [rad].
    """
    steps = np.angle(np.roll(phase, -1, axis=-1) * phase.conj())
    return steps if closed else steps[..., :-1]


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


@dataclass(frozen=True, eq=False)
class Limits:
    """Joint limits and DH offsets of a robot as arrays, shape (n,) [rad], and whether its paths close."""

    lower: np.ndarray
    upper: np.ndarray
    offset: np.ndarray
    closed: bool

    @staticmethod
    def of(robot: Robot, closed: bool) -> "Limits":
        """Return the limits of a robot along a closed or open seam."""
        lower, upper = robot.limits_rad.T
        return Limits(lower, upper, robot.dh[:, 3], closed)


def best_wrist(limits: Limits, cos_sin: Lanes, wrists: Sequence[str], need: float) -> tuple[np.ndarray, np.ndarray]:
    """Choose for each candidate the first allowed wrist that keeps a margin, or else the one that keeps most.

    Args:
        limits: of a six-axis robot.
        cos_sin: twelve arrays (m, N): cosines, then sines, of the DH angles of the noflip wrist.
        wrists: allowed wrists in order of preference.
        need: joint margin that is enough [rad].

    Returns:
        worst joint margins of the chosen wrists (m,) [rad], negative outside, and their indices (m,).
    """
    low, high = _ranges(limits, np.asarray(cos_sin))
    keeps = [_margins(limits, *_turned(limits, low, high, wrist), need).min(axis=0) for wrist in wrists]
    margins = np.stack(keeps)
    best = np.argmax(np.minimum(margins, need), axis=0)
    return margins[best, np.arange(margins.shape[1])], best


def _turned(limits: Limits, low: np.ndarray, high: np.ndarray, wrist: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the ranges (6, m) of noflip paths on the named wrist."""
    if wrist == "noflip":
        return low, high
    other_low, other_high = low.copy(), high.copy()
    other_low[3::2] += np.pi
    other_high[3::2] += np.pi
    other_low[4], other_high[4] = -high[4] - 2 * limits.offset[4], -low[4] - 2 * limits.offset[4]
    return other_low, other_high


def _margins(limits: Limits, low: np.ndarray, high: np.ndarray, need: float) -> np.ndarray:
    """Return how far ranges (6, m) stay inside the joint limits, shifted by whole turns if they must, (6, m)."""
    lower, upper = limits.lower[:, None], limits.upper[:, None]
    as_is = np.minimum(upper - high, low - lower)
    turns = 2 * np.pi * np.round((upper + lower - low - high) / (4 * np.pi))
    return np.where(as_is >= need, as_is, np.minimum(upper - high - turns, low + turns - lower))


def _ranges(limits: Limits, cos_sin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return least and greatest joint angles over paths, cos_sin (12, m, N), a closed one's way back too, (6, m)."""
    theta = np.arctan2(cos_sin[6:], cos_sin[:6])
    low, high = theta.min(axis=2), theta.max(axis=2)
    jumping = high - low > np.pi  # a path that never spans half a turn has no cut to unwrap
    if jumping.any():
        cut = theta[jumping]
        step = np.diff(cut, axis=1, append=cut[:, :1])
        turns = 2 * np.pi * np.cumsum((step < -np.pi).astype(float) - (step > np.pi), axis=1)
        end = cut[:, 0] + (turns[:, -1] if limits.closed else 0.0)
        cut[:, 1:] += turns[:, :-1]
        low[jumping], high[jumping] = np.minimum(cut.min(axis=1), end), np.maximum(cut.max(axis=1), end)
    return low - limits.offset[:, None], high - limits.offset[:, None]


def allowed(choice: str, all_: dict[str, int]) -> list[str]:
    """Return the branch names a configuration entry allows."""
    return list(all_) if choice == "any" else [choice]


def on_wrist(robot: Robot, q: np.ndarray, wrist: str) -> np.ndarray:
    """Return noflip paths on the named wrist."""
    return q if wrist == "noflip" else flip(robot, q)
