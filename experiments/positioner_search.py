"""A sampled reference optimum over the box of (HD, FB), and maps of it."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from nlpweld.cell import Cell
from nlpweld.errors import NlpweldError
from nlpweld.formulation.nlp import Evaluation, Nlp

CHUNK = 2048  # placements judged at once, so that memory stays small without Numba
FEW, APART_M = 5, 0.05  # how many of the best grid points are polished, and how far apart they are
POLISHED_M, POLISHED_VALUE = 1e-7, 1e-13  # where the simplex search stops


@dataclass(frozen=True, eq=False)
class Sampled:
    """The best of an exhaustive grid, polished; the best that was seen, not a bound.

    Attributes:
        x: the free coordinates, shape (d,) [m].
        value: objective there.
        mode: branches there.
        grid_best: best objective on the grid itself.
        grid_points: placements on the grid.
        feasible_share: share of them that is feasible.
        polish_evaluations: placements judged by the simplex searches.
    """

    x: np.ndarray
    value: float
    mode: int
    grid_best: float
    grid_points: int
    feasible_share: float
    polish_evaluations: int


def box_grid(lower: np.ndarray, upper: np.ndarray, step_m: float) -> np.ndarray:
    """Return a grid over a box, both ends included, steps as near ``step_m`` as divide its sides, shape (m, d)."""
    counts = np.round((upper - lower) / step_m).astype(int) + 1
    axes = [np.linspace(lo, hi, n) for lo, hi, n in zip(lower, upper, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def judged(nlp: Nlp, X: np.ndarray) -> Evaluation:
    """Return what the exact model says of placements X (m, d), chunk by chunk."""
    parts = [nlp.evaluate(X[i : i + CHUNK]) for i in range(0, len(X), CHUNK)]
    columns = ("objective", "violation", "mode")
    return Evaluation(*(np.concatenate([getattr(part, name) for part in parts]) for name in columns))


def sampled_optimum(nlp: Nlp, step_m: float) -> Sampled:
    """Return the best of a grid over the box, polished by simplex searches from the best few points.

    Raises:
        NlpweldError: no point of the grid is feasible.
    """
    X = box_grid(nlp.lower, nlp.upper, step_m)
    found = judged(nlp, X)
    if not found.feasible.any():
        raise NlpweldError(f"{nlp.problem}: nothing on a grid of {step_m:g} m is feasible; take a finer one")
    value = np.where(found.feasible, found.objective, -np.inf)
    starts = [X[i] for i in _best_apart(X, value)]
    results = [_polished(nlp, start, step_m) for start in starts]
    best = min(results, key=lambda r: r.fun)
    return Sampled(
        x=best.x,
        value=-float(best.fun),
        mode=int(nlp.evaluate(best.x[None]).mode[0]),
        grid_best=float(value.max()),
        grid_points=len(X),
        feasible_share=float(found.feasible.mean()),
        polish_evaluations=sum(r.nfev for r in results),
    )


def _best_apart(X: np.ndarray, value: np.ndarray) -> list[int]:
    """Return the best feasible points, best first, of which no two are near each other."""
    chosen: list[int] = []
    for i in np.argsort(-value, kind="stable"):
        if len(chosen) == FEW or not np.isfinite(value[i]):
            break
        if all(np.linalg.norm(X[i] - X[j]) >= APART_M for j in chosen):
            chosen.append(int(i))
    return chosen


def _polished(nlp: Nlp, start: np.ndarray, step_m: float):
    """Return where a simplex search on the exact model ends; an infeasible placement counts by how far it misses."""

    def cost(x: np.ndarray) -> float:
        found = nlp.evaluate(x[None])
        return -float(found.objective[0]) if found.feasible[0] else float(found.total[0])

    inwards = np.where(start + step_m > nlp.upper, -step_m, step_m)
    options = {
        "initial_simplex": np.vstack([start, start + np.diag(inwards)]),
        "xatol": POLISHED_M,
        "fatol": POLISHED_VALUE,
        "maxfev": 2000,
    }
    return minimize(
        cost, start, method="Nelder-Mead", bounds=list(zip(nlp.lower, nlp.upper, strict=True)), options=options
    )


def placement_map(nlp: Nlp, cell: Cell, X: np.ndarray) -> pd.DataFrame:
    """Return the objective and the first constraint that fails at placements X (m, d).

    Columns: x_m, y_m, z_m, mmr, first_failing (``feasible`` where none fails).
    """
    found = judged(nlp, X)
    failing = np.array([*nlp.constraints, "feasible"])
    missed = np.column_stack([found.violation > 0.0, np.ones(len(X), dtype=bool)])
    table = pd.DataFrame(np.array([cell.placement(x)[:3] for x in X]), columns=["x_m", "y_m", "z_m"])
    table["mmr"] = np.where(np.isfinite(found.objective), found.objective, np.nan)
    table["first_failing"] = failing[missed.argmax(axis=1)]
    return table
