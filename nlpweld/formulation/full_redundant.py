"""The redundant form in full space: placement, every joint and every free angle at every seam point are variables.

Besides the closure of every chain, which couples a point's joints with its free angles, joint steps from one seam
point to the next are bounded, the way back of a closed seam included. Paths of angles need no splines to be smooth:
what joints do not jump, angles do not either. Bands are bounds of variables.

Where a positioner tilts the weld, its joints are variables too, beside the robots', bounded by their limits and by the
same steps. Closure ties them to slope and rotation.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.formulation.arrow import Steps
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.freedom import FreeAngle
from nlpweld.formulation.full import CONSTRAINTS, SCOUTS, Full
from nlpweld.formulation.margins import with_margins
from nlpweld.formulation.nlp import Nlp
from nlpweld.formulation.redundant import STEP_MARGIN_DEG, Redundant
from nlpweld.formulation.smooth import Gaps, step_penalty
from nlpweld.formulation.stage import Stage
from nlpweld.formulation.tilting import table_limits
from nlpweld.plan import Plan

FULL_REDUNDANT = {"spin": "full_spin", "spin_yaw": "full_spin_yaw", "spin_yaw_tilt": "full_redundant"}
LOOKED_AT = 8  # placements at which the best paths on a grid are looked for


def full_redundant(cell: Cell, engine: str = "auto", level: str = "spin_yaw_tilt") -> Nlp:
    """Return the redundant form of a cell in full space.

    Args:
        cell: the cell; it states bands and the bound on joint steps in its [freedom] table.
        engine: see :func:`~.full.full`.
        level: what is free, a key of :data:`~.freedom.LEVELS`.

    Raises:
        OptionError: no such level, or the cell states no freedom.
        KinematicsError: a robot has no closed-form inverse, which starts and |det J| need.
    """
    batch = Batch(cell, engine)
    form = FullRedundant(batch, Redundant(batch, level))
    again = partial(full_redundant, cell, engine, level)
    return form.nlp(
        FULL_REDUNDANT[level], lambda extra: full_redundant(with_margins(cell, extra), engine, level), again
    )


@dataclass(frozen=True)
class FullRedundant(Full):
    """What a redundant full-space form is made of.

    Attributes:
        splines: the redundant form with joints eliminated; it says what is free, and where to start.
    """

    splines: Redundant

    @property
    def stage(self) -> Stage:
        """The graphs with free angles."""
        return self.splines.stage

    @property
    def data(self) -> np.ndarray:
        """What is known of the seam points, shape (k, N)."""
        return self.splines.data

    @property
    def angles(self) -> tuple[FreeAngle, ...]:
        """What is free at every seam point besides the joints."""
        return self.splines.coding.angles

    @property
    def limits(self) -> np.ndarray:
        """Joint limits less the solvers' margin at every seam point, shape (2, N, joints) [rad]."""
        positioner, q = self.cell.positioner, self.splines.untilted
        if not self.stage.table or positioner is None or q is None:
            return super().limits
        return np.dstack([super().limits, table_limits(self.cell, positioner, q)])

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of what the exact model looks at."""
        return (*CONSTRAINTS, "joint_step")

    @property
    def bound(self) -> float:
        """How far solvers let a joint turn between seam points [rad]."""
        return self.splines.bound - float(np.radians(STEP_MARGIN_DEG))

    @property
    def steps(self) -> Steps:
        """What joint steps cost; a function of the cosine, so that whole turns cost nothing."""
        turned, sharpness = ca.SX.sym("turned"), ca.SX.sym("sharpness")
        cost = ca.Function("cost", [turned, sharpness], [step_penalty([ca.cos(turned)], self.bound, sharpness)])
        return Steps(cost, self.point.joints, self.cell.seam.closed)

    def prepare(self) -> None:
        """Build and compile what ``evaluate`` and the scouts need."""
        super().prepare()
        self.splines.prepare()

    def _missed_steps(self, longest: np.ndarray) -> dict[str, np.ndarray]:
        return super()._missed_steps(longest) | {"joint_step": (longest - self.bound) / np.pi}

    def unpack(self, z: np.ndarray, mode: int) -> Plan:
        """Return the plan of variables z (n,) with its free angles."""
        own = np.reshape(z[self.arrow.shared :], (self.arrow.points, self.arrow.own))
        angles = own[:, self.point.joints :].T
        return super().unpack(z, mode).with_freedom(dict(zip(self.splines.names, angles, strict=True)))

    def starts(self, seed: int, count: int) -> np.ndarray:
        """Return starts (count, n) at the best of some random placements, those first whose best paths are worth most.

        Angles are the best there are on a grid (:mod:`~.inner`) at the placements that are looked at and have paths,
        and stay the same along the seam at all others. Descents from angles that stay the same end in poor valleys.
        """
        Z = self.splines.starts(seed, max(SCOUTS, count))
        found = self.splines.evaluate(Z)
        ranked = np.lexsort((-found.objective, found.total))[: max(count, LOOKED_AT)]
        begun = [self._begun(Z[i], int(found.mode[i]), look=k < LOOKED_AT) for k, i in enumerate(ranked)]
        return np.array([z for _, z in sorted(begun, key=lambda start: -start[0])[:count]])

    def _inverses(self, x: np.ndarray, mode: int, points: np.ndarray) -> np.ndarray:
        robots, table = super()._inverses(x, mode, points), self.splines.table_path(points)
        return robots if table is None else np.vstack([robots, table.T])

    def _begun(self, z: np.ndarray, mode: int, look: bool) -> tuple[float, np.ndarray]:
        """Return what the best paths on a grid at a scout's placement are worth, and the variables (n,) of a start."""
        from nlpweld.formulation.inner import best  # which takes a second to import

        x, constant = self.splines.coding.decode(z)
        found = best(self._lattice, x, mode, banded=True) if look else None
        if found is None:
            return -np.inf, self.start(x, mode, constant)
        return found.value, self.start(x, mode, np.array([found.angles[name] for name in self.splines.names]))

    @cached_property
    def _lattice(self) -> Any:
        from nlpweld.formulation.inner import lattice

        return lattice(self.splines)

    def _near(self, mode: int) -> Gaps:
        return self.splines.near(mode)
