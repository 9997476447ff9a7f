"""Manipulability and velocity ellipsoid of a spherical arm at a flange pose, arranged for enclosures over boxes.

The numbers are those of the stage (:mod:`nlpweld.formulation.stage`) wherever the pose is within reach, and mean
nothing elsewhere. Enclosures grow with every place a variable turns up in, so everything here is written in the arm's
own plane, which turns with joint 1: x radial, y normal, z up. There a pose needs few operations, and the ellipsoid is
a sum of squares without differences of large numbers. On `three_er16` enclosures of the objective come out some 25
times as tight as those of the stage's own graphs, on the cells with a positioner five times.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import casadi as ca

from nlpweld.kinematics.chain import Frame
from nlpweld.kinematics.ik import SphericalArm

NORMAL = ca.vertcat(0, 1, 0)
UP = ca.vertcat(0, 0, 1)


@dataclass(frozen=True)
class PlanarArm:
    """One arm at a pose on one branch.

    Attributes:
        arm: its lengths.
        T_B_F: flange pose in the base frame, within reach.
        p_B_E: TCP in the base frame [m], shape (3, 1).
        signs: shoulder, elbow and wrist, shape (3, 1); see :mod:`nlpweld.kinematics.ik`.
    """

    arm: SphericalArm
    T_B_F: Frame
    p_B_E: ca.SX
    signs: ca.SX

    @cached_property
    def _wrist(self) -> ca.SX:
        return self.T_B_F.p - self.arm.d6 * self.T_B_F.R[:, 2]

    @cached_property
    def radius(self) -> ca.SX:
        """Signed distance of the wrist centre from axis 1 [m]."""
        return self.signs[0] * ca.sqrt(self._wrist[0] ** 2 + self._wrist[1] ** 2)

    @cached_property
    def first(self) -> tuple[ca.SX, ca.SX]:
        """Cosine and sine of DH angle 1."""
        return self._wrist[0] / self.radius, self._wrist[1] / self.radius

    def _in_plane(self, v: ca.SX) -> ca.SX:
        """Return a vector of the base frame in the arm's plane."""
        c, s = self.first
        return ca.vertcat(c * v[0] + s * v[1], c * v[1] - s * v[0], v[2])

    @cached_property
    def _upper(self) -> ca.SX:
        """From axis 2 to the wrist centre."""
        return ca.vertcat(self.radius - self.arm.a1, 0, self._wrist[2] - self.arm.d1)

    @cached_property
    def _distance_sq(self) -> ca.SX:
        return self._upper[0] ** 2 + self._upper[2] ** 2

    @property
    def _length_sq(self) -> float:
        return self.arm.a3**2 + self.arm.d4**2

    @cached_property
    def _along(self) -> ca.SX:
        return (self._distance_sq - self.arm.a2**2 - self._length_sq) / (2 * self.arm.a2)

    @cached_property
    def reach(self) -> ca.SX:
        """Squared sine of the elbow's opening, negative out of reach."""
        return 1 - self._along**2 / self._length_sq

    @cached_property
    def elbow(self) -> ca.SX:
        """Signed elbow factor [m]."""
        return self.signs[1] * ca.sqrt(self._length_sq - self._along**2)

    @cached_property
    def second(self) -> tuple[ca.SX, ca.SX]:
        """Cosine and sine of DH angle 2; what scales them is the squared distance, for the triangle closes."""
        (x, _, z), u = ca.vertsplit(self._upper), self.arm.a2 + self._along
        return (x * u - z * self.elbow) / self._distance_sq, -(z * u + x * self.elbow) / self._distance_sq

    @cached_property
    def third(self) -> tuple[ca.SX, ca.SX]:
        """Cosine and sine of DH angle 3."""
        arm, a, b = self.arm, self._along, self.elbow
        return (arm.a3 * a + arm.d4 * b) / self._length_sq, (arm.a3 * b - arm.d4 * a) / self._length_sq

    @cached_property
    def fifth(self) -> tuple[ca.SX, ca.SX]:
        """Cosine and sine of DH angle 5."""
        return ca.dot(self._forearm_axis, self._flange_axis), self.signs[2] * self._bend

    @cached_property
    def _forearm(self) -> ca.SX:
        """From axis 3 to the wrist centre."""
        (x, _, z), v = ca.vertsplit(self._upper), (self._distance_sq - self.arm.a2**2 + self._length_sq) / 2
        across = self.arm.a2 * self.elbow
        return ca.vertcat((x * v + z * across) / self._distance_sq, 0, (z * v - x * across) / self._distance_sq)

    @cached_property
    def _forearm_axis(self) -> ca.SX:
        """Direction of axis 4."""
        (x, _, z), arm = ca.vertsplit(self._forearm), self.arm
        return ca.vertcat(arm.d4 * x + arm.a3 * z, 0, arm.d4 * z - arm.a3 * x) / self._length_sq

    @cached_property
    def _flange_axis(self) -> ca.SX:
        """Direction of axis 6."""
        return self._in_plane(self.T_B_F.R[:, 2])

    @cached_property
    def _wrist_axis(self) -> ca.SX:
        """Direction of axis 5 times the sine of angle 5."""
        return ca.cross(self._forearm_axis, self._flange_axis)

    @cached_property
    def _bend(self) -> ca.SX:
        """Absolute sine of angle 5; axis 4 has length one and no normal part."""
        return ca.sqrt(self._flange_axis[1] ** 2 + self._wrist_axis[1] ** 2)

    @cached_property
    def w(self) -> ca.SX:
        """Manipulability |det J| [m^3], its factors positive on their branches."""
        return self.arm.a2 * (self.signs[1] * self.elbow) * (self.signs[0] * self.radius) * self._bend

    @cached_property
    def gram(self) -> ca.SX:
        """det(J_v J_v^T) [m^6] of the translational Jacobian at the TCP.

        By Cauchy and Binet it is the sum of squared triple products of columns. Those of the wrist are z x lever, so
        that any two of them have a cross product along the lever, and three have none.
        """
        lever = self._in_plane(self.p_B_E - self._wrist)
        arms = [(UP, ca.vertcat(self.radius, 0, 0)), (NORMAL, self._upper), (NORMAL, self._forearm)]
        columns = [ca.cross(axis, to_wrist + lever) for axis, to_wrist in arms]
        axes = [self._forearm_axis, self._wrist_axis / self._bend, self._flange_axis]
        total = ca.dot(columns[0], ca.cross(columns[1], columns[2])) ** 2
        for a, b in combinations(columns, 2):
            area = ca.cross(lever, ca.cross(a, b))
            total += sum(ca.dot(axis, area) ** 2 for axis in axes)
        along = sum(ca.dot(ca.cross(axis, to_wrist), lever) ** 2 for axis, to_wrist in arms)
        return total + along * sum(ca.dot(lever, ca.cross(a, b)) ** 2 for a, b in combinations(axes, 2))
