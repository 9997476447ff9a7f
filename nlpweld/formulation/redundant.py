"""The redundant form: placement, and the angles a weld leaves free along the seam, as smooth paths; joints by inverse.

The paths of torch spin, workpiece yaw and tilt are cubic B-splines of few control points, so that there are tens of
variables, not hundreds, and no path jumps. How far any joint turns from one seam point to the next is bounded.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.formulation.batch import CONSTRAINTS, Batch, Evaluator, evaluator
from nlpweld.formulation.branches import SAMPLES, Screening
from nlpweld.formulation.coded import Assembly, Coding, Piece
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.derivatives import by_functions, lanes_of
from nlpweld.formulation.freedom import free_angles
from nlpweld.formulation.holder import held
from nlpweld.formulation.margins import with_margins
from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation, sobol
from nlpweld.formulation.paths import limit_margins, turns
from nlpweld.formulation.reduced import OutOfReach, Unpacker
from nlpweld.formulation.smooth import Gaps, all_gaps, near_gaps, step_function, term_function, value_pieces
from nlpweld.formulation.splines import basis
from nlpweld.formulation.stage import Stage
from nlpweld.formulation.staged import Staged
from nlpweld.formulation.tilting import tilted_path, way_back
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import signs
from nlpweld.plan import Plan

REDUNDANT = {"spin": "redundant_spin", "spin_yaw": "redundant_spin_yaw", "spin_yaw_tilt": "redundant"}
CONTROL_POINTS = 24
TURNS = 32  # angles that are screened, a divisor of SAMPLES
LIMITS = CONSTRAINTS.index("joint_limit")
NEAR_MINIMUM = 32.0  # exponent of the power mean that stands for the minimum where paths on a grid are a start
STEP_MARGIN_DEG = 0.05  # by which solvers stay under the bound on joint steps


def redundant(cell: Cell, engine: str = "auto", level: str = "spin_yaw_tilt", controls: int = CONTROL_POINTS) -> Nlp:
    """Return the redundant form of a cell.

    Args:
        cell: the cell; it states bands and the bound on joint steps in its [freedom] table.
        engine: ``numpy``, ``numba``, ``c`` or ``auto``.
        level: what is free, a key of :data:`~.freedom.LEVELS`.
        controls: control points of every path.

    Raises:
        OptionError: no such level, or the cell states no freedom.
    """
    form = Redundant(Batch(cell, engine), level, controls)
    lower, upper = form.coding.bounds
    angles = [f"{a.name}[{i}]_rad" for i in range(controls) for a in form.coding.angles]
    return Nlp(
        problem=cell.name,
        formulation=REDUNDANT[level],
        names=(*cell.variables, *angles),
        lower=lower,
        upper=upper,
        constraints=(*CONSTRAINTS, "joint_step"),
        evaluate=form.evaluate,
        unpack=form.unpack,
        relax=form.relax,
        n_modes=len(form.batch.modes),
        widened=lambda extra: redundant(with_margins(cell, extra), engine, level, controls),
        refine=form.refined,
        sample=form.starts,
        prepare=form.prepare,
        screen=(lambda: form.screening) if len(form.batch.modes) > 1 else None,
        rebuild=partial(redundant, cell, engine, level, controls),
    )


@dataclass(frozen=True)
class Redundant:
    """What a redundant form is made of.

    Attributes:
        batch: the exact model without freedom; it also tells where placements are feasible.
        level: what is free.
        controls: control points of every path.
    """

    batch: Batch
    level: str
    controls: int = CONTROL_POINTS

    @property
    def cell(self) -> Cell:
        """The cell."""
        return self.batch.cell

    @cached_property
    def coding(self) -> Coding:
        """How variables become placement and paths."""
        s = seam_parameters(self.cell)
        angles = free_angles(self.cell, self.level)
        return Coding(self.cell.box, angles, basis(s, self.controls, self.cell.seam.closed))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the free angles."""
        return tuple(angle.name for angle in self.coding.angles)

    @cached_property
    def stage(self) -> Stage:
        """The graphs with free angles."""
        return Stage(self.cell, self.names)

    @cached_property
    def data(self) -> np.ndarray:
        """What is known of the seam points, shape (k, N)."""
        return point_data(self.cell, seam_parameters(self.cell), self.names)

    @cached_property
    def _evaluator(self) -> Evaluator:
        points = np.vstack([self.data, np.zeros((len(self.names), self.data.shape[1]))])
        return evaluator(self.batch.chosen_engine, self.cell, self.stage, points, self.batch.arm_branches)

    @cached_property
    def screening(self) -> Screening:
        """What a sample of placements, some to each of fewer angles, says of the modes."""
        Z, d = self.starts(0, SAMPLES), self.coding.d
        judge, kept = Staged(self.cell, self.stage, self.points(Z[0])[1], self.batch.arm_branches), []
        for some in np.split(Z, TURNS):
            some[:, d:] = some[0, d:]
            kept.append(judge.at(self.points(some[0])[1]).keeps(some[:, :d]))
        return Screening(Z, np.concatenate(kept))

    @cached_property
    def untilted(self) -> np.ndarray | None:
        """The positioner's joints while nothing is tilted, shape (N, n) [rad]."""
        return held(self.cell, seam_parameters(self.cell)).q

    @cached_property
    def _table(self) -> ca.Function | None:
        return self.stage.table.map(self.data.shape[1]) if self.stage.table else None

    @cached_property
    def _grips(self) -> list[ca.Function]:
        return [grip.map(self.data.shape[1]) for grip in self.stage.grips]

    @property
    def bound(self) -> float:
        """How far a joint may turn between seam points [rad]."""
        assert self.cell.freedom is not None
        return float(np.radians(self.cell.freedom.joint_step_deg))

    def prepare(self) -> None:
        """Build and compile what ``evaluate`` needs."""
        self.batch.prepare()
        self.evaluate(self.coding.constant(self.cell.box.mean(axis=0)[None], np.zeros((1, len(self.names)))))

    def points(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the placement's coordinates (d,) and the seam points' data with their angles, (k + f, N)."""
        x, angles = self.coding.decode(z)
        return x, np.vstack([self.data, angles])

    def evaluate(self, Z: np.ndarray) -> Evaluation:
        """Return objective, violations and best mode of candidates Z, shape (m, n)."""
        found = [self._one(z) for z in np.atleast_2d(np.asarray(Z, dtype=float))]
        return Evaluation(*(np.concatenate([getattr(e, f) for e in found]) for f in ("objective", "violation", "mode")))

    def _one(self, z: np.ndarray) -> Evaluation:
        x, points = self.points(z)
        found = self._evaluator.at(points).evaluate(x[None])
        longest = self._longest_step(x, points, int(found.mode[0])) if np.isfinite(found.objective[0]) else 0.0
        missed = max(0.0, longest - self.bound + np.radians(STEP_MARGIN_DEG)) / np.pi
        violation = np.hstack([found.violation, [[missed]]])
        violation[0, LIMITS] = max(violation[0, LIMITS], self._missed_by_table(points))
        return Evaluation(found.objective, violation, found.mode)

    def _missed_by_table(self, points: np.ndarray) -> float:
        """Return by how many half turns a positioner that tilts the weld misses its joint limits, the way back too."""
        q, need = self.table_path(points), np.radians(self.cell.constraints.joint_margin_deg)
        if self.cell.positioner is None or q is None:
            return 0.0
        whole = np.vstack([q, way_back(q)]) if self.cell.seam.closed else q
        return max(0.0, float(need - limit_margins(self.cell.positioner.robot, whole.T).min())) / np.pi

    def table_path(self, points: np.ndarray) -> np.ndarray | None:
        """Return the joints (N, n) [rad] of a positioner that tilts the weld; None of any other."""
        if self.cell.positioner is None or self._table is None or self.untilted is None:
            return None
        return tilted_path(self.cell.positioner.robot, np.array(self._table(points)[0]), self.untilted)

    def _longest_step(self, x: np.ndarray, points: np.ndarray, mode: int) -> float:
        """Return the farthest any joint turns from one seam point to the next, the way back included [rad]."""
        n, longest, found = points.shape[1], 0.0, []
        for grip, branch in zip(self._grips, self.batch.modes[mode], strict=True):
            side = np.reshape(signs((*branch, "noflip")), (3, 1))
            found.append(grip(np.tile(x[:, None], n), points, np.tile(side, n))[0])
        if self._table:
            found.append(self._table(points)[0])
        for cos_sin in map(np.array, found):
            phase = cos_sin[:, ::2] + 1j * cos_sin[:, 1::2]
            longest = max(longest, float(np.abs(turns(phase, self.cell.seam.closed)).max()))
        return longest

    def unpack(self, z: np.ndarray, mode: int) -> Plan | OutOfReach:
        """Return the plan of a candidate on a mode's branches, or who cannot reach which point."""
        x, points = self.points(z)
        plan = Unpacker(self.batch, self.stage, points)(x, mode)
        if isinstance(plan, OutOfReach):
            return plan
        return plan.with_freedom(dict(zip(self.names, self.coding.decode(z)[1], strict=True)))

    def starts(self, seed: int, count: int) -> np.ndarray:
        """Return starts (count, n): random placements, and random spins and yaws that stay the same along the seam."""
        (lower, upper), d, angles = self.coding.bounds, self.coding.d, self.coding.angles
        turning = np.array([True] * d + [angle.name.partition(".")[0] in ("spin", "yaw") for angle in angles])
        drawn = np.zeros((count, len(turning)))
        drawn[:, turning] = sobol(lower[: len(turning)][turning], upper[: len(turning)][turning], seed, count)
        return self.coding.constant(drawn[:, :d], drawn[:, d:])

    @cached_property
    def _lattice(self) -> Any:
        from nlpweld.formulation.inner import lattice  # which needs this form

        return lattice(self)

    def refined(self, z: np.ndarray, mode: int) -> np.ndarray | None:
        """Return variables at the placement of z whose paths are the best there are on a grid, or None.

        Descents from angles that stay the same along the seam end in poor valleys where more than one angle is free.
        """
        from nlpweld.formulation.inner import best, start

        # where only the least value counts, paths are any elsewhere, which makes a poor start
        exponent = NEAR_MINIMUM if self.cell.objective.over_seam == "minimum" else None
        found = best(self._lattice, z[: self.coding.d], mode, banded=True, exponent=exponent)
        return None if found is None else start(self, found).z

    def relax(self, mode: int, whole: bool = False) -> Relaxation:
        """Return the relaxation on a mode's branches, with every distance if whole."""
        branches, engine, B = self.batch.modes[mode], self.batch.chosen_engine, self.coding.basis
        gaps = all_gaps(self.stage) if whole else self.near(mode)
        term = term_function(self.stage, branches, gaps, self.data.shape[1])
        step = step_function(self.stage, branches, self.bound - np.radians(STEP_MARGIN_DEG))
        ahead = np.roll(np.arange(len(B)), -1)
        here = slice(None) if self.cell.seam.closed else slice(-1)
        pair = np.vstack([self.data, self.data[:, ahead]])[:, here]
        pieces = [
            Piece(lanes_of(term, self.data, engine), (B,)),
            Piece(lanes_of(step, pair, engine), (B[here], B[ahead][here])),
            *value_pieces(self.stage, branches, self.data, (B,), engine),
        ]
        whole_sum = Assembly(self.coding, pieces)
        return by_functions(whole_sum.value, whole_sum.slopes, len(self.coding.bounds[0]))

    def near(self, mode: int, scouts: int = 64, within_m: float = 0.3) -> Gaps:
        """Return the distances that matter at some placements and angles within reach."""
        Z = self.starts(1, 8 * scouts)
        found = self.evaluate(Z)
        order = np.lexsort((-found.objective, found.total))[:scouts]
        d = self.coding.d
        local = Z[order][:, : d + len(self.names)]
        return near_gaps(self.stage, self.batch.modes[mode], local, self.data, within_m)
