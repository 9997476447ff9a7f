"""Closed-form inverse kinematics of a 6R arm with a spherical wrist, free of trigonometry, branch explicit.

The arm is the usual industrial one: DH rows a = (a1, a2, a3, 0, 0, 0), d = (d1, 0, 0, d4, 0, d6),
alpha = (-90, 0, -90, 90, -90, 0) deg. Cosines and sines of the DH angles come out; nothing calls atan2.
A branch is three signs: shoulder +1 front / -1 back, elbow +1 up / -1 down, wrist +1 noflip / -1 flip.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import casadi as ca
import numpy as np

from nlpweld.cell.robot import Robot
from nlpweld.errors import KinematicsError
from nlpweld.kinematics.chain import Frame

SHOULDER, ELBOW, WRIST = {"front": 1, "back": -1}, {"up": 1, "down": -1}, {"noflip": 1, "flip": -1}
BRANCHES = tuple(product(SHOULDER, ELBOW, WRIST))
TINY = 1e-24  # squared length or sine under which a direction is taken as undefined


@dataclass(frozen=True)
class Solution:
    """What the inverse gives for one pose and branch.

    Attributes:
        cos: cosines of the DH angles, shape (6, 1).
        sin: sines of the DH angles, shape (6, 1).
        reach: squared sine of the elbow's opening, 1 - A^2/L^2: negative when the pose is out of reach.
        elbow: signed elbow factor B = d4 cos(theta3) + a3 sin(theta3) [m].
        radius: signed distance of the wrist centre from axis 1 [m].
    """

    cos: ca.SX
    sin: ca.SX
    reach: ca.SX
    elbow: ca.SX
    radius: ca.SX


@dataclass(frozen=True)
class SphericalArm:
    """The lengths [m] of a 6R arm with a spherical wrist."""

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d6: float
    offsets: tuple[float, ...]

    def solve(self, T_B_F: Frame, branch: ca.SX) -> Solution:
        """Return the joint solution that puts the flange at a pose.

        Out of reach the arm points, stretched, at the wrist centre, so that graphs stay finite and smooth.

        Args:
            T_B_F: flange pose in the base frame.
            branch: signs of shoulder, elbow, wrist, shape (3, 1).
        """
        wrist = T_B_F.p - self.d6 * T_B_F.R[:, 2]
        radius, c1, s1 = _polar(wrist[0], wrist[1], branch[0])
        x, z = radius - self.a1, wrist[2] - self.d1
        reach, elbow, (c2, s2), (c3, s3) = self._two_links(x, z, branch[1])
        c23, s23 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
        R_3_F = _rotation_to_forearm(c1, s1, c23, s23).T @ T_B_F.R
        (c4, s4), (c5, s5), (c6, s6) = _wrist(R_3_F, branch[2])
        return Solution(ca.vertcat(c1, c2, c3, c4, c5, c6), ca.vertcat(s1, s2, s3, s4, s5, s6), reach, elbow, radius)

    def _two_links(self, x: ca.SX, z: ca.SX, sign: ca.SX) -> tuple[ca.SX, ca.SX, tuple, tuple]:
        """Solve the planar pair of upper arm a2 and forearm (a3, d4) for the wrist centre (x, z)."""
        length_sq = self.a3**2 + self.d4**2
        distance_sq = x**2 + z**2
        along = (distance_sq - self.a2**2 - length_sq) / (2 * self.a2)  # A = a3 c3 - d4 s3
        reach = 1 - along**2 / length_sq
        a = ca.fmax(ca.fmin(along, np.sqrt(length_sq)), -np.sqrt(length_sq))
        b = sign * ca.sqrt(ca.fmax(length_sq - a**2, TINY))
        c3, s3 = (self.a3 * a + self.d4 * b) / length_sq, (self.a3 * b - self.d4 * a) / length_sq
        u = self.a2 + a
        scale = 1 / ca.sqrt(ca.fmax(distance_sq * (u**2 + b**2), TINY))
        c2, s2 = (x * u - z * b) * scale, (-z * u - x * b) * scale
        return reach, b, (c2, s2), (c3, s3)

    def abs_det_jacobian(self, solution: Solution) -> ca.SX:
        """Return the manipulability |det J| [m^3] in closed form; tools and grasps do not change it."""
        return self.a2 * ca.fabs(solution.elbow) * ca.fabs(solution.radius) * ca.fabs(solution.sin[4])

    @cached_property
    def function(self) -> ca.Function:
        """``ik(T_B_F, branch) -> q, reach`` with q + offset (6, 1) [rad] in (-pi, pi]; for output, not graphs."""
        T, branch = ca.SX.sym("T", 4, 4), ca.SX.sym("branch", 3)
        found = self.solve(Frame(T[:3, :3], T[:3, 3]), branch)
        q = ca.atan2(found.sin, found.cos) - ca.SX(np.array(self.offsets))
        return ca.Function("ik", [T, branch], [q, found.reach], ["T_B_F", "branch"], ["q", "reach"])


def spherical_arm(robot: Robot) -> SphericalArm:
    """Return the closed-form arm of a robot.

    Raises:
        KinematicsError: the robot does not have six joints in the usual order with a spherical wrist.
    """
    dh = robot.dh
    if len(dh) != 6:
        raise KinematicsError(f"robot '{robot.name}': has {len(dh)} joints; the closed-form inverse needs six")
    for joint, column, what in ((4, 0, "a_m"), (5, 0, "a_m"), (6, 0, "a_m"), (5, 1, "d_m")):
        if dh[joint - 1, column] != 0.0:
            raise KinematicsError(
                f"robot '{robot.name}': joints.{joint}.{what} is {dh[joint - 1, column]:g}, so its wrist is not "
                "spherical; the closed-form inverse needs 0 there, axes 4, 5 and 6 meeting in one point"
            )
    turns = np.array([-90, 0, -90, 90, -90, 0])
    if not np.allclose(np.degrees(dh[:, 2]), turns) or dh[1, 1] != 0.0 or dh[2, 1] != 0.0:
        raise KinematicsError(
            f"robot '{robot.name}': joints: the closed-form inverse needs alpha_deg {turns.tolist()} "
            "and d_m 0 in joints 2 and 3"
        )
    if dh[1, 0] <= 0.0 or np.hypot(dh[2, 0], dh[3, 1]) == 0.0:
        raise KinematicsError(
            f"robot '{robot.name}': joints: upper arm (a_m of joint 2) and forearm need a positive length"
        )
    a, d = dh[:, 0], dh[:, 1]
    return SphericalArm(d[0], a[0], a[1], a[2], d[3], d[5], tuple(dh[:, 3]))


def signs(branch: tuple[str, str, str]) -> tuple[int, int, int]:
    """Return the three signs of a named branch (shoulder, elbow, wrist)."""
    return SHOULDER[branch[0]], ELBOW[branch[1]], WRIST[branch[2]]


def _polar(x: ca.SX, y: ca.SX, sign: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return signed radius, cosine and sine; on the axis itself the angle is zero."""
    square = x**2 + y**2
    radius = sign * ca.sqrt(ca.fmax(square, TINY))
    off_axis = square > TINY
    return radius, ca.if_else(off_axis, x / radius, 1), ca.if_else(off_axis, y / radius, 0)


def _rotation_to_forearm(c1: ca.SX, s1: ca.SX, c23: ca.SX, s23: ca.SX) -> ca.SX:
    """Return R_B_3 from joint 1 and the sum of joints 2 and 3."""
    zero = ca.SX(1, 1)
    return ca.vertcat(
        ca.horzcat(c1 * c23, s1, -c1 * s23), ca.horzcat(s1 * c23, -c1, -s1 * s23), ca.horzcat(-s23, zero, -c23)
    )


def _wrist(R: ca.SX, sign: ca.SX) -> tuple[tuple, tuple, tuple]:
    """Solve R = Rz(theta4) Ry(-theta5) Rz(theta6); joint 6 follows joint 4, so the pose is exact even when singular."""
    square = R[0, 2] ** 2 + R[1, 2] ** 2
    scale = sign / ca.sqrt(ca.fmax(square, TINY))
    bent = square > TINY
    c4, s4 = ca.if_else(bent, -R[0, 2] * scale, 1), ca.if_else(bent, -R[1, 2] * scale, 0)
    five = (R[2, 2], -(c4 * R[0, 2] + s4 * R[1, 2]))
    six = (c4 * R[1, 1] - s4 * R[0, 1], c4 * R[1, 0] - s4 * R[0, 0])
    return (c4, s4), five, six
