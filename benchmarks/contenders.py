"""Everybody who takes part, by name; those whose packages are missing say so."""

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch

Verdicts = tuple[np.ndarray, np.ndarray]
WHAT = {
    "naive": "per-point loops, NumPy 4 x 4 matrices, python-fcl; stops at a point out of reach",
    "naive_early": "the same, but no clearances where joint limits or singularity floor fail",
    "peers": "EAIK, pinocchio and coal; loops over points only; leaves out as early as nlpweld",
    "casadi_vm": "nlpweld's graphs in CasADi's virtual machine, mapped over the seam; leaves out as early",
    "nlpweld_numpy": "Batch, NumPy engine (base install)",
    "nlpweld_numba": "Batch, Numba engine (extra `fast`)",
}
NEEDS = {"peers": ("pinocchio", "coal", "eaik"), "nlpweld_numba": ("numba",)}
ENGINES = {"nlpweld_numpy": "numpy", "nlpweld_numba": "numba"}


def missing(name: str) -> str | None:
    """Return which packages a contender lacks here, or None."""
    lacking = [package for package in NEEDS.get(name, ()) if find_spec(package) is None]
    return f"not installed: {', '.join(lacking)}" if lacking else None


def contender(name: str, cell: Cell) -> Callable[[np.ndarray], Verdicts]:
    """Return a contender: placements (m, 3) [m] to mean MMR (m,) and feasibility (m,)."""
    if name in ENGINES:
        return _engine(Batch(cell, engine=ENGINES[name]))
    if name == "peers":
        from benchmarks.peers import Peers

        return _loop(Peers(cell))
    if name == "casadi_vm":
        from benchmarks.vm import Vm

        return _loop(Vm(cell))
    from benchmarks.naive import Naive

    return _loop(Naive(cell, early=name == "naive_early"))


def _engine(batch: Batch) -> Callable[[np.ndarray], Verdicts]:
    def run(X: np.ndarray) -> Verdicts:
        found = batch.evaluate(X)
        return found.objective, found.feasible

    return run


def _loop(verdicts: Callable[[np.ndarray], list]) -> Callable[[np.ndarray], Verdicts]:
    def run(X: np.ndarray) -> Verdicts:
        said = verdicts(X)
        return np.array([v.mmr for v in said]), np.array([v.feasible for v in said])

    return run
