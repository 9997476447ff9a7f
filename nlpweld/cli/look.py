"""Commands that list what there is."""

import json as json_
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from nlpweld.cell import library_names, load_cell, load_positioner, load_robot
from nlpweld.cell.checked import Checked, Sourced, holds_number


def cells(json: bool) -> None:
    """Print what is built in."""
    from nlpweld.palletising import load_pallet_task
    from nlpweld.solvers import presets, solver_names

    found = {
        "cells": {name: load_cell(name).title for name in library_names("cells")},
        "robots": {name: load_robot(name).title for name in library_names("robots")},
        "positioners": {name: load_positioner(name).title for name in library_names("positioners")},
        "palletising": {name: load_pallet_task(name).title for name in library_names("palletising")},
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
