"""The exact model over whole populations: the stage's graphs over arrays, joint paths unwrapped, modes chosen."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.engine.choice import Engine, engine
from nlpweld.engine.lanes import Lanes, joined, rows
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.nlp import Evaluation
from nlpweld.formulation.paths import Limits, best_wrist
from nlpweld.formulation.stage import GAP_SCALE_M, Stage, with_lowest_gap
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import ELBOW, SHOULDER, WRIST
from nlpweld.kinematics.manipulability import mmr

CONSTRAINTS = ("reach", "joint_limit", "singularity", "clearance")
NEAR = 0.1  # share of the singularity floor that may lack for a candidate to be looked at any further


@dataclass(eq=False)
class Side:
    """One station on one arm branch, over m candidates and N points.

    Attributes:
        missed: how far each constraint is missed, shape (m, 4) by ``CONSTRAINTS``.
        slot: for each candidate its row in the arrays below, or -1 where it was not looked at any further, (m,).
        w: manipulability, shape (r, N) [m^3].
        gram: det(J_v J_v^T), shape (r, N) [m^6].
        ends: body ends, arrays (r, N) [m].
    """

    missed: np.ndarray
    slot: np.ndarray
    w: np.ndarray
    gram: np.ndarray
    ends: Lanes


@dataclass(frozen=True)
class Batch:
    """Evaluates placements of one cell, X (m, 3) [m], at the cell's own seam points with the solvers' margins.

    Reach, joint limits and singularity come first; velocity ellipsoids (and so the objective) and clearances are
    looked at only for candidates that keep them or lack less than a tenth of the singularity floor, and clearances
    between robots only where each robot alone is feasible.

    Attributes:
        cell: the cell.
        engine: ``numpy``, ``numba`` (the ``fast`` extra), or ``auto`` for the fastest there is.
    """

    cell: Cell
    engine: str = "auto"

    @cached_property
    def stage(self) -> Stage:
        """The graphs behind the arrays."""
        return Stage(self.cell)

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
        """The data of every seam point, shape (12, N)."""
        return point_data(self.cell, seam_parameters(self.cell))

    @property
    def has_jets(self) -> bool:
        """Whether derivatives may come from jets on Numba."""
        return self._engine.jets

    @cached_property
    def _joint_limits(self) -> list[Limits]:
        return [Limits.of(station.robot) for station in self.cell.stations]

    @cached_property
    def _engine(self) -> Engine:
        return engine(self.engine)

    @cached_property
    def _chunk(self) -> int:
        return self._candidates(self._engine.chunk)

    def _candidates(self, lanes: int) -> int:
        """Return how many candidates make so many lanes."""
        return max(1, lanes // self.points.shape[1])

    def prepare(self) -> None:
        """Build, compile and run everything once, so that what follows measures evaluation alone."""
        X, signs = self.cell.box.mean(axis=0)[None], np.ones(3)
        ends = []
        for grip, limbs in zip(self._grips, self._limbs, strict=True):
            ends.append(limbs(X, self.points, grip(X, self.points, signs)[0])[1])
        for (k, l), meeting in self._meetings.items():
            meeting(ends[k], ends[l])
        self._lowest(self._height, X)

    @cached_property
    def _grips(self) -> list[Callable[..., Any]]:
        return [self._engine.kernel(grip, ("candidate", "point", "number")) for grip in self.stage.grips]

    @cached_property
    def _limbs(self) -> list[Callable[..., Any]]:
        return [self._engine.kernel(with_lowest_gap(f), ("candidate", "point", "lane")) for f in self.stage.limbs]

    @cached_property
    def _meetings(self) -> dict[tuple[int, int], Callable[..., Any]]:
        return {p: self._engine.kernel(with_lowest_gap(f), ("lane", "lane")) for p, f in self.stage.meetings.items()}

    @cached_property
    def _height(self) -> Callable[..., Any]:
        return self._engine.kernel(with_lowest_gap(self.stage.workpiece_height), ("candidate", "point"))

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Return objective, violations and best mode of placements X, shape (m, 3) [m]."""
        X = np.atleast_2d(np.asarray(X, dtype=float))
        parts = [self._block(X[block]) for block in _slices(len(X), self._candidates(self._engine.block))]
        return Evaluation(*(np.concatenate([getattr(p, f) for p in parts]) for f in ("objective", "violation", "mode")))

    def _block(self, X: np.ndarray) -> Evaluation:
        sides = [[self._side(k, X, branch) for branch in self.arm_branches] for k in range(len(self.cell.stations))]
        seen = np.all([np.any([side.slot >= 0 for side in branches], axis=0) for branches in sides], axis=0)
        work = np.zeros(len(X))
        work[seen] = self._missed_gap(self._lowest(self._height, X[seen]))
        best = Evaluation(np.full(len(X), -np.inf), np.full((len(X), 4), np.inf), np.zeros(len(X), dtype=int))
        met: dict[tuple[int, int, int, int], np.ndarray] = {}
        for mode, choice in enumerate(product(range(len(self.arm_branches)), repeat=len(sides))):
            chosen = [side[b] for side, b in zip(sides, choice, strict=True)]
            missed = np.max([side.missed for side in chosen], axis=0)
            missed[:, 3] = np.maximum(missed[:, 3], work)
            missed[:, 3] = np.maximum(missed[:, 3], self._met(sides, choice, met))
            _keep_better(best, self._mmr(chosen), missed, mode)
        return best

    def _side(self, k: int, X: np.ndarray, branch: tuple[str, str]) -> Side:
        """Grip with one station on one branch, then look at the limbs of those that pass or nearly so."""
        missed, near, w, cos_sin = self._gripped(k, X, branch)
        slot = np.full(len(X), -1)
        slot[near] = np.arange(len(near))
        parts = [self._limbs[k](X[near[c]], self.points, rows(cos_sin, c)) for c in _slices(len(near), self._chunk)]
        if not parts:
            nothing = np.empty((0, self.points.shape[1]))
            return Side(missed, slot, nothing, nothing, [])
        missed[near, 3] = self._missed_gap(np.concatenate([part[2][0].min(axis=1) for part in parts]))
        return Side(missed, slot, w, joined([part[0] for part in parts])[0], joined([part[1] for part in parts]))

    def _gripped(self, k: int, X: np.ndarray, branch: tuple[str, str]) -> tuple[Any, ...]:
        """Return missed (m, 4), the rows worth going on with (r,), and their w (r, N) and cos_sin, twelve (r, N)."""
        signs = np.array([SHOULDER[branch[0]], ELBOW[branch[1]], 1.0])
        floor = self.cell.constraints.floor_at_points_m3
        missed, near, kept = np.zeros((len(X), 4)), [], []
        for c in _slices(len(X), self._chunk):
            cos_sin, (w,), (reach,) = self._grips[k](X[c], self.points, signs)
            part = missed[c]
            part[:, 0] = np.maximum(0.0, -reach.min(axis=1))
            part[:, 1] = self._missed_joints(k, cos_sin, part[:, 0] == 0.0)
            part[:, 2] = np.maximum(0.0, floor - w.min(axis=1)) / (floor or 1.0)
            passed = np.flatnonzero((part[:, 0] == 0.0) & (part[:, 1] == 0.0) & (part[:, 2] < NEAR))
            near.append(passed + c.start)
            kept.append((w[passed], _picked(cos_sin, passed)))
        return missed, np.concatenate(near), np.concatenate([k[0] for k in kept]), joined([k[1] for k in kept])

    def _missed_joints(self, k: int, cos_sin: Lanes, reached: np.ndarray) -> np.ndarray:
        """Return by how many half turns the best wrist misses its joint limits, for candidates within reach."""
        missed = np.zeros(len(reached))
        if reached.any():
            need = np.radians(self.cell.constraints.joint_margin_deg)
            wrists = allowed(self.cell.configuration.wrist, WRIST)
            margins, _ = best_wrist(self._joint_limits[k], _picked(cos_sin, np.flatnonzero(reached)), wrists, need)
            missed[reached] = np.maximum(0.0, need - margins) / np.pi
        return missed

    def _met(self, sides: list[list[Side]], choice: tuple[int, ...], known: dict) -> np.ndarray:
        """Return the clearance missed between robots, looking only where both robots alone are feasible."""
        missed = np.zeros(len(sides[0][0].missed))
        for (k, l), meeting in self._meetings.items():
            key = (k, l, choice[k], choice[l])
            if key not in known:
                a, b = sides[k][choice[k]], sides[l][choice[l]]
                both = np.flatnonzero((a.missed.sum(axis=1) == 0.0) & (b.missed.sum(axis=1) == 0.0))
                known[key] = np.zeros(len(missed))
                for c in _slices(len(both), self._chunk):
                    i = both[c]
                    (low,) = meeting(_picked(a.ends, a.slot[i]), _picked(b.ends, b.slot[i]))
                    known[key][i] = self._missed_gap(low[0].min(axis=1))
            missed = np.maximum(missed, known[key])
        return missed

    def _lowest(self, gap: Callable[..., Any], X: np.ndarray) -> np.ndarray:
        """Return the least of a gap over the seam for placements X (m, 3), shape (m,)."""
        parts = [gap(X[c], self.points)[0][0].min(axis=1) for c in _slices(len(X), self._chunk)]
        return np.concatenate(parts) if parts else np.empty(0)

    def _missed_gap(self, gap: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, self.cell.constraints.clearance_at_points_m - gap) / GAP_SCALE_M

    def _mmr(self, chosen: list[Side]) -> np.ndarray:
        """Return the mean MMR of the candidates all chosen sides looked at, -inf for the others, shape (m,)."""
        seen = np.flatnonzero(np.all([side.slot >= 0 for side in chosen], axis=0))
        w, gram = ([getattr(side, name)[side.slot[seen]] for side in chosen] for name in ("w", "gram"))
        objective = np.full(len(chosen[0].slot), -np.inf)
        with np.errstate(all="ignore"):  # without a floor, w and gram may be zero
            value = mmr(self.cell.objective.reading, w, gram, self.cell.tight).mean(axis=1)
        objective[seen] = np.where(np.isfinite(value), value, -np.inf)
        return objective


def allowed(choice: str, all_: dict[str, int]) -> list[str]:
    """Return the branch names a configuration entry allows."""
    return list(all_) if choice == "any" else [choice]


def _picked(lanes: Lanes, index: np.ndarray) -> Lanes:
    """Return candidates of lanes by rising index, without a copy where it names them all."""
    return lanes if len(index) == len(lanes[0]) else rows(lanes, index)


def _slices(count: int, size: int) -> Iterator[slice]:
    return (slice(start, min(start + size, count)) for start in range(0, count, size))


def _keep_better(best: Evaluation, objective: np.ndarray, missed: np.ndarray, mode: int) -> None:
    """Replace in place where a mode misses less, or as little with a higher objective."""
    total, known = missed.sum(axis=1), best.total
    better = (total < known) | ((total == known) & (objective > best.objective))
    best.objective[better], best.violation[better], best.mode[better] = objective[better], missed[better], mode
