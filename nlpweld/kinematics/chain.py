"""A serial chain from its Denavit-Hartenberg rows to forward kinematics and geometric Jacobian, in CasADi."""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from nlpweld.cell.robot import Robot


@dataclass(frozen=True)
class Frame:
    """A pose as rotation (3, 3) and origin (3, 1), CasADi SX or DM."""

    R: ca.SX
    p: ca.SX

    def __matmul__(self, other: "Frame") -> "Frame":
        """Compose: ``T_a_b @ T_b_c = T_a_c``."""
        return Frame(self.R @ other.R, self.R @ other.p + self.p)

    def inverse(self) -> "Frame":
        """Return T_b_a of T_a_b."""
        return Frame(self.R.T, -(self.R.T @ self.p))

    def point(self, p: tuple[float, float, float] | ca.SX) -> ca.SX:
        """Return in frame a a point given in frame b, shape (3, 1)."""
        return self.R @ ca.SX(ca.DM(p) if isinstance(p, tuple) else p) + self.p


def constant(T: np.ndarray) -> Frame:
    """Return a numeric pose (4, 4) as a Frame, with round-off zeros and ones made exact so that graphs stay sparse."""
    snapped = np.where(np.abs(T - np.round(T)) < 1e-15, np.round(T), T)
    return Frame(ca.sparsify(ca.SX(snapped[:3, :3])), ca.SX(snapped[:3, 3]))


def rpy_pose(translation_m: tuple[float, float, float], rpy_deg: tuple[float, float, float]) -> np.ndarray:
    """Return the pose ``Trans(t) Rz(yaw) Ry(pitch) Rx(roll)``, shape (4, 4)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(np.radians(rpy_deg)), np.sin(np.radians(rpy_deg))
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rz @ ry @ rx, translation_m
    return T


@dataclass(frozen=True)
class Chain:
    """A robot's joints as symbolic functions.

    Angles come either as q (n, 1) [rad] or, to stay free of trigonometry, as cosines and sines of the
    DH angles theta = q + offset.
    """

    robot: Robot

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.robot.joints)

    def cos_sin(self, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return cosines and sines of the DH angles, shapes (n, 1)."""
        theta = q + ca.SX(self.robot.dh[:, 3])
        return ca.cos(theta), ca.sin(theta)

    def links(self, cos: ca.SX, sin: ca.SX, base: Frame | None = None) -> list[Frame]:
        """Return the frames of link 0 (the base) to link n (the flange).

        Args:
            cos: cosines of the DH angles, shape (n, 1).
            sin: sines of the DH angles, shape (n, 1).
            base: pose of the base; frames come out in the frame it is given in. Identity by default.
        """
        frames = [base or constant(np.eye(4))]
        for i, row in enumerate(self.robot.dh):
            frames.append(frames[-1] @ dh_frame(row, cos[i], sin[i]))
        return frames

    @cached_property
    def fk(self) -> ca.Function:
        """``fk(q) -> T_B_F`` with q (n, 1) [rad] and the flange pose (4, 4) in the base frame."""
        q = ca.SX.sym("q", self.n)
        flange = self.links(*self.cos_sin(q))[-1]
        T = ca.vertcat(ca.horzcat(flange.R, flange.p), ca.DM([[0, 0, 0, 1]]))
        return ca.Function("fk", [q], [ca.densify(T)], ["q"], ["T_B_F"])

    @cached_property
    def jacobian(self) -> ca.Function:
        """``jacobian(q, p_F) -> J`` (6, n), geometric, rows (v; omega), at the point p_F (3, 1) of the flange [m]."""
        q, p_F = ca.SX.sym("q", self.n), ca.SX.sym("p_F", 3)
        links = self.links(*self.cos_sin(q))
        linear, angular = jacobian_of(links, links[-1].point(p_F))
        return ca.Function("jacobian", [q, p_F], [ca.densify(ca.vertcat(linear, angular))], ["q", "p_F"], ["J"])


def dh_frame(row: np.ndarray, cos: ca.SX, sin: ca.SX) -> Frame:
    """Return ``Rz(theta) Tz(d) Tx(a) Rx(alpha)`` for a row (a, d, alpha, offset) and cos, sin of theta."""
    a, d, alpha, _ = row
    ca_, sa_ = (float(np.round(f(alpha), 15)) for f in (np.cos, np.sin))
    rot_x = ca.sparsify(ca.SX([[1, 0, 0], [0, ca_, -sa_], [0, sa_, ca_]]))
    rot_z = ca.SX(3, 3)
    rot_z[0, 0], rot_z[0, 1], rot_z[1, 0], rot_z[1, 1], rot_z[2, 2] = cos, -sin, sin, cos, 1
    return Frame(rot_z @ rot_x, ca.vertcat(a * cos, a * sin, d))


def jacobian_of(links: list[Frame], tcp: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the linear and angular geometric Jacobian of a point carried by the last link, each (3, n)."""
    axes = [link.R[:, 2] for link in links[:-1]]
    linear = [ca.cross(z, tcp - link.p) for z, link in zip(axes, links[:-1], strict=True)]
    return ca.horzcat(*linear), ca.horzcat(*axes)
