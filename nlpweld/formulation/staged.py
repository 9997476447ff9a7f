"""The exact model over arrays: the stage's graphs lowered to NumPy, joint paths unwrapped, modes chosen."""

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.engine.lanes import Kernel, Lanes, joined, rows
from nlpweld.engine.numpy_kernels import lower, numpy_kernel
from nlpweld.formulation.clearance import Meeting, boxes
from nlpweld.formulation.nlp import Evaluation
from nlpweld.formulation.over_seam import over_seam
from nlpweld.formulation.paths import Limits, allowed, best_wrist
from nlpweld.formulation.stage import GAP_SCALE_M, Owners, Stage
from nlpweld.kinematics.ik import ELBOW, SHOULDER, WRIST
from nlpweld.kinematics.manipulability import mmr

NEAR = 0.1  # share of the singularity floor that may lack for a candidate to be looked at any further
BLOCK = 75_000  # lanes (candidates times points) taken at once, from which the few that pass are gathered
CHUNK = 2_400  # lanes in one call, whose arrays fit the cache together


@dataclass(eq=False)
class Side:
    """One station on one arm branch, over m candidates and N points.

    Attributes:
        missed: how far each constraint is missed, shape (m, 4).
        slot: for each candidate its row in the arrays below, or -1 where it was not looked at any further, (m,).
        w: manipulability, shape (r, N) [m^3].
        gram: det(J_v J_v^T), shape (r, N) [m^6].
        ends: body ends, arrays (r, N) [m].
        boxes: the bodies' boxes, shape (2, b, 3, r) [m].
    """

    missed: np.ndarray
    slot: np.ndarray
    w: np.ndarray
    gram: np.ndarray
    ends: Lanes
    boxes: np.ndarray


@dataclass(frozen=True)
class Staged:
    """Judges candidates many at a time, stage by stage.

    Attributes:
        cell: the cell.
        stage: its graphs.
        points: the data of every seam point, shape (d, N).
        arm_branches: the (shoulder, elbow) pairs the cell allows.
        only: the one mode to look at; all if negative.
    """

    cell: Cell
    stage: Stage
    points: np.ndarray
    arm_branches: list[tuple[str, str]]
    only: int = -1

    @cached_property
    def _joint_limits(self) -> list[Limits]:
        return [Limits.of(station.robot, self.cell.seam.closed) for station in self.cell.stations]

    @cached_property
    def _grips(self) -> list[Kernel]:
        return [numpy_kernel(grip, ("candidate", "point", "number")) for grip in self.stage.grips]

    @cached_property
    def _limbs(self) -> list[Kernel]:
        return [numpy_kernel(limbs, ("candidate", "lane", "point")[: limbs.n_in()]) for limbs in self.stage.limbs]

    @cached_property
    def _work(self) -> Kernel:
        return numpy_kernel(self.stage.work, ("candidate", "point"))

    @cached_property
    def _meetings(self) -> dict[Owners, Meeting]:
        gap, shapes = lower(self.stage.gap), self.stage.shapes
        return {(a, b): Meeting.of(gap, pairs, shapes[a], shapes[b]) for (a, b), pairs in self.stage.pairs.items()}

    def _candidates(self, lanes: int) -> int:
        """Return how many candidates make so many lanes."""
        return max(1, lanes // self.points.shape[1])

    @cached_property
    def _chunk(self) -> int:
        return self._candidates(CHUNK)

    def at(self, points: np.ndarray, only: int = -1) -> "Staged":
        """Return the same over other data of the seam points, shape (d, N); what is built is kept.

        Args:
            points: the data.
            only: the mode, or negative for all.
        """
        _ = self._grips, self._limbs, self._work, self._meetings, self._joint_limits  # built before they are shared
        other = copy(self)
        object.__setattr__(other, "points", points)
        object.__setattr__(other, "only", only)
        return other

    def keeps(self, X: np.ndarray) -> np.ndarray:
        """Tell whether stations on branches keep reach and joint limits and lack at most a tenth of the floor.

        Args:
            X: placements, shape (m, d).

        Returns:
            by placement, station and arm branch, shape (m, S, B).
        """
        kept = np.zeros((len(X), len(self.cell.stations), len(self.arm_branches)), dtype=bool)
        for k in range(kept.shape[1]):
            for b, branch in enumerate(self.arm_branches):
                kept[self._gripped(k, X, branch)[1], k, b] = True
        return kept

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Return objective, violations and best mode of placements X, shape (m, d)."""
        parts = [self._block(X[block]) for block in _slices(len(X), self._candidates(BLOCK))]
        return Evaluation(*(np.concatenate([getattr(p, f) for p in parts]) for f in ("objective", "violation", "mode")))

    def _block(self, X: np.ndarray) -> Evaluation:
        sides = [[self._side(k, X, branch) for branch in self.arm_branches] for k in range(len(self.cell.stations))]
        seen = np.all([np.any([side.slot >= 0 for side in branches], axis=0) for branches in sides], axis=0)
        work = np.zeros(len(X))
        work[seen] = self._missed_gap(self._work_height(X[seen]))
        best = Evaluation(np.full(len(X), -np.inf), np.full((len(X), 4), np.inf), np.zeros(len(X), dtype=int))
        met: dict[tuple[int, int, int, int], np.ndarray] = {}
        for mode, choice in enumerate(product(range(len(self.arm_branches)), repeat=len(sides))):
            if self.only not in (-1, mode):
                continue
            chosen = [side[b] for side, b in zip(sides, choice, strict=True)]
            missed = np.max([side.missed for side in chosen], axis=0)
            missed[:, 3] = np.maximum(missed[:, 3], work)
            missed[:, 3] = np.maximum(missed[:, 3], self._met(sides, choice, met))
            _keep_better(best, self._value(chosen), missed, mode)
        return best

    def _side(self, k: int, X: np.ndarray, branch: tuple[str, str]) -> Side:
        """Grip with one station on one branch, then look at the limbs of those that pass or nearly so."""
        missed, near, w, cos_sin = self._gripped(k, X, branch)
        slot = np.full(len(X), -1)
        slot[near] = np.arange(len(near))
        if not len(near):
            nothing = np.empty((0, self.points.shape[1]))
            return Side(missed, slot, nothing, nothing, [], np.empty((2, 0, 3, 0)))
        given = [self.points][: self.stage.errors]
        parts = [self._limbs[k](X[near[c]], rows(cos_sin, c), *given) for c in _slices(len(near), self._chunk)]
        gram, ends = joined([part[0] for part in parts])[0], joined([part[1] for part in parts])
        side = Side(missed, slot, w, gram, ends, boxes(ends, self.stage.shapes[k]))
        missed[near, 3] = self._missed_gap(self._lowest_alone(k, X[near], side))
        return side

    def _lowest_alone(self, k: int, X: np.ndarray, side: Side) -> np.ndarray:
        """Return the least clearance of robot k from workpiece and floor, or the level where none is below it (m,)."""
        owner, found = len(self.cell.stations), []
        for c in _slices(len(X), self._chunk):
            work = self._work(X[c], self.points)[0]
            about = boxes(work, self.stage.shapes[owner])
            found.append(
                self._meetings[k, owner].lowest(rows(side.ends, c), side.boxes[..., c], work, about, self._level)
            )
        return np.minimum(np.concatenate(found), self._lowest_height(k, side.boxes))

    def _work_height(self, X: np.ndarray) -> np.ndarray:
        """Return the least clearance of the workpiece from the floor, (m,) [m]."""
        owner, parts = len(self.cell.stations), [np.empty(0)]
        for c in _slices(len(X), self._chunk):
            work = self._work(X[c], self.points)[0]
            parts.append(self._lowest_height(owner, boxes(work, self.stage.shapes[owner])))
        return np.concatenate(parts)

    def _lowest_height(self, owner: int, about: np.ndarray) -> np.ndarray:
        """Return the least clearance of an owner's bodies from the floor by their boxes, (m,) [m]."""
        concerned = [i for i, body in enumerate(self.stage.shapes[owner]) if body.above_floor]
        return about[0, concerned, 2].min(axis=0, initial=np.inf)

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
            if l == len(sides):
                continue  # the workpiece, which each robot looked at by itself
            key = (k, l, choice[k], choice[l])
            if key not in known:
                a, b = sides[k][choice[k]], sides[l][choice[l]]
                both = np.flatnonzero((a.missed.sum(axis=1) == 0.0) & (b.missed.sum(axis=1) == 0.0))
                known[key] = np.zeros(len(missed))
                for c in _slices(len(both), self._chunk):
                    i, p, q = both[c], a.slot[both[c]], b.slot[both[c]]
                    given = _picked(a.ends, p), a.boxes[..., p], _picked(b.ends, q), b.boxes[..., q]
                    known[key][i] = self._missed_gap(meeting.lowest(*given, self._level))
            missed = np.maximum(missed, known[key])
        return missed

    @property
    def _level(self) -> float:
        return self.cell.constraints.clearance_at_points_m

    def _missed_gap(self, gap: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, self._level - gap) / GAP_SCALE_M

    def _value(self, chosen: list[Side]) -> np.ndarray:
        """Return the objective of the candidates all chosen sides looked at, -inf for the others, shape (m,)."""
        seen = np.flatnonzero(np.all([side.slot >= 0 for side in chosen], axis=0))
        w, gram = ([getattr(side, name)[side.slot[seen]] for side in chosen] for name in ("w", "gram"))
        objective = np.full(len(chosen[0].slot), -np.inf)
        with np.errstate(all="ignore"):  # without a floor, w and gram may be zero
            value = over_seam(self.cell.objective, mmr(self.cell.objective.reading, w, gram, self.cell.tight))
        objective[seen] = np.where(np.isfinite(value), value, -np.inf)
        return objective


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
