"""Commands that list, run grids, and write tables and figures."""

import json as json_
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from nlpweld.cell import library_names, load_cell, load_positioner, load_robot
from nlpweld.cell.checked import Checked, Sourced, holds_number
from nlpweld.cli.ask import Question, writable

if TYPE_CHECKING:
    import pandas as pd


def cells(json: bool) -> None:
    """Print what is built in."""
    from nlpweld.solvers import presets, solver_names

    found = {
        "cells": {name: load_cell(name).title for name in library_names("cells")},
        "robots": {name: load_robot(name).title for name in library_names("robots")},
        "positioners": {name: load_positioner(name).title for name in library_names("positioners")},
        "solvers": {name: ", ".join(presets(name)) for name in solver_names()},
    }
    if json:
        print(json_.dumps(found))
        return
    for kind, entries in found.items():
        print(f"{kind}:")
        for name, title in entries.items():
            print(f"  {name:<16} {'presets: ' if kind == 'solvers' else ''}{title}")


def show(name: str, json: bool) -> None:
    """Print every number of a cell beside its source."""
    cell = load_cell(name)
    if json:
        print(cell.model_dump_json())
        return
    table = Table(title=f"{cell.name}: {cell.title}", box=box.SIMPLE_HEAD, padding=(0, 1))
    for heading, ratio in (("field", 4), ("value", 5), ("source", 5)):
        table.add_column(heading, overflow="fold", ratio=ratio)
    told, before = set(), ""
    for field, value, source in numbers(cell):
        robot = next((s.robot.name for s in cell.stations if field.startswith(f"stations.{s.name}.robot.")), "")
        row = (robot, field.partition(".robot.")[2]) if robot else (field,)
        if row not in told:  # robots of one type are told once
            table.add_row(".".join(row), value, "" if source == before else source)
            told.add(row)
            before = source
    for placement, at in cell.placements.items():
        table.add_row(f"placements.{placement}", _text(at), "named in the cell file")
    Console().print(table)


def numbers(model: Checked, where: str = "") -> list[tuple[str, str, str]]:
    """Return (field, value, source) of every number below a model, in file order."""
    rows = []
    for name in type(model).model_fields:
        source = model.source_of(name) if isinstance(model, Sourced) else ""
        rows += _below(getattr(model, name), f"{where}.{name}" if where else name, source)
    return rows


def _below(value: Any, where: str, source: str) -> list[tuple[str, str, str]]:
    if isinstance(value, tuple) and any(isinstance(item, Checked) for item in value):
        named = [(getattr(item, "name", str(i + 1)), item) for i, item in enumerate(value)]
        return [row for name, item in named for row in _below(item, f"{where}.{name}", source)]
    if isinstance(value, Sourced) or (isinstance(value, Checked) and not source):
        return numbers(value, where)
    return [(where, _text(value), source)] if holds_number(value) else []


def _text(value: Any) -> str:
    """Return a number, a vector, or a row of named numbers as text."""
    if isinstance(value, Checked):
        stated = [(name, getattr(value, name)) for name in type(value).model_fields]
        return ", ".join(f"{name} {_text(item)}" for name, item in stated if item is not None)
    if isinstance(value, tuple):
        return "(" + ", ".join(_text(item) for item in value) + ")"
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def compare(asked: list[Question], out: Path, workers: int, json: bool) -> int:
    """Run the grid, keep the records, print the table; 0 when at least one answer is verified."""
    from nlpweld.bench.run import grid, run
    from nlpweld.report.tables import write_tables
    from nlpweld.solvers import Budget

    writable(out)
    tasks = [
        task
        for q in asked
        for task in grid(
            [q.cell], q.solver.split(","), range(q.seed), [q.formulation], Budget(q.evaluations, q.time_limit_s)
        )
    ]
    with progress_bar(quiet=json) as bar:
        job = bar.add_task("running", total=len(tasks))
        records = run(tasks, out, workers, lambda record, known: bar.advance(job))
    summary = write_tables(out)
    if json:
        print(json_.dumps({"out": str(out), "runs": len(records), "verified": sum(r["verified"] for r in records)}))
    else:
        _print_summary(summary)
        print(f"records and tables: {out}")
    return 0 if any(r["verified"] for r in records) else 1


def progress_bar(quiet: bool = False) -> Progress:
    """Return a bar with count and times, on standard error."""
    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    ]
    return Progress(*columns, console=Console(stderr=True, quiet=quiet))


def tables(folder: Path, json: bool) -> None:
    """Write and print the summary of a folder of records."""
    from nlpweld.report.tables import write_tables

    summary = write_tables(folder)
    if json:
        print(summary.to_json(orient="records"))
    else:
        _print_summary(summary)


def _print_summary(summary: "pd.DataFrame") -> None:
    from nlpweld.report.tables import format_summary

    console = Console()
    console.print(format_summary(summary, console.width))


def plots(folder: Path, json: bool) -> None:
    """Draw the figures of a folder of records."""
    from nlpweld.report.plots import write_plots

    left_out: list[str] = []
    paths = write_plots(folder, note=left_out.append)
    if json:
        print(json_.dumps({"figures": [str(path) for path in paths]}))
    else:
        print("\n".join(str(path) for path in paths))
        if left_out:
            print(f"{len(left_out)} more need data this folder does not hold, e.g. {left_out[0]}")
