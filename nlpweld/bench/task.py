"""A task of a study, its key, and the record it leaves."""

import hashlib
import json
import os
import platform
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np

from nlpweld.bench.answer import Answer, formulate, solve
from nlpweld.bench.held import held_answers
from nlpweld.cell.cell import VARIABLES, Cell
from nlpweld.errors import NlpweldError
from nlpweld.records.model import VERSION, Record, Trace
from nlpweld.solvers import Budget, presets
from nlpweld.solvers.base import Step

PACKAGES = ("nlpweld", "casadi", "numpy", "scipy", "pymoo", "python-fcl")
DIGITS = 6  # of times and coordinates in a trace


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
        options: single options of the solver, on top of the preset.
        variant: name for the preset with these options; needed where there are any.
        limit_mb: memory the run may take, or None.
    """

    cell: Cell
    solver: str
    seed: int
    preset: str = "default"
    formulation: str = "reduced"
    budget: Budget = field(default_factory=Budget)
    label: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    variant: str = ""
    limit_mb: int | None = None

    @property
    def chosen(self) -> dict[str, Any]:
        """Options of the solver that differ from its own defaults."""
        return {**presets(self.solver)[self.preset], **self.options}

    @property
    def key(self) -> str:
        """Hash of all that decides the answer: cell, formulation, options, seed, limits and record version."""
        decisive = [
            VERSION,
            self.cell.content_hash,
            self.formulation,
            self.solver,
            self.chosen,
            self.seed,
            asdict(self.budget),
            self.limit_mb,
        ]
        return hashlib.sha256(json.dumps(decisive, sort_keys=True).encode()).hexdigest()

    @property
    def place(self) -> str:
        """Path of the record below ``records/``, without its ending."""
        contestant = f"{self.solver}-{self.variant or self.preset}"
        return f"{self.label or self.cell.name}/{self.formulation}/{contestant}/seed{self.seed:03d}"

    def to_json(self) -> dict[str, Any]:
        """Return the task as plain data, for another process."""
        names = ("solver", "seed", "preset", "formulation", "label", "variant", "limit_mb")
        data = {name: getattr(self, name) for name in names} | {"options": dict(self.options)}
        return {**data, "budget": asdict(self.budget), "cell": self.cell.model_dump(mode="json", exclude_unset=True)}

    @staticmethod
    def from_json(data: dict[str, Any]) -> "Task":
        """Return the task written by :meth:`to_json`."""
        return Task(**{**data, "budget": Budget(**data["budget"]), "cell": Cell.model_validate(data["cell"])})


def run_task(task: Task) -> Record:
    """Run a task in this process and return its record; our own errors become a FAILED record, others get through."""
    began = time.perf_counter()
    try:
        nlp = formulate(task.cell, task.formulation)
        answer = solve(nlp, task.solver, seed=task.seed, budget=task.budget, preset=task.preset, **task.options)
        held = held_answers(nlp, answer)
    except NlpweldError as error:
        return failed(task, f"{type(error).__name__}: {error}", time.perf_counter() - began)
    outcome = answer.outcome
    return Record(
        **_head(task),
        status=outcome.status,
        message=outcome.message,
        verified=answer.verified,
        variables=len(nlp.names),
        placement=None if outcome.x is None else _placement(task.cell, outcome.x),
        layout=_layout(task.cell, outcome.x),
        claimed_objective=_number(outcome.objective),
        evaluations=outcome.evaluations,
        build_s=outcome.build_s,
        solve_s=outcome.solve_s,
        wall_s=time.perf_counter() - began,
        trace=_trace(task.cell, outcome.trace),
        answers=held,
        sharpening=[{name: _number(v) for name, v in step.items()} for step in outcome.sharpening],
        starts=[_number(objective) for objective in outcome.starts],
        report=answer.report.to_json() if answer.report else None,
        branches=_branches(answer),
    )


def failed(task: Task, message: str, wall_s: float, status: str = "FAILED", stderr: list[str] | None = None) -> Record:
    """Return the record of a task that brought no outcome."""
    ended: dict[str, Any] = {"status": status, "message": message, "stderr": stderr or []}
    return Record(**_head(task), **ended, verified=False, wall_s=wall_s)


def _head(task: Task) -> dict[str, Any]:
    cores = os.cpu_count() or 0
    return {
        "key": task.key,
        "cell": task.label or task.cell.name,
        "cell_hash": task.cell.content_hash,
        "formulation": task.formulation,
        "solver": task.solver,
        "preset": task.variant or task.preset,
        "options": task.chosen,
        "seed": task.seed,
        "budget": asdict(task.budget),
        "limit_mb": task.limit_mb,
        "versions": {name: version(name) for name in PACKAGES},
        "machine": {
            "system": platform.system(),
            "processor": platform.machine(),
            "python": platform.python_version(),
            "cores": cores,
        },
    }


def _trace(cell: Cell, steps: tuple[Step, ...]) -> Trace:
    """Return a trace column by column."""
    places = [_placement(cell, step.x) for step in steps]
    columns: dict[str, Any] = {
        "time_s": [round(step.time_s, DIGITS) for step in steps],
        "evaluations": [step.evaluations for step in steps],
    }
    for name in ("best", "mean", "spread"):
        columns[name] = [_number(getattr(step, name)) for step in steps]
    names = places[0] if places else ()
    placement = {name: [round(place[name], DIGITS) for place in places] for name in names}
    return Trace(**columns, placement=placement)


def _placement(cell: Cell, x: np.ndarray) -> dict[str, float]:
    """Return all coordinates of a placement by name, those the cell holds included; x may go on with joints."""
    whole = cell.placement(x[: len(cell.variables)]).tolist()
    return dict(zip(VARIABLES, whole, strict=True))


def _branches(answer: Answer) -> dict[str, list[str]] | None:
    branches = answer.plan.branches if answer.plan else None
    return None if branches is None else {name: list(branch) for name, branch in branches.items()}


def _layout(cell: Cell, x: np.ndarray | None) -> dict[str, dict[str, float]]:
    """Return where bases stand that a search may move, by robot; nothing where all are held."""
    return {} if x is None else cell.layout(x[: len(cell.variables)])


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
