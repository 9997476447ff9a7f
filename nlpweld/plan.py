"""A plan: where the workpiece goes and how every joint moves along the seam; saved as plain JSON."""

import json
import tempfile
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from nlpweld.cell.cell import Cell
from nlpweld.cell.complaint import first_complaint, nearest
from nlpweld.errors import OutputError, PlanError

FORMAT = "nlpweld-plan"
VERSION = 1
BRANCHES = tuple(product(("front", "back"), ("up", "down"), ("noflip", "flip")))


@dataclass(frozen=True, eq=False)
class Plan:
    """Joint paths of every robot along the seam, for one placement of the workpiece.

    Attributes:
        cell: the cell the plan belongs to, whole, so that a plan file can be checked on its own.
        placement_m: origin of C in W, shape (3,) [m].
        s: seam parameter of each point, shape (N,).
        paths: station name to joint angles in DH direction, shape (N, n) [rad], continuous along the seam;
            a closed seam continues from the last point to the first, a multiple of 2 pi away.
        branches: station name to (shoulder, elbow, wrist) of the inverse kinematics, or None where unknown.
    """

    cell: Cell
    placement_m: np.ndarray
    s: np.ndarray
    paths: dict[str, np.ndarray]
    branches: dict[str, tuple[str, str, str]] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the plan as plain data."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "placement_m": self.placement_m.tolist(),
            "s": self.s.tolist(),
            "paths_rad": {name: q.tolist() for name, q in self.paths.items()},
            "branches": self.branches and {name: list(branch) for name, branch in self.branches.items()},
            "cell": self.cell.model_dump(mode="json", exclude_unset=True),
        }

    def save(self, path: str | Path) -> Path:
        """Write the plan as JSON, whole or not at all.

        Raises:
            OutputError: the file cannot be written.
        """
        return write_text(path, json.dumps(self.to_json()) + "\n")


def load_plan(path: str | Path) -> Plan:
    """Read a plan file.

    Raises:
        PlanError: the file is missing, is not a plan of this version, or its shapes contradict its cell.
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise PlanError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    except (ValueError, RecursionError) as error:
        raise PlanError(f"{path}: not JSON ({error}); write it again with 'nlpweld solve'") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise PlanError(f"{path}: format: not a plan file; write one with 'nlpweld solve --out DIR'")
    if data.get("version") != VERSION:
        raise PlanError(f"{path}: version: {data.get('version')!r} is not {VERSION}; solve again with this nlpweld")
    try:
        return _plan_from(data)
    except ValidationError as error:
        raise PlanError(f"{path}: {first_complaint(error, data['cell'], 'cell')}") from None
    except KeyError as error:
        raise PlanError(f"{path}: {error.args[0]}: missing; the file was edited, solve again") from None
    except ValueError as error:
        raise PlanError(f"{path}: {error}; the file was edited, solve again") from None


def _plan_from(data: dict[str, Any]) -> Plan:
    cell = Cell.model_validate(data["cell"])
    s, placement = _finite(data["s"], "s"), _finite(data["placement_m"], "placement_m")
    if placement.shape != (3,):
        raise ValueError("placement_m: not three numbers")
    if s.ndim != 1 or len(s) < 3 or (np.diff(s) <= 0).any() or s[0] < 0 or s[-1] >= 1:
        raise ValueError("s: not at least three increasing numbers in [0, 1)")
    given, paths = _by_station(data["paths_rad"], cell, "paths_rad"), {}
    for st in cell.stations:
        where = f"paths_rad.{st.name}"
        if st.name not in given:
            raise KeyError(where)
        paths[st.name] = _finite(given[st.name], where)
        if paths[st.name].shape != (len(s), len(st.robot.joints)):
            raise ValueError(f"{where}: not one row of {len(st.robot.joints)} joints for each of {len(s)} points")
    branches = data.get("branches")
    return Plan(cell, placement, s, paths, None if branches is None else _branches(branches, cell))


def _branches(value: Any, cell: Cell) -> dict[str, tuple[str, str, str]]:
    branches = {}
    for name, branch in _by_station(value, cell, "branches").items():
        if not isinstance(branch, list) or tuple(branch) not in BRANCHES:
            raise ValueError(f"branches.{name}: not one of {', '.join('-'.join(b) for b in BRANCHES)}")
        branches[name] = (branch[0], branch[1], branch[2])
    return branches


def _by_station(value: Any, cell: Cell, where: str) -> dict[str, Any]:
    """Return a table with one entry per robot, checked to name none that the cell does not have."""
    if not isinstance(value, dict):
        raise ValueError(f"{where}: not a table by robot")
    names = [st.name for st in cell.stations]
    for name in value:
        if name not in names:
            raise ValueError(f"{where}.{name}: the cell has no robot of that name; {nearest(name, names)}")
    return value


def _finite(value: Any, where: str) -> np.ndarray:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{where}: not an array of numbers") from None
    if not np.isfinite(array).all():
        raise ValueError(f"{where}: holds NaN or infinity")
    return array


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file by way of a temporary name beside it, so that it is whole or absent.

    Raises:
        OutputError: the folder or file cannot be written.
    """
    path = Path(path)
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as file:
            temporary = file.name
            file.write(text)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as error:
        reason = "its folder is a file" if isinstance(error, FileExistsError) else error.strerror
        raise OutputError(f"{path}: cannot be written ({reason}); choose another --out") from None
    finally:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
    return path
