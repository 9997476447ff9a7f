"""Pages made when the site is built: the cell file from its schema, the command line from its own help."""

import inspect
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from nlpweld.cell import Cell
from nlpweld.cell.files import LIBRARY
from nlpweld.cli.app import app

UNITS = {
    "_deg_s3": "deg/s^3",
    "_deg_s2": "deg/s^2",
    "_deg_s": "deg/s",
    "_deg": "deg",
    "_m_s3": "m/s^3",
    "_m_s2": "m/s^2",
    "_m_s": "m/s",
    "_m3": "m^3",
    "_m": "m",
}
OWN = {"robot": ("", "in a robot or positioner file"), "tool": ("[tools.NAME]", "")}  # a station names these


def write(folder: Path) -> None:
    """Write the generated pages into a folder, as Markdown that other pages include."""
    folder.mkdir(exist_ok=True)
    (folder / "cell-file.md").write_text(cell_file())
    (folder / "commands.md").write_text(commands())
    (folder / "cells.md").write_text(built_in())


def commands() -> str:
    """Return the help of every command, as the command line prints it."""
    group = typer.main.get_command(app)
    pages = []
    for name, command in group.commands.items():  # type: ignore[attr-defined]
        context = command.make_context(name, [], resilient_parsing=True)
        context.info_name, context.terminal_width, context.max_content_width = f"nlpweld {name}", 100, 100
        pages.append(f"## {name}\n\n```text\n{command.get_help(context).strip()}\n```\n")
    return "\n".join(pages)


def built_in() -> str:
    """Return the built-in cells, robots, positioners and palletising tasks with their titles."""
    from nlpweld.cell import library_names, load_cell, load_positioner, load_robot
    from nlpweld.palletising import load_pallet_task

    loaders = {"cells": load_cell, "robots": load_robot, "positioners": load_positioner}
    loaders["palletising"] = load_pallet_task
    rows = [
        (name, kind.removesuffix("s"), load(name).title)
        for kind, load in loaders.items()
        for name in library_names(kind)
    ]
    assert {kind.name for kind in LIBRARY.iterdir() if any(kind.glob("*.toml"))} == set(loaders)
    lines = [f"| `{name}` | {kind} | {title} |" for name, kind, title in rows]
    return "\n".join(["| name | what | title |", "|---|---|---|", *lines]) + "\n"


def cell_file() -> str:
    """Return every table of a cell file with its fields, units, defaults and docstrings, from the schema."""
    schema = Cell.model_json_schema(mode="validation")
    models = {"Cell": schema} | schema["$defs"]
    tables = _tables("Cell", "", "", models, set())
    return "\n".join(_section(name, title, models) for name, title in tables)


def _tables(name: str, table: str, file: str, models: dict[str, Any], seen: set[str]) -> Iterator[tuple[str, str]]:
    """Yield models and where a file has them, each once, in the order of the fields that lead to them."""
    if name in seen:
        return
    seen.add(name)
    yield name, " ".join(filter(None, [f"`{table}`" if table else "", file])) or "the file itself"
    for field, schema in models[name].get("properties", {}).items():
        dotted = ".".join(filter(None, [table.strip("[]"), field]))
        inner, inner_file = OWN.get(field) or (f"[[{dotted}]]" if "items" in schema else f"[{dotted}]", file)
        for found in _references(schema):
            yield from _tables(found, inner, inner_file, models, seen)


def _references(schema: Any) -> list[str]:
    """Return the names of models that a schema refers to, in order."""
    if isinstance(schema, list):
        return [name for item in schema for name in _references(item)]
    if not isinstance(schema, dict):
        return []
    own = [schema["$ref"].rpartition("/")[2]] if "$ref" in schema else []
    return own + [name for key, item in schema.items() if key != "discriminator" for name in _references(item)]


def _section(name: str, title: str, models: dict[str, Any]) -> str:
    prose, meanings = _docstring(models[name].get("description", ""))
    lines = [f"(schema-{name.lower()})=", f"## {name}: {title}", "", prose, ""]
    required, rows = models[name].get("required", []), [["field", "takes", "unit", "default", "meaning"]]
    for field, schema in sorted(models[name]["properties"].items(), key=lambda item: item[0] == "source"):
        default = "required" if field in required else _default(schema)
        rows.append([f"`{field}`", _kind(schema), _unit(field), default, meanings.get(field, "")])
    told = [any(column[1:]) for column in zip(*rows, strict=True)]  # a column that says nothing is left out
    for row in rows:
        cells = [cell.replace("|", "\\|") for cell, column in zip(row, told, strict=True) if column]
        lines.append(f"| {' | '.join(cells)} |")
        lines += ["|---" * len(cells) + "|"] if row is rows[0] else []
    return "\n".join([*lines, ""])


def _docstring(text: str) -> tuple[str, dict[str, str]]:
    """Return the prose of a Google-style docstring as Markdown, and what it says of attributes by name."""
    prose, _, attributes = inspect.cleandoc(text).partition("Attributes:\n")
    told = re.findall(r"^ {4}(\w+): (.*(?:\n {5,}.*)*)", attributes, re.M)
    return _markdown(prose.strip()), {name: " ".join(_markdown(text).split()) for name, text in told}


def _markdown(text: str) -> str:
    """Return text with roles and literals of reStructuredText as Markdown."""
    return re.sub(r":\w+:`~?([\w.]*\.)?(\w+)`", r"`\2`", text).replace("``", "`")


def _unit(field: str) -> str:
    return next((unit for suffix, unit in UNITS.items() if field.endswith(suffix)), "")


def _default(schema: dict[str, Any]) -> str:
    if "default" not in schema:
        return "empty"
    value = schema["default"]
    if value is None:
        return "none"
    return "empty" if value == [] else f"`{json.dumps(value)}`"


def _kind(schema: dict[str, Any]) -> str:
    """Return in words what a field takes."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#schema-{name.lower()})"
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return " or ".join(dict.fromkeys(_kind(s) for s in schema[key] if s.get("type") != "null"))
    if "const" in schema or "enum" in schema:
        return " or ".join(f"`{json.dumps(value)}`" for value in schema.get("enum", [schema.get("const")]))
    kind = schema.get("type")
    if kind == "array":
        fixed = [_kind(item) for item in schema.get("prefixItems", [])]
        return f"{len(fixed)} x {fixed[0]}" if fixed else f"list of {_kind(schema['items'])}"
    if kind == "object":
        of = schema.get("additionalProperties") or next(iter(schema["patternProperties"].values()))
        return f"table by name of {_kind(of)}"
    return {"number": "number", "integer": "whole number", "boolean": "true or false", "string": "text"}[kind] + (
        _bounds(schema)
    )


def _bounds(schema: dict[str, Any]) -> str:
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    return "".join(f" {sign} {schema[key]:g}" for key, sign in signs.items() if key in schema)
