"""Cell and robot files, turned into frozen types."""

from pathlib import Path
from typing import Any

from nlpweld.cell.cell import Cell
from nlpweld.cell.complaint import nearest
from nlpweld.cell.files import checked, find, read_toml
from nlpweld.cell.robot import Robot
from nlpweld.cell.seam_csv import with_rows
from nlpweld.cell.task import Tool
from nlpweld.errors import CellError


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
    if isinstance(data.get("positioner"), dict):
        data["positioner"]["robot"] = _robot_data(data["positioner"].get("robot"), path, "positioner", "positioners")
    for seam in (data.get("seam"), *_tables(data.get("other_seams"))):
        if isinstance(seam, dict):
            seam |= with_rows(seam, path.parent)
            seam.pop("file", None)
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


def load_positioner(name_or_path: str | Path) -> Robot:
    """Load a built-in positioner by name, or any positioner by the path of its TOML file.

    Raises:
        CellError: the file is missing, is not TOML, or breaks the schema.
    """
    path = find(name_or_path, "positioners")
    return checked(Robot, {"name": path.stem, **read_toml(path)}, path)


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


def _tables(value: Any) -> list[Any]:
    return list(value.values()) if isinstance(value, dict) else []


def _robot_data(name: Any, path: Path, where: str, kind: str = "robots") -> dict[str, Any]:
    if not isinstance(name, str):
        raise CellError(f"{path}: {where}.robot: missing or not a name; name a robot of the library or a file")
    try:
        found = find(name, kind, beside=path)
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
