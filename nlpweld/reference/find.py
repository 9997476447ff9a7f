"""A cell's reference from nothing: the best verified answer, and branch and bound until nothing can be much better."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from nlpweld.bench.task import PACKAGES
from nlpweld.cell.cell import Cell
from nlpweld.engine.choice import chosen_engine
from nlpweld.errors import OptionError
from nlpweld.kinematics.manipulability import magnitude
from nlpweld.reference.best import Found, best_verified
from nlpweld.reference.bound import CellBound
from nlpweld.reference.checkpoint import load_tree, save_tree
from nlpweld.reference.record import Reference
from nlpweld.reference.tree import Tree, explore, whole

SEARCH_VERSION = 1  # of what decides how a search goes on; raise it when enclosures or rounds change
SAVED_EVERY = 5  # rounds


@dataclass(frozen=True)
class Effort:
    """How hard is tried.

    Attributes:
        gap: share of the objective that may be left between it and the bound.
        boxes: number of boxes after which the search ends whatever is left.
        candidates: placements of the search for the best answer.
        polished: how many of them Ipopt descends from.
        between: parts into which the bound cuts every step of the seam, where robots carry the work.
        seed: of the candidates.
        engine: ``numpy``, ``numba`` or ``auto``.
    """

    gap: float = 2e-4
    boxes: int = 1_000_000
    candidates: int = 2**15
    polished: int = 4
    between: int = 4
    seed: int = 0
    engine: str = "auto"


@dataclass(frozen=True)
class Progress:
    """What is going on.

    Attributes:
        step: its name.
        done: how much of it is done.
        total: of how much, or None where nobody knows.
        note: how it stands.
    """

    step: str
    done: int
    total: int | None
    note: str = ""


Told = Callable[[Progress], None]


def find_reference(cell: Cell, effort: Effort, checkpoint: Path, told: Told = lambda _: None) -> Reference:
    """Return the reference of a cell in the reduced formulation.

    An interrupted search goes on from its checkpoint, and ends as it would have; the checkpoint is removed at the end.

    Args:
        cell: the cell, its branches opened or held.
        effort: how hard to try.
        checkpoint: file of the search.
        told: called now and then.

    Raises:
        OptionError: no candidate leads to a verified answer, or the cell asks for what has no bound yet: another
            objective than the mean over the seam, or bases that are free.
        OutputError: the checkpoint cannot be written.
    """
    if cell.objective.over_seam != "mean":
        raise OptionError(f"{cell.name}: bounds are of the mean over the seam, not of its {cell.objective.over_seam}")
    if any(station.layout for station in cell.stations):
        raise OptionError(f"{cell.name}: bounds are of placements, and its bases are free; hold them")
    margins, best = best_verified(
        cell, effort.seed, effort.candidates, effort.polished, lambda *step: told(Progress(*step)), effort.engine
    )
    # the positioner's own motion between points is the plan's, not known beforehand
    between = 1 if cell.positioner else effort.between
    unit = magnitude(cell.objective.reading, cell.tight)
    tree = bounded(cell, best.objective / unit, between, effort, checkpoint, told)
    checkpoint.unlink(missing_ok=True)
    return _reference(cell, margins, best, tree, between, effort)


def bounded(cell: Cell, known: float, between: int, effort: Effort, checkpoint: Path, told: Told) -> Tree:
    """Return the search that proves what no placement is above, ended or out of boxes.

    Args:
        cell: the cell.
        known: objective that is reached, over the size of the reading's unit.
        between: parts into which every step of the seam is cut for the levels.
        effort: how hard to try.
        checkpoint: file of the search.
        told: called after every round.
    """
    target, engine = known + effort.gap * abs(known), chosen_engine(effort.engine)
    bound = CellBound(cell, "numba" if engine == "numba" else "numpy", between)
    key = json.dumps([SEARCH_VERSION, cell.content_hash, target, between, engine, version("numpy"), version("scipy")])
    tree = load_tree(checkpoint, key) or whole(cell.box, len(bound.modes))
    latest, rounds = tree, 0

    def keep(now: Tree) -> None:
        nonlocal latest, rounds
        latest, rounds = now, rounds + 1
        if rounds % SAVED_EVERY == 0:
            save_tree(checkpoint, latest, key)
        share = 1 - known / now.upper_bound if np.isfinite(now.upper_bound) else np.inf
        told(Progress("bounding", now.boxes, None, f"{len(now.bound)} open, gap {100 * share:.3g} %"))

    try:
        return explore(tree, bound, target, effort.boxes, keep)
    finally:
        save_tree(checkpoint, latest, key)


def _reference(cell: Cell, margins: Found, best: Found, tree: Tree, between: int, effort: Effort) -> Reference:
    upper = tree.upper_bound * magnitude(cell.objective.reading, cell.tight)
    branches = best.plan.branches or {}
    return Reference(
        cell=cell.name,
        content_hash=cell.content_hash,
        formulation="reduced",
        objective=best.objective,
        placement=best.plan.placement.tolist(),
        branches={name: list(branch) for name, branch in branches.items()},
        objective_with_margins=margins.objective,
        placement_with_margins=margins.plan.placement.tolist(),
        upper_bound=upper if np.isfinite(upper) else None,
        rigorous=True,
        boxes=tree.boxes,
        open_boxes=len(tree.bound),
        levels_points=cell.seam.points * between,
        seed=effort.seed,
        candidates=effort.candidates,
        how=_how(),
        versions={name: _version(name) for name in (*PACKAGES, "numba")},
    )


def _how() -> dict[str, str]:
    return {
        "objective": "sampled: the best candidates polished by Ipopt, verified along the whole seam; without margins, "
        "those of the solvers were taken back until the verifier refused",
        "upper_bound": "rigorous: branch and bound on affine enclosures with all rounding covered; reach, singularity "
        "floor and joints 1, 2, 3 and 5 without margins at levels_points points, heights over the floor at the seam's "
        "own; other clearances and joints and the rest of the seam left out, which can only raise it",
    }


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"
