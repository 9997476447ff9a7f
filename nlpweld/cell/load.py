"""Cell and robot files: found by name or path, read as TOML, checked, and turned into frozen types."""

import os
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from nlpweld.cell.cell import Cell
from nlpweld.cell.checked import Checked
from nlpweld.cell.complaint import first_complaint, nearest
from nlpweld.cell.robot import Robot
from nlpweld.cell.task import Tool
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
    tools = _tools(data.pop("tools", {}), path)
    unused = set(tools)
    for i, station in enumerate(_stations(data, path), start=1):
        where = f"stations.{station.get('name', i)}"
        unused.discard(str(station.get("tool")))
        station["robot"] = _robot_data(station.get("robot"), path, where)
        station["tool"] = _named(tools, station.get("tool"), path, f"{where}.tool")
    for name in sorted(unused):
        raise CellError(f"{path}: tools.{name}: no station uses it; remove it or name it in a station")
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
    names = library_names(kind)
    if text in names:
        return LIBRARY / kind / f"{text}.toml"
    for path in (Path(text), beside.parent / text if beside else Path(text)):
        if os.path.isfile(path):  # noqa: PTH113 - Path.is_file raises where a name is too long
            return path
    raise CellError(f"{text}: no such file and no built-in {kind[:-1]} of that name; {nearest(text, names)}")


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


def checked(model: type[Model], data: Any, path: Path, where: str = "") -> Model:
    """Build a model from plain data, strictly.

    Args:
        model: what to build.
        data: a table of the file.
        path: the file, for the message.
        where: which table of the file it is; empty for the whole.

    Raises:
        CellError: a field is missing, unknown, of the wrong kind, or contradicts another.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise CellError(f"{path}: {first_complaint(error, data, where)}") from None


def _tools(value: Any, path: Path) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise CellError(f"{path}: tools: not a table; write [tools.NAME]")
    for name, tool in value.items():
        checked(Tool, tool, path, f"tools.{name}")
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
    if not isinstance(name, str):
        raise CellError(f"{path}: {where}: missing or not a name; {nearest('', tools)}")
    if name not in tools:
        raise CellError(f"{path}: {where}: no tool '{name}'; {nearest(name, tools)}")
    return tools[name]
