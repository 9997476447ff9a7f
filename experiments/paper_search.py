"""Poor placements (Pan et al., Fig. 18 and 19) found by search, and maps over slices of the placement box S."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.stats import qmc

from nlpweld.cell import Cell
from nlpweld.engine.numpy_kernels import lower
from nlpweld.formulation.batch import CONSTRAINTS, Batch
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.nlp import Nlp
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import signs
from nlpweld.kinematics.manipulability import mmr
from nlpweld.records.frames import AXES

Badness = Callable[[np.ndarray, np.ndarray], np.ndarray]
ROUNDS, BROOD = 14, 31  # of the local search that follows the scan
FIRST_STEP_M, SHRINK = 0.1, 0.7


def without_floor(cell: Cell) -> Cell:
    """Return the cell with no singularity floor, so that poor placements count as possible."""
    return cell.with_(constraints={"singularity_floor_m3": 0.0, "singularity_margin_m3": 0.0})


def near_singular(w: np.ndarray, _: np.ndarray) -> np.ndarray:
    """Return how near the last robot stays to a singularity along the whole seam: minus its greatest w, shape (m,)."""
    return -w[:, -1].max(axis=1)


def unsteady(_: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return the swing of MMR along the seam, shape (m,)."""
    return np.ptp(value, axis=1)


@dataclass(frozen=True)
class Profiles:
    """Manipulabilities and MMR at every seam point of many placements, on the first branches the cell allows."""

    cell: Cell

    @cached_property
    def batch(self) -> Batch:
        """The exact model over populations."""
        return Batch(self.cell)

    @cached_property
    def _arms(self) -> list:
        return [lower(arm) for arm in self.batch.stage.arms]

    def __call__(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return w (m, robots, N) [m^3] and MMR (m, N) of placements X (m, 3) [m]."""
        points = [row[None, :] for row in point_data(self.cell, seam_parameters(self.cell))]
        found = [
            arm([c[:, None] for c in X.T], points, signs((*branch, "noflip")))
            for arm, branch in zip(self._arms, self.batch.modes[0], strict=True)
        ]
        shape = (len(X), points[0].shape[1])
        w = [np.broadcast_to(out[1][0], shape) for out in found]
        return np.stack(w, axis=1), mmr(self.cell.objective.reading, w, [out[2][0] for out in found], self.cell.tight)


def worst_placements(
    profiles: Profiles, badness: dict[str, Badness], scan: int, seed: int = 0
) -> dict[str, np.ndarray]:
    """Return for each badness the placement, reachable and inside the joint limits, that maximises it, shape (3,) [m].

    One Sobol scan of S for all, then for each rounds of Gaussian steps that shrink around the best.

    Args:
        profiles: of the cell without its singularity floor.
        badness: by name, from w (m, robots, N) and MMR (m, N) to a value (m,).
        scan: candidates of the scan, a power of two.
        seed: seed of scan and steps.
    """
    low, high = profiles.cell.box
    rng = np.random.default_rng(seed)
    X = _possible(profiles, qmc.scale(qmc.Sobol(3, rng=rng).random(scan), low, high))
    w, value = profiles(X)
    return {name: _climb(profiles, bad, X[bad(w, value).argmax()], rng) for name, bad in badness.items()}


def _climb(profiles: Profiles, badness: Badness, best: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return where rounds of shrinking random steps from a possible placement end."""
    low, high = profiles.cell.box
    for k in range(ROUNDS):
        steps = FIRST_STEP_M * SHRINK**k * rng.standard_normal((BROOD, 3))
        X = _possible(profiles, np.vstack([best, np.clip(best + steps, low, high)]))
        best = X[badness(*profiles(X)).argmax()]
    return best


def _possible(profiles: Profiles, X: np.ndarray) -> np.ndarray:
    """Return the placements that are within reach and inside the joint limits."""
    violation = profiles.batch.evaluate(X).violation
    return X[(violation[:, [CONSTRAINTS.index("reach"), CONSTRAINTS.index("joint_limit")]] == 0.0).all(axis=1)]


def slice_map(nlp: Nlp, at: np.ndarray, axis: int, points: int, within_m: float = np.inf) -> pd.DataFrame:
    """Return MMR and the first constraint that fails over a slice of S.

    Args:
        nlp: the reduced form.
        at: the point the slice goes through, shape (3,) [m].
        axis: index of the coordinate that is held.
        points: grid points along each of the other two.
        within_m: how far the slice goes from the point, at most.

    Returns:
        x_m, y_m, z_m, mmr, first_failing (``feasible`` where none fails), row by row.
    """
    low, high = np.maximum(nlp.lower, at - within_m), np.minimum(nlp.upper, at + within_m)
    grids = [np.linspace(lo, hi, points) for lo, hi in zip(low, high, strict=True)]
    grids[axis] = at[[axis]]
    X = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 3)
    found = nlp.evaluate(X)
    failing = np.array([*nlp.constraints, "feasible"])
    missed = np.column_stack([found.violation > 0.0, np.ones(len(X), dtype=bool)])
    table = pd.DataFrame(X, columns=list(AXES))
    table["mmr"] = np.where(np.isfinite(found.objective), found.objective, np.nan)
    table["first_failing"] = failing[missed.argmax(axis=1)]
    return table
