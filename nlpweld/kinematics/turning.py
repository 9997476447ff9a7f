"""Which way a positioner turns along a seam: one continuous joint path inside the limits, branch by rule."""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell.robot import Robot
from nlpweld.errors import KinematicsError
from nlpweld.kinematics.positioner import ALONG_AXIS, off_upright, one_axis, two_axes

UPRIGHT_TOLERANCE_DEG = 5.0  # the tighter tolerance of ISO 6947 for test pieces, that of the slope
LARGEST_STEP = np.pi / 2  # of a joint from one point to the next
UNIT = 1e-6  # by which a direction's length may be off 1
SLACK = 1e-9  # by which round-off may exceed a limit or a step [rad]


@dataclass(frozen=True)
class Turning:
    """A positioner's path along a seam.

    Attributes:
        q: joints, unwrapped, inside the limits, shape (M, n) [rad].
        branch: k of each point, shape (M,); 0 for a one-axis rotator.
        off_upright: angle that remains between the directions and upright, shape (M,) [rad].
    """

    q: np.ndarray
    branch: np.ndarray
    off_upright: np.ndarray


def follow(
    robot: Robot,
    e_T: np.ndarray,
    up_B: np.ndarray,
    *,
    closed: bool = False,
    start_theta: float = 0.0,
    tolerance_deg: float = UPRIGHT_TOLERANCE_DEG,
) -> Turning:
    """Return the path that keeps a direction of the table upright along a seam (Zhang et al., eq. 8 and its rule).

    A path starts on branch k = 0 and takes, at every next point, the branch whose table angle is within a right
    angle of the last. It is kept when it stays inside the joint limits and no joint steps by more than a right angle;
    otherwise the path that starts on k = 1 is tried. (The paper's test is lost; limits and step are the stand-in.)
    Where a direction is along the table axis, the table stays at the point before.

    Args:
        robot: positioner of one or two joints.
        e_T: unit directions in the table frame, in seam order, shape (M, 3).
        up_B: unit upright direction in the base frame, shape (3,).
        closed: whether the way back from the last point to the first is part of the path.
        start_theta: DH angle of the table when every direction is along its axis [rad].
        tolerance_deg: largest angle that may remain between a direction and upright [deg].

    Raises:
        KinematicsError: a direction is not of unit length; upright is along the first of two axes; a direction stays
            further from upright than the tolerance; or no branch keeps limits and steps. One line names point (from
            0), joint and angle.
    """
    e_T, up_B = np.asarray(e_T, dtype=float), np.asarray(up_B, dtype=float)
    _refuse_other_than_unit(robot, e_T)
    e = np.concatenate([e_T, e_T[:1]]) if closed else e_T
    found = [_fitted(robot, q, k) for q, k in _paths(robot, e, up_B, start_theta)]
    q, branch, _ = next((path for path in found if not path[2]), found[0])
    remaining = off_upright(robot, q, e, up_B)
    _refuse_far_from_upright(robot, remaining, tolerance_deg)
    if all(complaint for *_, complaint in found):
        raise KinematicsError("; other branch: ".join(dict.fromkeys(path[2] for path in found)))
    return Turning(q[: len(e_T)], branch[: len(e_T)], remaining[: len(e_T)])


def _paths(robot: Robot, e: np.ndarray, up_B: np.ndarray, start_theta: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the unwrapped paths to try, joints (M, n) and branch (M,), in order of preference."""
    if len(robot.joints) == 1:
        q, free = one_axis(robot).joints(e, up_B)
        held = _held(q[:, 0], free, start_theta - robot.dh[0, 3])
        return [(np.unwrap(held)[:, None], np.zeros(len(e), dtype=int))]
    axes = two_axes(robot)
    if np.hypot(up_B[0], up_B[1]) <= ALONG_AXIS:
        raise KinematicsError(
            f"positioner '{robot.name}': upright is along axis 1, which then tilts nothing; mount it with axis 1 level "
            "or oblique"
        )
    by_branch, free = np.array([axes.table(e, up_B, k)[0] for k in (0, 1)]), axes.table(e, up_B, 0)[1]
    paths = []
    for k in (0, 1):
        branch = _nearest_branch(by_branch, free, k)
        theta2 = _held(np.take_along_axis(by_branch, branch[None], axis=0)[0], free, start_theta)
        theta = np.stack([axes.tilt(e, up_B, theta2), theta2], axis=-1)
        paths.append((np.unwrap(theta, axis=0) - axes.offset, branch))
    return paths


def _nearest_branch(by_branch: np.ndarray, free: np.ndarray, start: int) -> np.ndarray:
    """Return the branch of each point that starts on one and then keeps the table's steps within a right angle.

    Args:
        by_branch: table angles on both branches, shape (2, M) [rad].
        free: where the table angle is free; such points keep the branch before them, shape (M,).
        start: branch of the first point.
    """
    branch = np.full(len(free), start)
    bound = np.flatnonzero(~free)
    stays = np.abs(_wrapped(np.diff(by_branch[:, bound]))) <= LARGEST_STEP + SLACK
    for i in np.flatnonzero(~stays.all(axis=0)):
        now = branch[bound[i]]
        if not stays[now, i]:
            branch[bound[i + 1] :] = 1 - now
    return branch


def _held(angle: np.ndarray, free: np.ndarray, start: float) -> np.ndarray:
    """Return angles with free ones held at the last bound one; leading ones at the first, and all-free at start."""
    if free.all():
        return np.full(len(angle), start)
    last = np.maximum.accumulate(np.where(free, -1, np.arange(len(angle))))
    return angle[np.where(last < 0, np.flatnonzero(~free)[0], last)]


def _fitted(robot: Robot, q: np.ndarray, branch: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """Return a path shifted by turns into the limits, its branches, and what is wrong with it, if anything."""
    limits = robot.limits_rad
    middle = (q.min(axis=0) + q.max(axis=0)) / 2
    q = q + 2 * np.pi * np.round((limits.mean(axis=1) - middle) / (2 * np.pi))
    for joint, ((low, high), path) in enumerate(zip(limits, q.T, strict=True), start=1):
        steps = np.abs(np.diff(path))
        if steps.size and steps.max() > LARGEST_STEP + SLACK:
            i = int(np.flatnonzero(steps > LARGEST_STEP + SLACK)[0])
            turn = f"by {np.degrees(steps[i]):.4g} deg from point {i} to the next"
            return q, branch, _complaint(robot, i + 1, f"joint {joint} would turn {turn}; put points closer there")
        beyond = np.maximum(low - path, path - high)
        if beyond.max() > SLACK:
            i = int(beyond.argmax())
            span = f"{np.degrees(low):g} to {np.degrees(high):g} deg"
            what = f"joint {joint} would stand at {np.degrees(path[i]):.4g} deg, outside {span}; turn the workpiece"
            return q, branch, _complaint(robot, i, what)
    return q, branch, ""


def _complaint(robot: Robot, point: int, what: str) -> str:
    return f"positioner '{robot.name}': point {point}: {what}"


def _refuse_other_than_unit(robot: Robot, e_T: np.ndarray) -> None:
    wrong = ~(np.abs(np.linalg.norm(e_T, axis=-1) - 1) < UNIT)
    if wrong.any():
        i = int(np.flatnonzero(wrong)[0])
        raise KinematicsError(_complaint(robot, i, f"direction {e_T[i].tolist()} is not of unit length; scale it"))


def _refuse_far_from_upright(robot: Robot, remaining: np.ndarray, tolerance_deg: float) -> None:
    worst = int(remaining.argmax())
    if not remaining[worst] <= np.radians(tolerance_deg):
        text = f"weld stays {np.degrees(remaining[worst]):.4g} deg from upright, above {tolerance_deg:g} deg"
        raise KinematicsError(_complaint(robot, worst, f"{text}; mount the workpiece otherwise or use two axes"))


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Return angles brought into (-pi, pi]."""
    return np.pi - (np.pi - angle) % (2 * np.pi)
