"""Positioners as chains, and the closed-form inverse that turns a direction of the table upright.

A positioner is a :class:`~nlpweld.cell.robot.Robot` of one or two joints, so that ``Chain`` gives its forward
kinematics. Its table frame {T} is the last link's. Zhang et al., eq. (6), reads ``Ry(theta1) Rx(pi) Rz(theta2)`` with
d2 along z_T; that is ``Rx(-90 deg)``, then the rows (d 0, alpha -90 deg) and (d d2, alpha 0). The constant turn makes
the base frame {B} lie on its side and goes into the station's ``base_rpy_deg``.

A branch is k = 0 or 1: the wrist-like choice of eq. (8). Upright, k = 0 has sin(theta1) <= 0 and k = 1 the other sign.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.robot import Robot
from nlpweld.errors import KinematicsError

BASE_RPY_DEG = (-90.0, 0.0, 0.0)  # of {B} in the frame {PB} of Zhang et al., whose z is up
ALONG_AXIS = 1e-12  # sine between a direction and the table axis under which the table's angle is taken as free
TINY = 1e-24  # squared length under which a direction is taken as undefined


def up_in_base(R_W_B: np.ndarray) -> np.ndarray:
    """Return the upright direction z_W in a base frame that stands at R_W_B (3, 3), shape (3,)."""
    return np.asarray(R_W_B, dtype=float)[2]


def link_poses(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return T_B_L of link 0 (the base) to link n (the table), shape (M, n + 1, 4, 4); ``Chain.links`` in NumPy.

    Args:
        robot: the positioner.
        q: joints, shape (M, n) [rad].
    """
    T = [np.tile(np.eye(4), (len(q), 1, 1))]
    for (a, d, alpha, offset), angle in zip(robot.dh, q.T, strict=True):
        c, s, ca_, sa_ = np.cos(angle + offset), np.sin(angle + offset), np.cos(alpha), np.sin(alpha)
        o, i = np.zeros_like(c), np.ones_like(c)
        rows = [
            [c, -s * ca_, s * sa_, a * c],
            [s, c * ca_, -c * sa_, a * s],
            [o, o + sa_, o + ca_, o + d],
            [o, o, o, i],
        ]
        T.append(T[-1] @ np.moveaxis(np.array(rows), -1, 0))
    return np.stack(T, axis=1)


def table_poses(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return T_B_T, the last link's pose, for joints q (M, n) [rad], shape (M, 4, 4)."""
    return link_poses(robot, q)[:, -1]


def off_upright(robot: Robot, q: np.ndarray, e_T: np.ndarray, up_B: np.ndarray) -> np.ndarray:
    """Return the angles between directions of the table, turned by joints q, and upright.

    Args:
        robot: the positioner.
        q: joints, shape (M, n) [rad].
        e_T: unit directions in the table frame, shape (M, 3).
        up_B: unit upright direction in the base frame, shape (3,).

    Returns:
        Angles in [0, pi], shape (M,) [rad].
    """
    turned = np.einsum("mij,mj->mi", table_poses(robot, q)[:, :3, :3], e_T)
    return np.arctan2(np.linalg.norm(np.cross(turned, up_B), axis=-1), turned @ up_B)


@dataclass(frozen=True)
class TwoAxes:
    """The directions of a two-axis positioner: ``R_B_T = Rz(theta1) Rx(alpha1) Rz(theta2) Rx(alpha2)``.

    Attributes:
        alpha: twists of both rows [rad]; the first is not a multiple of pi.
        offset: offsets of both rows, theta = q + offset [rad].
    """

    alpha: tuple[float, float]
    offset: tuple[float, float]

    def table(self, e_T: np.ndarray, up_B: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return theta2 on a branch, and where it is free (Zhang et al., eq. 8, for any upright direction).

        With w = Rz(theta2) Rx(alpha2) e, the height along axis 1 is ``sin(alpha1) w_y + cos(alpha1) w_z = u_z``, which
        theta2 alone decides. Out of reach it is brought as near as it goes.

        Args:
            e_T: unit directions in the table frame, shape (M, 3).
            up_B: unit upright direction in the base frame, shape (3,).
            k: branch, 0 or 1.

        Returns:
            theta2, shape (M,) [rad], and whether e is along the table axis, shape (M,).
        """
        e = _about_x(self.alpha[1], e_T)
        radius = np.hypot(e[:, 0], e[:, 1])
        free = radius <= ALONG_AXIS
        height = (up_B[2] - np.cos(self.alpha[0]) * e[:, 2]) / (np.sin(self.alpha[0]) * np.where(free, 1.0, radius))
        sine = np.clip(np.where(free, 0.0, height), -1.0, 1.0)
        cosine = np.sqrt((1 - sine) * (1 + sine)) * (1 - 2 * k)
        return np.arctan2(sine, cosine) - np.arctan2(e[:, 1], e[:, 0]), free

    def tilt(self, e_T: np.ndarray, up_B: np.ndarray, theta2: np.ndarray) -> np.ndarray:
        """Return theta1 that turns a direction upright once the table stands at theta2, shape (M,) [rad]."""
        e = _about_x(self.alpha[1], e_T)
        c, s = np.cos(theta2), np.sin(theta2)
        w = _about_x(self.alpha[0], np.stack([c * e[:, 0] - s * e[:, 1], s * e[:, 0] + c * e[:, 1], e[:, 2]], axis=-1))
        along, across = w[:, 0] * up_B[0] + w[:, 1] * up_B[1], w[:, 0] * up_B[1] - w[:, 1] * up_B[0]
        return np.arctan2(across, along)

    def joints(self, e_T: np.ndarray, up_B: np.ndarray, k: int, free_theta2: float = 0.0) -> np.ndarray:
        """Return joints q on a branch, shape (M, 2) [rad], each in (-pi, pi].

        Args:
            e_T: unit directions in the table frame, shape (M, 3).
            up_B: unit upright direction in the base frame, shape (3,).
            k: branch, 0 or 1.
            free_theta2: DH angle of the table where e is along its axis [rad].
        """
        theta2, free = self.table(e_T, up_B, k)
        theta2 = np.where(free, free_theta2, theta2)
        theta = np.stack([self.tilt(e_T, up_B, theta2), theta2], axis=-1) - self.offset
        return np.pi - (np.pi - theta) % (2 * np.pi)

    def room(self, e_T: np.ndarray, up_B: np.ndarray) -> np.ndarray:
        """Return how far directions are inside what can be brought upright, shape (M,) [rad]; negative out of reach.

        That is what stands between two angles off the table axis, by the triangle of both axes and upright; 0 and 180
        degrees where axis 1 is level and square to axis 2. At either both branches meet and joints turn ever faster.

        Args:
            e_T: unit directions in the table frame, shape (M, 3).
            up_B: unit upright direction in the base frame, shape (3,).
        """
        e = _about_x(self.alpha[1], e_T)
        off = np.arctan2(np.hypot(e[:, 0], e[:, 1]), e[:, 2])
        between = np.arccos(np.cos(self.alpha[0]))
        up = np.arctan2(np.hypot(up_B[0], up_B[1]), up_B[2])
        return np.minimum(off - abs(between - up), np.pi - abs(np.pi - between - up) - off)

    def solve(self, e_T: ca.SX, up_B: ca.SX, branch: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Return cosines and sines of the DH angles, and reach, in CasADi, free of trigonometry.

        Where e is along the table axis theta2 is taken as 0 or pi; at that point the graph has no derivative.

        Args:
            e_T: unit direction in the table frame, shape (3, 1).
            up_B: unit upright direction in the base frame, shape (3, 1).
            branch: +1 for k = 0, -1 for k = 1.

        Returns:
            Cosines (2, 1), sines (2, 1), and 1 - sin^2 of the table's turn: negative when upright is out of reach.
        """
        e = _rotation_x(self.alpha[1]) @ e_T
        square = e[0] ** 2 + e[1] ** 2
        off_axis, radius = square > TINY, ca.sqrt(ca.fmax(square, TINY))
        height = (up_B[2] - np.cos(self.alpha[0]) * e[2]) / (np.sin(self.alpha[0]) * radius)
        sine = ca.if_else(off_axis, ca.fmax(ca.fmin(height, 1), -1), 0)
        cosine = branch * ca.sqrt(ca.fmax(1 - sine**2, TINY))
        ce, se = ca.if_else(off_axis, e[0] / radius, 1), ca.if_else(off_axis, e[1] / radius, 0)
        c2, s2 = cosine * ce + sine * se, sine * ce - cosine * se
        w = _rotation_x(self.alpha[0]) @ ca.vertcat(c2 * e[0] - s2 * e[1], s2 * e[0] + c2 * e[1], e[2])
        along, across = w[0] * up_B[0] + w[1] * up_B[1], w[0] * up_B[1] - w[1] * up_B[0]
        scale = 1 / ca.sqrt(ca.fmax(along**2 + across**2, TINY))
        return ca.vertcat(along * scale, c2), ca.vertcat(across * scale, s2), 1 - height**2


@dataclass(frozen=True)
class OneAxis:
    """The directions of a one-axis rotator: ``R_B_T = Rz(theta) Rx(alpha)``."""

    alpha: float
    offset: float

    def joints(self, e_T: np.ndarray, up_B: np.ndarray, free_theta: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Return joints q that bring directions as near to upright as one axis can, and where q is free.

        Args:
            e_T: unit directions in the table frame, shape (M, 3).
            up_B: unit upright direction in the base frame, shape (3,); along the axis itself every q is as good.
            free_theta: DH angle where e is along the axis [rad].

        Returns:
            q, shape (M, 1) [rad], in (-pi, pi], and whether it is free, shape (M,).
        """
        e = _about_x(self.alpha, e_T)
        free = (np.hypot(e[:, 0], e[:, 1]) <= ALONG_AXIS) | (np.hypot(up_B[0], up_B[1]) <= ALONG_AXIS)
        along, across = e[:, 0] * up_B[0] + e[:, 1] * up_B[1], e[:, 0] * up_B[1] - e[:, 1] * up_B[0]
        theta = np.where(free, free_theta, np.arctan2(across, along)) - self.offset
        return (np.pi - (np.pi - theta) % (2 * np.pi))[:, None], free


def two_axes(robot: Robot) -> TwoAxes:
    """Return the closed-form inverse of a two-axis positioner.

    Raises:
        KinematicsError: the robot does not have two joints, or its axes are parallel.
    """
    if len(robot.joints) != 2:
        raise KinematicsError(f"positioner '{robot.name}': has {len(robot.joints)} joints; this inverse needs two")
    (_, _, first, _), (_, _, second, _) = robot.dh
    if abs(np.sin(first)) <= ALONG_AXIS:
        raise KinematicsError(
            f"positioner '{robot.name}': joints.1.alpha_deg is {np.degrees(first):g}, so its axes are parallel and "
            "tilt nothing; give another angle between them"
        )
    return TwoAxes((first, second), tuple(robot.dh[:, 3]))


def one_axis(robot: Robot) -> OneAxis:
    """Return the inverse of a one-axis rotator.

    Raises:
        KinematicsError: the robot does not have just one joint.
    """
    if len(robot.joints) != 1:
        raise KinematicsError(f"positioner '{robot.name}': has {len(robot.joints)} joints; this inverse needs one")
    return OneAxis(float(robot.dh[0, 2]), float(robot.dh[0, 3]))


def _about_x(angle: float, v: np.ndarray) -> np.ndarray:
    """Return vectors (M, 3) turned about x."""
    c, s = np.round([np.cos(angle), np.sin(angle)], 15)  # right angles exactly, as in chain.dh_frame
    return np.stack([v[:, 0], c * v[:, 1] - s * v[:, 2], s * v[:, 1] + c * v[:, 2]], axis=-1)


def _rotation_x(angle: float) -> ca.DM:
    c, s = (float(np.round(f(angle), 15)) for f in (np.cos, np.sin))
    return ca.DM([[1, 0, 0], [0, c, -s], [0, s, c]])
