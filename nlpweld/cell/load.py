"""Cell and robot files: found by name or path, read as TOML, checked, and turned into frozen types."""

import difflib
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from nlpweld.cell.cell import Cell
from nlpweld.cell.checked import Checked
from nlpweld.cell.robot import Robot
from nlpweld.errors import CellError

Model = TypeVar("Model", bound=Checked)
LIBRARY = Path(str(resources.files("nlpweld"))) / "library"


def library_names(kind: str) -> list[str]:
    """Return the built-in names of one kind, ``cells`` or ``robots``, sorted."""
    return sorted(path.stem for path in (LIBRARY / kind).glob("*.toml"))


def load_cell(name_or_path: str | Path) -> Cell:
    """Load a built-in cell by name, or any cell by the path of its TOML file.

    Raises:
        CellError: the file is missing, is not TOML, or breaks the schema; one line names file, field and mend.
    """
    path = find(name_or_path, "cells")
    data = read_toml(path)
    tools = _table(data.pop("tools", {}), path, "tools")
    for station in _stations(data, path):
        where = f"stations.{station.get('name', '?')}"
        station["robot"] = _robot_data(station.get("robot"), path, where)
        station["tool"] = _named(tools, station.get("tool"), path, f"{where}.tool")
    data.setdefault("name", path.stem)
    return checked(Cell, data, path)


def load_robot(name_or_path: str | Path) -> Robot:
    """Load a built-in robot by name, or any robot by the path of its TOML file.

    Raises:
        CellError: the file is missing, is not TOML, or breaks the schema.
    """
    path = find(name_or_path, "robots")
    return checked(Robot, {"name": path.stem, **read_toml(path)}, path)


def find(name_or_path: str | Path, kind: str, beside: Path | None = None) -> Path:
    """Return the file meant by a built-in name or a path; relative paths may also start beside a given file.

    Raises:
        CellError: neither a file nor a built-in name; lists the names there are.
    """
    text = str(name_or_path)
    if not text.endswith(".toml") and "/" not in text:
        built_in = LIBRARY / kind / f"{text}.toml"
        if built_in.is_file():
            return built_in
    for path in (Path(text), beside.parent / text if beside else Path(text)):
        if path.is_file():
            return path
    names = library_names(kind)
    close = difflib.get_close_matches(text, names, n=1)
    hint = f"did you mean '{close[0]}'?" if close else f"built in are {', '.join(names)}"
    raise CellError(f"{text}: no such file and no built-in {kind[:-1]} of that name; {hint}")


def read_toml(path: Path) -> dict[str, Any]:
    """Read one TOML file.

    Raises:
        CellError: the file cannot be read or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CellError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CellError(f"{path}: not TOML: {error}; mend the syntax there") from None


def checked(model: type[Model], data: dict[str, Any], path: Path) -> Model:
    """Build a model from plain data, strictly.

    Raises:
        CellError: a field is missing, unknown, of the wrong kind, or contradicts another.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise CellError(f"{path}: {first_complaint(error, model)}") from None


def first_complaint(error: ValidationError, model: type[Checked]) -> str:
    """Return the most telling complaint as ``field: what; mend``, with a count of the others."""
    complaints = sorted(error.errors(), key=lambda e: e["type"] == "missing")  # a misspelt name explains a missing one
    first = complaints[0]
    tags = {"tee", "saddle", "tight", "loose", "flat"}
    where = ".".join(str(part) for part in first["loc"] if part not in tags and "function-" not in str(part))
    others = f" (+{len(complaints) - 1} more)" if len(complaints) > 1 else ""
    missing = [str(e["loc"][-1]) for e in complaints if e["type"] == "missing"]
    return f"{where or 'the file'}: {_mend(first, missing)}{others}"


def _mend(complaint: Any, missing: list[str]) -> str:
    """Say what is wrong with one field and how to mend it."""
    name = str(complaint["loc"][-1]) if complaint["loc"] else ""
    if complaint["type"] == "missing":
        return "missing; add it"
    if complaint["type"] == "extra_forbidden":
        close = difflib.get_close_matches(name, missing, n=1)
        return f"unknown field; did you mean '{close[0]}'?" if close else "unknown field; remove it or mend its name"
    if complaint["type"] == "value_error":
        return str(complaint["ctx"]["error"])
    got = complaint["input"]
    shown = "" if isinstance(got, dict | list) else f", got {got!r}"
    return f"{complaint['msg'][0].lower()}{complaint['msg'][1:]}{shown}; mend the value"


def _table(value: Any, path: Path, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise CellError(f"{path}: {where}: not a table; write [{where}.NAME]")
    return value


def _stations(data: dict[str, Any], path: Path) -> list[dict[str, Any]]:
    stations = data.get("stations")
    if not isinstance(stations, list) or not all(isinstance(s, dict) for s in stations):
        raise CellError(f"{path}: stations: missing or not a list of tables; write [[stations]] for each robot")
    return stations


def _robot_data(name: Any, path: Path, where: str) -> dict[str, Any]:
    if not isinstance(name, str):
        raise CellError(f"{path}: {where}.robot: missing or not a name; name a robot of the library or a file")
    try:
        found = find(name, "robots", beside=path)
    except CellError as error:
        raise CellError(f"{path}: {where}.robot: {error}") from None
    robot = {"name": found.stem, **read_toml(found)}
    checked(Robot, robot, found)
    return robot


def _named(tools: dict[str, Any], name: Any, path: Path, where: str) -> Any:
    if name not in tools:
        raise CellError(f"{path}: {where}: no tool '{name}'; there are {', '.join(sorted(tools)) or 'none'}")
    return tools[name]
