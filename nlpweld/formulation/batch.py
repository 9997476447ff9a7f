"""The exact model over whole populations of placements, on whichever engine there is."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Protocol

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.uncertainty import as_stated
from nlpweld.engine.choice import chosen_engine
from nlpweld.formulation.branches import SAMPLES, Screening
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.nlp import Evaluation, sobol
from nlpweld.formulation.paths import allowed
from nlpweld.formulation.set_up import with_errors
from nlpweld.formulation.stage import Stage
from nlpweld.formulation.staged import Staged
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import ELBOW, SHOULDER

CONSTRAINTS = ("reach", "joint_limit", "singularity", "clearance")


class Evaluator(Protocol):
    """Judges placements."""

    def at(self, points: np.ndarray, only: int = -1) -> "Evaluator":
        """Return the same over other data of the seam points, on one mode alone where that is not negative."""

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Return objective, violations and best mode of placements X, shape (m, d)."""


@dataclass(frozen=True)
class Batch:
    """Evaluates placements of one cell, X (m, d), at the cell's own seam points with the solvers' margins.

    Reach, joint limits and singularity come first; velocity ellipsoids (and so the objective) and clearances are
    looked at only for candidates that keep them or lack less than a tenth of the singularity floor, and clearances
    between robots only where each robot alone is feasible.

    Attributes:
        cell: the cell.
        engine: ``numpy``, ``numba`` (the ``fast`` extra), ``c``, or ``auto`` for the fastest that is installed.
        errors: whether the graphs take errors of the set-up (:mod:`~.set_up`), which are zero here.
    """

    cell: Cell
    engine: str = "auto"
    errors: bool = False

    @cached_property
    def stage(self) -> Stage:
        """The graphs behind the arrays."""
        return Stage(self.cell, errors=self.errors)

    @cached_property
    def modes(self) -> list[tuple[tuple[str, str], ...]]:
        """The (shoulder, elbow) of every station, for each mode; the wrist follows from the joint limits."""
        return list(product(self.arm_branches, repeat=len(self.cell.stations)))

    @cached_property
    def arm_branches(self) -> list[tuple[str, str]]:
        """The (shoulder, elbow) pairs the cell allows."""
        c = self.cell.configuration
        return list(product(allowed(c.shoulder, SHOULDER), allowed(c.elbow, ELBOW)))

    @cached_property
    def points(self) -> np.ndarray:
        """The data of every seam point, shape (k, N)."""
        points = point_data(self.cell, seam_parameters(self.cell))
        return with_errors(points, as_stated(self.cell)) if self.errors else points

    @property
    def chosen_engine(self) -> str:
        """The engine that ``auto`` stands for here."""
        return chosen_engine(self.engine)

    @cached_property
    def evaluator(self) -> Evaluator:
        """What judges placements on the chosen engine."""
        return evaluator(self.chosen_engine, self.cell, self.stage, self.points, self.arm_branches)

    @cached_property
    def screening(self) -> Screening:
        """What a sample of the box says of the modes."""
        X = sobol(self.cell.box[0], self.cell.box[1], 0, SAMPLES)
        return Screening(X, Staged(self.cell, self.stage, self.points, self.arm_branches).keeps(X))

    def prepare(self) -> None:
        """Build, compile and run everything once, so that what follows measures evaluation alone."""
        self.evaluate(self.cell.box.mean(axis=0))

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Return objective, violations and best mode of placements X (m, d), free coordinates [m; rad]."""
        return self.evaluator.evaluate(np.atleast_2d(np.asarray(X, dtype=float)))


def evaluator(
    engine: str, cell: Cell, stage: Stage, points: np.ndarray, arm_branches: list[tuple[str, str]]
) -> Evaluator:
    """Return what judges placements on an engine: candidate by candidate on Numba, else in arrays."""
    if engine != "numba":
        return Staged(cell, stage, points, arm_branches)
    from nlpweld.formulation.fused import Fused  # Numba, which the base install lacks

    return Fused(cell, stage, points, arm_branches)
