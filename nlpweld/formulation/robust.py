"""The robust form: the reduced one at its worst over the scenarios of a cell that may be set up otherwise than stated.

Robots are told where work and bases really are, so every scenario has joint paths of its own by the same inverse.
All levels hold in all of them, and the objective is the least of theirs.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.uncertainty import Scenario, vertices
from nlpweld.errors import OptionError
from nlpweld.formulation.batch import CONSTRAINTS, Batch
from nlpweld.formulation.coded import Lanes
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.derivatives import by_functions, lanes_of
from nlpweld.formulation.margins import with_margins
from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation
from nlpweld.formulation.reduced import Relaxer, Unpacker
from nlpweld.formulation.set_up import with_errors
from nlpweld.formulation.smooth import all_gaps, loss_and_penalty
from nlpweld.geometry.seam import seam_parameters

ROBUST = "robust"


def robust(cell: Cell, engine: str = "auto") -> Nlp:
    """Return the robust form of a cell: variables are the free coordinates of its placement, as it is stated.

    Args:
        cell: the cell; its [uncertainty] table bounds the errors.
        engine: ``numpy``, ``numba``, ``c`` or ``auto``.

    Raises:
        OptionError: the cell states no errors, or asks for something else than the mean over the seam.
    """
    if cell.objective.over_seam != "mean":
        raise OptionError(f"{cell.name}: the robust form takes the mean over the seam, not {cell.objective.over_seam}")
    batch = Batch(cell, engine, errors=True)
    form = Robust(batch, vertices(cell))
    return Nlp(
        problem=cell.name,
        formulation=ROBUST,
        names=cell.variables,
        lower=cell.box[0],
        upper=cell.box[1],
        constraints=CONSTRAINTS,
        evaluate=form.evaluate,
        unpack=Unpacker(batch),
        relax=form.relax,
        n_modes=len(batch.modes),
        widened=lambda extra: robust(with_margins(cell, extra), engine),
        prepare=batch.prepare,
    )


@dataclass(frozen=True)
class Robust:
    """What a robust form is made of.

    Attributes:
        batch: the exact model of the cell as it is stated, its graphs open to errors.
        scenarios: how the cell may be set up, as stated first.
    """

    batch: Batch
    scenarios: tuple[Scenario, ...]

    @cached_property
    def data(self) -> list[np.ndarray]:
        """What is known of the seam points in every scenario, each of shape (k, N)."""
        points = point_data(self.batch.cell, seam_parameters(self.batch.cell))
        return [with_errors(points, scenario) for scenario in self.scenarios]

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Return worst objective, worst violations and the one mode of placements X (m, d).

        The mode is the best of the cell as stated, and held in all scenarios. Candidates of which the stated cell keeps
        neither reach nor joint limits nor nearly the floor are judged by that alone.
        """
        X = np.atleast_2d(np.asarray(X, dtype=float))
        worst = self.batch.evaluate(X)
        for mode in np.unique(worst.mode):
            near = np.flatnonzero((worst.mode == mode) & np.isfinite(worst.objective))
            for data in self.data[1:] if len(near) else ():
                found = self.batch.evaluator.at(data, int(mode)).evaluate(X[near])
                worst.objective[near] = np.minimum(worst.objective[near], found.objective)
                worst.violation[near] = np.maximum(worst.violation[near], found.violation)
        return worst

    def relax(self, mode: int, whole: bool = False) -> Relaxation:
        """Return the relaxation on a mode's branches, with every distance if whole."""
        gaps = None if whole else Relaxer(self.batch).near(mode)
        points, engine = np.hstack(self.data), self.batch.chosen_engine
        stage, shape = self.batch.stage, (len(self.data), self.batch.points.shape[1])
        terms = loss_and_penalty(stage, self.batch.modes[mode], gaps or all_gaps(stage), shape[1])
        loss, penalty = (lanes_of(term, points, engine) for term in terms)
        worst = SoftWorst(loss, penalty, shape)
        return by_functions(worst.value, worst.slopes, len(self.batch.cell.variables))


@dataclass(frozen=True, eq=False)
class SoftWorst:
    """``log sum_k exp(p f_k(x)) / p + sum_k c_k(x, p)``: a soft maximum of losses f_k, and all penalties c_k.

    f_k and c_k are sums over the seam points in scenario k; p, the sharpness, is that of the penalties. The soft
    maximum is never below the true one, nor above it by more than log(scenarios) / p.

    Attributes:
        loss: what the objective brings at every seam point, scenario after scenario.
        penalty: likewise what is missed.
        shape: number of scenarios and of seam points.
    """

    loss: Lanes
    penalty: Lanes
    shape: tuple[int, int]

    def value(self, x: np.ndarray, sharpness: float) -> float:
        """Return the value at x (d,)."""
        (f,), (c,) = (self._summed(lanes, x, sharpness, False) for lanes in (self.loss, self.penalty))
        top = f.max()
        return float(top + np.log(np.exp(sharpness * (f - top)).sum()) / sharpness + c.sum())

    def slopes(self, x: np.ndarray, sharpness: float) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient (d,) and Hessian (d, d) at x (d,)."""
        f, g, H = self._summed(self.loss, x, sharpness, True)
        _, dc, ddc = self._summed(self.penalty, x, sharpness, True)
        share = np.exp(sharpness * (f - f.max()))
        share /= share.sum()
        mean = g @ share
        spread = (g * share) @ g.T - np.outer(mean, mean)
        return mean + dc.sum(axis=-1), H @ share + sharpness * spread + ddc.sum(axis=-1)

    def _summed(self, lanes: Lanes, x: np.ndarray, sharpness: float, slopes: bool) -> list[np.ndarray]:
        """Return values (S,) and, with slopes, gradients (d, S) and Hessians (d, d, S) by scenario."""
        count, points = self.shape
        found = lanes(np.tile(x[:, None], count * points), sharpness, slopes)
        return [part.reshape(*part.shape[:-1], count, points).sum(axis=-1) for part in found[: 3 if slopes else 1]]
