"""Study files: a comparison written down as TOML, turned into tasks."""

import re
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from nlpweld.bench.answer import known_formulation, with_branches
from nlpweld.bench.task import Task
from nlpweld.cell.cell import Cell
from nlpweld.cell.checked import Checked, Positive
from nlpweld.cell.complaint import first_complaint, nearest
from nlpweld.cell.files import checked, read_toml
from nlpweld.cell.levels import Reading
from nlpweld.cell.load import load_cell
from nlpweld.errors import CellError, NlpweldError, OptionError
from nlpweld.solvers import Budget, make_solver

Count = Annotated[int, Field(strict=True, ge=1)]
Seed = Annotated[int, Field(strict=True, ge=0)]


class Contestant(Checked):
    """A solver with options of its own; ``variant`` names them in tables."""

    solver: str
    preset: str = "default"
    variant: str = ""
    options: dict[str, Any] = Field(default_factory=dict)


class Runs(Checked):
    """One block of a study: every cell (or variant of it) x formulation x solver x seed.

    ``vary`` maps fields of the cell, dots between, to the values each takes; list items are called by their name or
    counted from 0, e.g. ``"seam.points"`` or ``"stations.welder.tool.translation_m.2"``. All combinations are made.
    ``set`` changes fields likewise, to one value. ``label`` names the variant; ``{}`` in it stands for the values.
    """

    cells: Annotated[tuple[str, ...], Field(min_length=1)]
    solvers: Annotated[tuple[str | Contestant, ...], Field(min_length=1)]
    formulations: Annotated[tuple[str, ...], Field(min_length=1)] = ("reduced",)
    seeds: Count | tuple[Seed, ...] = 1
    time_limit_s: Positive | None = None
    evaluations: Count | None = None
    memory_mb: Count | None = None
    branches: Literal["front", "any"] | None = None
    reading: Reading | None = None
    vary: dict[str, Annotated[tuple[Any, ...], Field(min_length=1)]] = Field(default_factory=dict)
    set: dict[str, Any] = Field(default_factory=dict)
    label: str = ""


class StudyFile(Checked):
    """A study: what is compared, and why."""

    title: str
    runs: Annotated[tuple[Runs, ...], Field(min_length=1)]


def load_study(path: str | Path) -> list[Task]:
    """Return the tasks of a study file.

    Cells may be built-in names, or paths that start beside the file.

    Raises:
        CellError: the file or a cell of it cannot be read, or a field is wrong; one line names file, field and mend.
    """
    path = Path(path)
    study = checked(StudyFile, read_toml(path), path)
    tasks: list[Task] = []
    for i, runs in enumerate(study.runs, start=1):
        try:
            tasks += _tasks(runs, path)
        except NlpweldError as error:
            raise CellError(f"{path}: runs.{i}: {error}") from None
    return tasks


def changed(cell: Cell, changes: Mapping[str, Any]) -> Cell:
    """Return a cell with some fields replaced, checked like a file.

    Args:
        cell: the cell.
        changes: field with dots between to its value; list items are called by their name or counted from 0.

    Raises:
        OptionError: the cell has no such field, or the value does not fit it.
    """
    data = cell.model_dump(mode="json", exclude_unset=True)
    for field, value in changes.items():
        *way, last = field.split(".")
        at: Any = data
        for part in way:
            at = at[_index(at, part, field)]
        at[last if isinstance(at, dict) else _index(at, last, field)] = value
    try:
        return Cell.model_validate(data)
    except ValidationError as error:
        raise OptionError(f"{cell.name}: {first_complaint(error, data)}") from None


def _index(at: Any, part: str, field: str) -> str | int:
    """Return the key or index that one part of a field's name means."""
    if isinstance(at, dict):
        names = {name: name for name in at}
    elif isinstance(at, list):
        names = {str(item.get("name", i)) if isinstance(item, dict) else str(i): i for i, item in enumerate(at)}
    else:
        names = {}
    if part not in names:
        raise OptionError(f"field '{field}': no '{part}'; {nearest(part, names)}")
    return names[part]


def _tasks(runs: Runs, path: Path) -> Iterator[Task]:
    contestants = [_contestant(solver) for solver in runs.solvers]
    formulations = [known_formulation(name) for name in runs.formulations]
    seeds = range(runs.seeds) if isinstance(runs.seeds, int) else runs.seeds
    budget = Budget(runs.evaluations, runs.time_limit_s)
    for cell, label in _cells(runs, path):
        for formulation, c, seed in product(formulations, contestants, seeds):
            own = label, c.options, c.variant, runs.memory_mb
            yield Task(cell, c.solver, seed, c.preset, formulation, budget, *own)


def _cells(runs: Runs, path: Path) -> Iterator[tuple[Cell, str]]:
    for name in runs.cells:
        beside = path.parent / name
        cell = with_branches(load_cell(beside if beside.is_file() else name), runs.branches)
        if runs.reading:
            cell = cell.with_(objective={"reading": runs.reading})
        for values in product(*runs.vary.values()):
            changes = {**runs.set, **dict(zip(runs.vary, values, strict=True))}
            yield changed(cell, changes) if changes else cell, _label(runs, cell, values)


def _label(runs: Runs, cell: Cell, values: tuple[Any, ...]) -> str:
    """Return the name of a variant, one that can be a folder's."""
    told = [f"{field.rpartition('.')[2]}-{value}" for field, value in zip(runs.vary, values, strict=True)]
    many = len(runs.cells) > 1
    if runs.label:
        filled = runs.label.replace("{}", "-".join(map(str, values)))
        told = [cell.name, filled] if many else [filled]
    elif told:
        told = [cell.name, *told]
    return re.sub(r"[^\w.+-]", "_", "-".join(told))


def _contestant(solver: str | Contestant) -> Contestant:
    if isinstance(solver, str):
        name, _, preset = solver.partition(":")
        solver = Contestant(solver=name, preset=preset or "default")
    elif solver.options and not solver.variant:
        raise OptionError(f"solver '{solver.solver}': options without a variant; add variant = \"a name for them\"")
    make_solver(solver.solver, solver.preset, **solver.options)
    return solver
