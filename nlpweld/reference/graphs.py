"""What a rigorous bound looks at: objective and levels at one seam point, as graphs of placement and branches."""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.robot import Robot
from nlpweld.formulation.coupling import WeldPoint, base_pose, flange_pose, placement_frame, tcp_pose, weld_point
from nlpweld.formulation.paths import allowed
from nlpweld.formulation.stage import Stage
from nlpweld.kinematics.ik import WRIST, spherical_arm
from nlpweld.kinematics.manipulability import magnitude, mmr
from nlpweld.reference.arm import PlanarArm

SIGNS = 3  # of a station's branch


@dataclass(frozen=True)
class BoundGraphs:
    """Graphs ``(x, point, signs (3 S))`` of a cell with S stations, tight under enclosures (:mod:`~.arm`).

    Attributes:
        cell: the cell.
    """

    cell: Cell

    @cached_property
    def _point(self) -> WeldPoint:
        return weld_point(self.cell)

    @cached_property
    def _inputs(self) -> list[ca.SX]:
        x, signs = ca.SX.sym("x", len(self.cell.variables)), ca.SX.sym("signs", SIGNS * len(self.cell.stations))
        return [x, self._point.vector, signs]

    @cached_property
    def arms(self) -> list[PlanarArm]:
        """Every station's arm."""
        x, _, signs = self._inputs
        T_W_C, found = placement_frame(self.cell, x) @ self._point.T_P_C, []
        each = zip(self.cell.stations, self._point.targets, ca.vertsplit(signs, SIGNS), strict=True)
        for station, target, branch in each:
            T_W_B = base_pose(station)
            p_B_E = T_W_B.inverse().point(tcp_pose(station.coupling, T_W_C, target).p)
            pose = flange_pose(station, T_W_C, target)
            found.append(PlanarArm(spherical_arm(station.robot), pose, p_B_E, branch))
        return found

    @cached_property
    def objective(self) -> ca.Function:
        """MMR at one seam point, in the reading's unit over its size (:func:`~.manipulability.magnitude`)."""
        cell, w, gram = self.cell, [arm.w for arm in self.arms], [arm.gram for arm in self.arms]
        value = mmr(cell.objective.reading, w, gram, cell.tight) / magnitude(cell.objective.reading, cell.tight)
        return ca.Function("objective", self._inputs, [value], {"cse": True})

    @cached_property
    def levels(self) -> ca.Function:
        """Numbers that no feasible placement has below zero, one below the other.

        They are reach, manipulability above the floor, and joints 1, 2, 3 and 5 inside their limits, of every station,
        without the solvers' margins. Where both wrists are allowed joint 5 counts as inside if it is on either. Left
        out are clearances (but see :attr:`heights`), joints 4 and 6, joints that may turn more than once, and what
        happens between the seam's points: a placement that keeps all levels along the whole seam keeps these, so that
        the best one under these is at least as good.
        """
        rows, floor = [], self.cell.constraints.singularity_floor_m3
        for k, arm in enumerate(self.arms):
            rows += [arm.reach, *([arm.w / floor - 1] if floor > 0.0 else []), *self._joints(k)]
        return ca.Function("levels", self._inputs, [ca.vertcat(*rows)], {"cse": True})

    @cached_property
    def heights(self) -> ca.Function:
        """Likewise the clearances of the robots' bodies from the floor [m], by the stage's own graphs."""
        stage, (x, point, signs), rows = Stage(self.cell), self._inputs, []
        for k, branch in enumerate(ca.vertsplit(signs, SIGNS)):
            cos_sin, _, _ = stage.grips[k](x, point, branch)
            rows.append(stage.heights[k](stage.limbs[k](x, cos_sin)[1]) - self.cell.constraints.clearance_m)
        return ca.Function("heights", self._inputs, [ca.vertcat(*rows)], {"cse": True})

    def _joints(self, k: int) -> list[ca.SX]:
        robot, arm = self.cell.stations[k].robot, self.arms[k]
        angles = enumerate((arm.first, arm.second, arm.third))
        rows = [self._inside(k, i, *angle) for i, angle in angles if _is_limited(robot, i)]
        if _is_limited(robot, 4):
            c, s = arm.fifth
            wrists = allowed(self.cell.configuration.wrist, WRIST)
            either = [self._inside(k, 4, c, WRIST[wrist] * s) for wrist in wrists]
            same = ca.is_equal(either[0], either[-1], 4)
            rows.append(either[0] if same else ca.fmax(*either))
        return rows

    def _inside(self, k: int, i: int, cos: ca.SX, sin: ca.SX) -> ca.SX:
        """Return ``cos(q - middle) - cos(half range)`` of one joint."""
        robot = self.cell.stations[k].robot
        lower, upper = robot.limits_rad[i]
        middle = (upper + lower) / 2 + robot.dh[i, 3]
        return cos * np.cos(middle) + sin * np.sin(middle) - np.cos((upper - lower) / 2)


def _is_limited(robot: Robot, i: int) -> bool:
    """Tell whether a joint turns less than once."""
    lower, upper = robot.limits_rad[i]
    return bool(upper - lower < 2 * np.pi)
