"""The exact model over whole populations: the stage's graphs lowered to NumPy, joint paths unwrapped, modes chosen."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.lower import lower
from nlpweld.formulation.nlp import Evaluation
from nlpweld.formulation.paths import joint_paths, on_best_wrist
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import ELBOW, SHOULDER, WRIST
from nlpweld.kinematics.manipulability import mmr

CONSTRAINTS = ("reach", "joint_limit", "singularity", "clearance")
GAP_SCALE_M = 0.1  # a clearance missed by this much counts as one
CHUNK = 32  # candidates whose arrays fit the cache together


@dataclass(eq=False)
class Side:
    """One station on one arm branch, over a chunk of m candidates and N points."""

    w: np.ndarray
    gram: np.ndarray
    ends: list[np.ndarray]
    missed: np.ndarray  # (m, 4) by CONSTRAINTS

    @property
    def feasible(self) -> np.ndarray:
        """Which candidates this station can serve, shape (m,)."""
        return self.missed.sum(axis=1) == 0.0


@dataclass(frozen=True)
class Batch:
    """Evaluates placements of one cell, X (m, 3) [m], at the cell's own seam points with the solvers' margins."""

    cell: Cell

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
    def _points(self) -> list[np.ndarray]:
        return [row[None, :] for row in point_data(self.cell, seam_parameters(self.cell))]

    @cached_property
    def _arms(self) -> list:
        return [lower(arm) for arm in self.stage.arms]

    @cached_property
    def _meetings(self) -> dict:
        return {pair: lower(f) for pair, f in self.stage.meetings.items()}

    @cached_property
    def _work_height(self) -> object:
        return lower(self.stage.workpiece_height)

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Return objective, violations and best mode of placements X, shape (m, 3) [m]."""
        X = np.atleast_2d(np.asarray(X, dtype=float))
        parts = [self._chunk(X[i : i + CHUNK]) for i in range(0, len(X), CHUNK)]
        return Evaluation(*(np.concatenate([getattr(p, f) for p in parts]) for f in ("objective", "violation", "mode")))

    def _chunk(self, X: np.ndarray) -> Evaluation:
        sides = [[self._side(k, X, branch) for branch in self.arm_branches] for k in range(len(self.cell.stations))]
        work = self._missed_gap(self._work_gap(X))
        best = Evaluation(np.full(len(X), -np.inf), np.full((len(X), 4), np.inf), np.zeros(len(X), dtype=int))
        gaps: dict[tuple[int, int, int, int], np.ndarray] = {}
        for index, choice in enumerate(product(range(len(self.arm_branches)), repeat=len(sides))):
            chosen = [side[b] for side, b in zip(sides, choice, strict=True)]
            missed = np.max([side.missed for side in chosen], axis=0)
            missed[:, 3] = np.maximum(missed[:, 3], work)
            alive = missed.sum(axis=1) == 0.0
            if alive.any():
                missed[:, 3] = np.maximum(missed[:, 3], self._met(sides, choice, gaps))
            _keep_better(best, self._mmr(chosen), missed, index)
        return best

    def _side(self, k: int, X: np.ndarray, branch: tuple[str, str]) -> Side:
        signs = (SHOULDER[branch[0]], ELBOW[branch[1]], 1)
        cos_sin, (w,), (gram,), (reach,), ends, gaps = self._arms[k]([c[:, None] for c in X.T], self._points, signs)
        limits = self.cell.constraints
        floor = limits.singularity_floor_m3 + limits.singularity_margin_m3
        missed = np.empty((len(X), 4))
        missed[:, 0] = np.maximum(0.0, -reach.min(axis=1))
        missed[:, 1] = self._missed_joints(k, cos_sin, missed[:, 0] == 0.0)
        missed[:, 2] = np.maximum(0.0, floor - w.min(axis=1)) / (floor or 1.0)
        missed[:, 3] = self._missed_gap(lowest(gaps, len(X)))
        return Side(w, gram, ends, missed)

    def _missed_joints(self, k: int, cos_sin: list[np.ndarray], reached: np.ndarray) -> np.ndarray:
        """Return by how many half turns the best wrist misses its joint limits, for candidates within reach."""
        missed = np.zeros(len(reached))
        if reached.any():
            robot = self.cell.stations[k].robot
            q = joint_paths(robot, [np.broadcast_to(c, (len(reached), c.shape[1]))[reached] for c in cos_sin])
            need = np.radians(self.cell.constraints.joint_margin_deg)
            _, margins, _ = on_best_wrist(robot, q, allowed(self.cell.configuration.wrist, WRIST), need)
            missed[reached] = np.maximum(0.0, need - margins) / np.pi
        return missed

    def _met(self, sides: list[list[Side]], choice: tuple[int, ...], known: dict) -> np.ndarray:
        """Return the clearance missed between robots, looking only where both robots alone are feasible."""
        missed = np.zeros(len(sides[0][0].missed))
        for (k, l), meeting in self._meetings.items():
            key = (k, l, choice[k], choice[l])
            if key not in known:
                a, b = sides[k][choice[k]], sides[l][choice[l]]
                known[key] = np.zeros(len(missed))
                both = a.feasible & b.feasible
                if both.any():
                    gaps = meeting(_rows(a.ends, both), _rows(b.ends, both))[0]
                    known[key][both] = self._missed_gap(lowest(gaps, int(both.sum())))
            missed = np.maximum(missed, known[key])
        return missed

    def _work_gap(self, X: np.ndarray) -> np.ndarray:
        return lowest(self._work_height([c[:, None] for c in X.T], self._points)[0], len(X))  # type: ignore[operator]

    def _missed_gap(self, gap: np.ndarray) -> np.ndarray:
        limits = self.cell.constraints
        return np.maximum(0.0, limits.clearance_m + limits.clearance_margin_m - gap) / GAP_SCALE_M

    def _mmr(self, chosen: list[Side]) -> np.ndarray:
        tight = [s.coupling.kind == "tight" for s in self.cell.stations]
        with np.errstate(all="ignore"):  # a stretched or folded arm may give 0/0; such a candidate is infeasible
            value = mmr(self.cell.objective.reading, [s.w for s in chosen], [s.gram for s in chosen], tight).mean(
                axis=1
            )
        return np.where(np.isfinite(value), value, -np.inf)


def allowed(choice: str, all_: dict[str, int]) -> list[str]:
    """Return the branch names a configuration entry allows."""
    return list(all_) if choice == "any" else [choice]


def lowest(gaps: list[np.ndarray], m: int) -> np.ndarray:
    """Return the smallest of all gaps over the points, shape (m,)."""
    low = np.full(m, np.inf)
    for gap in gaps:
        np.minimum(low, np.min(gap, axis=1) if np.ndim(gap) == 2 else gap, out=low)
    return low


def _rows(arrays: list[np.ndarray], mask: np.ndarray) -> list[np.ndarray]:
    """Return the masked candidates of each array; arrays that do not depend on the candidate stay as they are."""
    return [a[mask] if np.ndim(a) == 2 and len(a) == len(mask) else a for a in arrays]


def _keep_better(best: Evaluation, objective: np.ndarray, missed: np.ndarray, mode: int) -> None:
    """Replace in place where a mode misses less, or as little with a higher objective."""
    total, known = missed.sum(axis=1), best.total
    better = (total < known) | ((total == known) & (objective > best.objective))
    best.objective[better], best.violation[better], best.mode[better] = objective[better], missed[better], mode
