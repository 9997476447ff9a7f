"""A task of a study, its key, and the record it leaves."""

import hashlib
import json
import platform
import time
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np

from nlpweld.bench.answer import Answer, formulate, solve
from nlpweld.cell.cell import VARIABLES, Cell
from nlpweld.errors import NlpweldError
from nlpweld.solvers import Budget, presets

RECORD_VERSION = 2
PACKAGES = ("nlpweld", "casadi", "numpy", "scipy", "pymoo", "python-fcl")


@dataclass(frozen=True, eq=False)
class Task:
    """One run: a cell in a formulation, a solver with its options, a seed and a budget.

    Attributes:
        cell: the cell, whole.
        solver: name of the solver.
        seed: seed of every random draw.
        preset: named options of the solver.
        formulation: name of the formulation.
        budget: limits.
        label: name of the cell's folder, where it differs from the cell's name (e.g. other branches).
    """

    cell: Cell
    solver: str
    seed: int
    preset: str = "default"
    formulation: str = "reduced"
    budget: Budget = field(default_factory=Budget)
    label: str = ""

    @property
    def key(self) -> str:
        """Hash of all that decides the answer: cell, formulation, options, seed, budget and record version."""
        decisive = [
            RECORD_VERSION,
            self.cell.content_hash,
            self.formulation,
            self.solver,
            presets(self.solver)[self.preset],
            self.seed,
            asdict(self.budget),
        ]
        return hashlib.sha256(json.dumps(decisive, sort_keys=True).encode()).hexdigest()

    @property
    def place(self) -> str:
        """Path of the record below ``records/``, without its ending."""
        return f"{self.label or self.cell.name}/{self.formulation}/{self.solver}-{self.preset}/seed{self.seed:03d}"

    def to_json(self) -> dict[str, Any]:
        """Return the task as plain data, for another process."""
        data = {name: getattr(self, name) for name in ("solver", "seed", "preset", "formulation", "label")}
        return {**data, "budget": asdict(self.budget), "cell": self.cell.model_dump(mode="json", exclude_unset=True)}

    @staticmethod
    def from_json(data: dict[str, Any]) -> "Task":
        """Return the task written by :meth:`to_json`."""
        return Task(**{**data, "budget": Budget(**data["budget"]), "cell": Cell.model_validate(data["cell"])})


def run_task(task: Task) -> dict[str, Any]:
    """Run a task in this process and return its record; what goes wrong becomes a FAILED record."""
    began = time.perf_counter()
    try:
        nlp = formulate(task.cell, task.formulation)
        answer = solve(nlp, task.solver, seed=task.seed, budget=task.budget, preset=task.preset)
    except (NlpweldError, ArithmeticError, RuntimeError, ValueError) as error:
        return failed(task, f"{type(error).__name__}: {error}", time.perf_counter() - began)
    return _record(task, answer, time.perf_counter() - began)


def failed(task: Task, message: str, wall_s: float) -> dict[str, Any]:
    """Return the record of a task that brought no outcome."""
    return {**_head(task), "status": "FAILED", "message": message, "verified": False, "wall_s": wall_s}


def _head(task: Task) -> dict[str, Any]:
    return {
        "format": "nlpweld-record",
        "version": RECORD_VERSION,
        "key": task.key,
        "cell": task.label or task.cell.name,
        "cell_hash": task.cell.content_hash,
        "formulation": task.formulation,
        "solver": task.solver,
        "preset": task.preset,
        "options": presets(task.solver)[task.preset],
        "seed": task.seed,
        "budget": asdict(task.budget),
        "versions": {name: version(name) for name in PACKAGES},
        "machine": {"system": platform.system(), "processor": platform.machine(), "python": platform.python_version()},
    }


def _record(task: Task, answer: Answer, wall_s: float) -> dict[str, Any]:
    outcome = answer.outcome
    return {
        **_head(task),
        "status": outcome.status,
        "message": outcome.message,
        "verified": answer.verified,
        "placement": None if outcome.x is None else _placement(task.cell, outcome.x),
        "claimed_objective": _number(outcome.objective),
        "evaluations": outcome.evaluations,
        "build_s": outcome.build_s,
        "solve_s": outcome.solve_s,
        "wall_s": wall_s,
        "trace": [
            {
                "time_s": round(step.time_s, 4),
                "evaluations": step.evaluations,
                "best": _number(step.best),
                "mean": _number(step.mean),
                "spread": _number(step.spread),
                "placement": {name: round(v, 6) for name, v in _placement(task.cell, step.x).items()},
            }
            for step in outcome.trace
        ],
        "sharpening": [{name: _number(v) for name, v in step.items()} for step in outcome.sharpening],
        "report": answer.report and answer.report.to_json(),
        "branches": answer.plan and answer.plan.branches,
    }


def _placement(cell: Cell, x: np.ndarray) -> dict[str, float]:
    """Return all coordinates of a placement by name, those the cell holds included; x may go on with joints."""
    whole = cell.placement(x[: len(cell.variables)]).tolist()
    return dict(zip(VARIABLES, whole, strict=True))


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
