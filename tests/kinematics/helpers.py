"""Chains multiplied out in NumPy, apart from the package, and the inverse over many poses at once."""

import casadi as ca
import numpy as np

from nlpweld.cell import Robot, library_names, load_robot
from nlpweld.kinematics.chain import Chain
from nlpweld.kinematics.ik import signs, spherical_arm

ROBOTS = [load_robot(name) for name in library_names("robots")]
NAMES = [robot.name for robot in ROBOTS]


def turn(axis: str, angle: np.ndarray) -> np.ndarray:
    """Return rotations about an axis, shape (m, 4, 4), for angles (m,) [rad]."""
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T = np.tile(np.eye(4), (len(angle), 1, 1))
    T[:, i, i] = T[:, j, j] = np.cos(angle)
    T[:, j, i], T[:, i, j] = np.sin(angle), -np.sin(angle)
    return T


def shift(axis: str, length: float, m: int) -> np.ndarray:
    """Return m times the translation by a length [m] along an axis, shape (m, 4, 4)."""
    T = np.tile(np.eye(4), (m, 1, 1))
    T[:, "xyz".index(axis), 3] = length
    return T


def link_frames(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return the frames of base to flange for joints q (m, n) in DH direction, shape (n + 1, m, 4, 4)."""
    m, frames = len(q), [np.tile(np.eye(4), (len(q), 1, 1))]
    for joint, angle in zip(robot.joints, q.T, strict=True):
        step = turn("z", angle + np.radians(joint.offset_deg)) @ shift("z", joint.d_m, m) @ shift("x", joint.a_m, m)
        frames.append(frames[-1] @ step @ turn("x", np.full(m, np.radians(joint.alpha_deg))))
    return np.array(frames)


def flange(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return ``Chain.fk`` for joints q (m, n), shape (m, 4, 4)."""
    T = np.array(Chain(robot).fk.map(len(q))(q.T))
    return T.reshape(4, len(q), 4).transpose(1, 0, 2)


def inverse(robot: Robot, T: np.ndarray, branch: tuple[str, str, str]) -> tuple[np.ndarray, np.ndarray]:
    """Return joints (m, 6) and reach (m,) of poses T (m, 4, 4) on one branch."""
    side = np.tile(np.array(signs(branch), dtype=float)[:, None], len(T))
    q, reach = spherical_arm(robot).function.map(len(T))(ca.DM(np.hstack(T)), side)
    return np.array(q).T, np.array(reach).ravel()


def between_limits(robot: Robot, m: int, seed: int) -> np.ndarray:
    """Return m random joint vectors inside the limits, shape (m, n) [rad]."""
    lower, upper = robot.limits_rad.T
    return np.random.default_rng(seed).uniform(lower, upper, (m, len(lower)))


def error_of(T_a: np.ndarray, T_b: np.ndarray) -> np.ndarray:
    """Return the largest difference between entries of poses, shape (m,)."""
    return np.abs(T_a - T_b).max(axis=(1, 2))


def wrapped(angle: np.ndarray) -> np.ndarray:
    """Return angles in [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def elbow_and_radius(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the elbow factor and the signed distance of the wrist centre from axis 1, each (m,) [m]."""
    (a1, a2, a3), d4 = robot.dh[:3, 0], robot.dh[3, 1]
    t2, t3 = (q[:, 1:3] + robot.dh[1:3, 3]).T
    elbow = d4 * np.cos(t3) + a3 * np.sin(t3)
    return elbow, a1 + a2 * np.cos(t2) + a3 * np.cos(t2 + t3) - d4 * np.sin(t2 + t3)


def stretched(robot: Robot) -> float:
    """Return the angle of joint 3 at which elbow and wrist centre are in line with the shoulder [rad]."""
    return float(np.arctan2(-robot.dh[3, 1], robot.dh[2, 0]) - robot.dh[2, 3])


def shoulder_for_radius(robot: Robot, q3: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return the angle of joint 2 that brings the wrist centre to a signed distance from axis 1 [rad]."""
    (a1, a2, a3), d4 = robot.dh[:3, 0], robot.dh[3, 1]
    t3 = q3 + robot.dh[2, 3]
    along, across = a2 + a3 * np.cos(t3) - d4 * np.sin(t3), -a3 * np.sin(t3) - d4 * np.cos(t3)
    return np.arccos((radius - a1) / np.hypot(along, across)) + np.arctan2(across, along) - robot.dh[1, 3]


def with_joint(robot: Robot, number: int, **fields: float) -> Robot:
    """Return a copy of a robot with some fields of one joint, counted from 1, replaced."""
    joints = list(robot.joints)
    joints[number - 1] = joints[number - 1].model_copy(update=fields)
    return robot.model_copy(update={"joints": tuple(joints)})
