"""A grid of tasks, each in a process of its own, killed when its time is up; records are stored as they come."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Protocol

from pydantic import ValidationError

from nlpweld.bench.apart import GRACE_S, Ending, Job
from nlpweld.bench.engines import Engine, Local
from nlpweld.bench.store import known_record, owned, write_record
from nlpweld.bench.task import Task, failed
from nlpweld.cell.cell import Cell
from nlpweld.errors import OptionError
from nlpweld.records.model import Record
from nlpweld.solvers import Budget, make_solver


class Watcher(Protocol):
    """Is told how a study goes on."""

    def begin(self, tasks: int, slots: int) -> None:
        """Take note of how many tasks there are, and how many run at once."""

    def told(self, record: Record, known: bool) -> None:
        """Take note of a record, and whether it was already there."""


class Quiet:
    """A watcher that shows nothing."""

    def begin(self, tasks: int, slots: int) -> None:
        """Take no note."""

    def told(self, record: Record, known: bool) -> None:
        """Take no note."""


def grid(
    cells: Sequence[Cell],
    solvers: Sequence[str],
    seeds: Iterable[int],
    formulations: Sequence[str] = ("reduced",),
    budget: Budget | None = None,
    label: str = "",
    limit_mb: int | None = None,
) -> list[Task]:
    """Return one task for each cell, formulation, solver and seed.

    Args:
        cells: the cells.
        solvers: names, each with an optional preset as ``name:preset``.
        seeds: the seeds.
        formulations: names of formulations.
        budget: limits of each task.
        label: name of the cell's folder, if it is not the cell's own.
        limit_mb: memory a task may take, or None.

    Raises:
        OptionError: no such solver or preset.
    """
    pairs = [(name, preset or "default") for name, _, preset in (solver.partition(":") for solver in solvers)]
    for name, preset in pairs:
        make_solver(name, preset)
    return [
        Task(cell, name, seed, preset, formulation, budget or Budget(), label, limit_mb=limit_mb)
        for cell, formulation, (name, preset), seed in product(cells, formulations, pairs, seeds)
    ]


def run(
    tasks: Sequence[Task],
    folder: Path,
    engine: Engine | None = None,
    watch: Watcher | None = None,
    again: bool = False,
) -> list[Record]:
    """Run tasks that the folder does not hold yet and return all their records in the order of the tasks.

    Args:
        tasks: what to run.
        folder: the study's folder; records go to its ``records/``.
        engine: where to run; one process at a time on this machine by default.
        watch: told of each record as it arrives.
        again: whether tasks whose record says FAILED are run again; failure is data, so by default they are not.

    Raises:
        OptionError: two tasks want the same record.
        OutputError: the folder cannot be written, another run is at work in it, or it holds a broken record; nothing
            was run.
    """
    engine, watch = engine or Local(), watch or Quiet()
    _refuse_twins(tasks)
    with owned(folder):
        records = dict(_stored(tasks, folder, again))
        watch.begin(len(tasks), engine.slots)
        for record in records.values():
            watch.told(record, True)
        waiting = [index for index in range(len(tasks)) if index not in records]
        for number, ending in engine.run([_job(tasks[index]) for index in waiting]):
            index = waiting[number]
            records[index] = _record(tasks[index], ending)
            write_record(folder, tasks[index], records[index])
            watch.told(records[index], False)
    return [records[index] for index in range(len(tasks))]


def _stored(tasks: Sequence[Task], folder: Path, again: bool) -> Iterator[tuple[int, Record]]:
    for index, task in enumerate(tasks):
        record = known_record(folder, task)
        if record is not None and not (again and record.status == "FAILED"):
            yield index, record


def _job(task: Task) -> Job:
    limit_s = None if task.budget.time_s is None else task.budget.time_s + GRACE_S
    return Job(task.to_json(), limit_s, task.limit_mb)


def _record(task: Task, ending: Ending) -> Record:
    """Return the record a process wrote, or one that says how it failed."""
    if ending.record is None:
        return failed(task, ending.message, ending.wall_s, ending.status, ending.stderr)
    try:
        record = Record.model_validate(ending.record)
    except ValidationError as error:
        why = f"no record came back: {error.errors()[0]['msg']}"
        return failed(task, why, ending.wall_s, stderr=ending.stderr)
    return record.model_copy(update={"wall_s": ending.wall_s})


def _refuse_twins(tasks: Sequence[Task]) -> None:
    """Refuse tasks that want the same record.

    Raises:
        OptionError: names the record.
    """
    known: dict[str, str] = {}
    for task in tasks:
        if known.setdefault(task.place, task.key) != task.key:
            raise OptionError(f"two different runs want the record {task.place}; give one of them a label")
