"""A plan: where the work is placed and how every joint moves along the seam; saved as plain JSON."""

import json
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from nlpweld.cell.cell import Cell
from nlpweld.cell.complaint import first_complaint, nearest
from nlpweld.cell.task import Torch
from nlpweld.errors import OutputError, PlanError
from nlpweld.html_table import html_table
from nlpweld.timeline import Timeline, timeline_from

FORMAT = "nlpweld-plan"
VERSION = 1
WRITING = ".writing-"  # how names of files begin that are not whole yet
TILTS = ("slope", "rotation")
BRANCHES = tuple(product(("front", "back"), ("up", "down"), ("noflip", "flip")))


@dataclass(frozen=True, eq=False)
class Plan:
    """Joint paths of every robot and of the positioner along the seam, for one placement of the frame {P}.

    Attributes:
        cell: the cell the plan belongs to, whole, so that a plan file can be checked on its own.
        placement_m: origin of {P} in W, shape (3,) [m]: of C where robots carry the workpiece, else of what the
            positioner stands on.
        s: seam parameter of each point, shape (N,): in [0, 1) along a closed seam, in [0, 1] along an open one.
        paths: name of station or positioner to joint angles in DH direction, shape (N, n) [rad], continuous along the
            seam; a closed seam continues from the last point to the first, a multiple of 2 pi away.
        branches: station name to (shoulder, elbow, wrist) of the inverse kinematics, or None where unknown.
        yaw_rad: turn of {P} about z_W [rad].
        freedom: name of a free angle (:func:`free_names`) to its offset from the nominal at the points, shape (N,)
            [rad], linear in s between them; None where the plan takes no freedom, and an angle not named stays nominal.
        timeline: when everything is where, or None where the plan is not timed.
    """

    cell: Cell
    placement_m: np.ndarray
    s: np.ndarray
    paths: dict[str, np.ndarray]
    branches: dict[str, tuple[str, str, str]] | None = None
    yaw_rad: float = 0.0
    freedom: dict[str, np.ndarray] | None = None
    timeline: Timeline | None = None

    @property
    def placement(self) -> np.ndarray:
        """Placement of {P}: x, y, z [m] and yaw [rad], shape (4,)."""
        return np.array([*self.placement_m, self.yaw_rad], dtype=float)

    def with_freedom(self, freedom: Mapping[str, np.ndarray] | None) -> "Plan":
        """Return a copy with these offsets of free angles, each of shape (N,) [rad], or with none."""
        return replace(self, freedom=None if freedom is None else dict(freedom))

    @property
    def needed_timeline(self) -> Timeline:
        """The timeline, of a plan that has to have one.

        Raises:
            PlanError: the plan is not timed.
        """
        if self.timeline is None:
            raise PlanError("timeline: missing; time it first with 'nlpweld time PLAN --out FILE'")
        return self.timeline

    def timed(self, timeline: Timeline | None) -> "Plan":
        """Return a copy with this time axis, or with none."""
        return replace(self, timeline=timeline)

    def _repr_html_(self) -> str:
        """Show in a notebook what each joint turns through [deg], in DH direction."""
        rows = []
        for name, q in self.paths.items():
            spans = [f"{low:.1f} to {high:.1f}" for low, high in np.degrees([q.min(axis=0), q.max(axis=0)]).T]
            branch = "-".join((self.branches or {}).get(name, ("",)))
            rows.append((name, branch, ", ".join(spans)))
        at = ", ".join(f"{x:.4f}" for x in self.placement_m)
        timed = f", {self.timeline.duration_s:.2f} s" if self.timeline else ", not timed"
        title = f"plan of {self.cell.name} at ({at}) m, {len(self.s)} points{timed}"
        return html_table(title, rows, ("", "branch", "joints along the seam [deg]"))

    def to_json(self) -> dict[str, Any]:
        """Return the plan as plain data."""
        timed = {} if self.timeline is None else {"timeline": self.timeline.to_json()}
        return {
            "format": FORMAT,
            "version": VERSION,
            "placement_m": self.placement_m.tolist(),
            "yaw_rad": float(self.yaw_rad),
            "s": self.s.tolist(),
            "paths_rad": {name: q.tolist() for name, q in self.paths.items()},
            "freedom_rad": None if self.freedom is None else {name: u.tolist() for name, u in self.freedom.items()},
            "branches": self.branches and {name: list(branch) for name, branch in self.branches.items()},
            "cell": self.cell.model_dump(mode="json", exclude_unset=True),
            **timed,
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


def joint_counts(cell: Cell) -> dict[str, int]:
    """Return the number of joints of everything a plan moves, by name: the stations in order, then the positioner."""
    counts = {station.name: len(station.robot.joints) for station in cell.stations}
    return counts | ({cell.positioner.name: len(cell.positioner.robot.joints)} if cell.positioner else {})


def wrong_points(cell: Cell, s: np.ndarray) -> str | None:
    """Return what numbers that cannot be points along the cell's seam are not, or None where they can be."""
    closed = cell.seam.closed
    fewest = 3 if closed else 2
    increasing = np.ndim(s) == 1 and len(s) >= fewest and bool((np.diff(s) > 0).all())
    if increasing and s[0] >= 0 and (s[-1] < 1 if closed else s[-1] <= 1):
        return None
    return f"not at least {'three' if closed else 'two'} increasing numbers in [0, 1{')' if closed else ']'}"


def free_names(cell: Cell) -> tuple[str, ...]:
    """Return the names of the angles a plan of the cell may turn off their nominal values, whatever their bands.

    ``yaw`` of the workpiece where robots carry it, ``slope`` and ``rotation`` there and where a positioner of two axes
    holds it: one axis reaches but one rotation for every slope. ``spin.<station>`` of every torch, and
    ``travel.<station>`` and ``work.<station>`` of one that is held by angles.
    """
    held = cell.positioner
    names = ["yaw", *TILTS] if held is None else [*TILTS] if len(held.robot.joints) == 2 else []
    for station in cell.stations:
        if isinstance(station.coupling, Torch):
            kinds = ("spin",) if station.coupling.angles is None else ("spin", "travel", "work")
            names += [f"{kind}.{station.name}" for kind in kinds]
    return tuple(names)


def wrong_freedom(cell: Cell, freedom: Mapping[str, Any]) -> str | None:
    """Return what is wrong with the names of free angles, after the name of their table, or None."""
    known = free_names(cell)
    for name in freedom:
        if name not in known:
            return f".{name}: the cell has no free angle of that name; {nearest(name, known)}"
    lone = [name for name in TILTS if name in freedom]
    if len(lone) == 1:
        return f".{lone[0]}: alone; slope and rotation go together"
    return None


def _plan_from(data: dict[str, Any]) -> Plan:
    cell = Cell.model_validate(data["cell"])
    s, placement = _finite(data["s"], "s"), _finite(data["placement_m"], "placement_m")
    yaw = _finite(data.get("yaw_rad", 0.0), "yaw_rad")
    if placement.shape != (3,):
        raise ValueError("placement_m: not three numbers")
    if yaw.shape != ():
        raise ValueError("yaw_rad: not a number")
    complaint = wrong_points(cell, s)
    if complaint:
        raise ValueError(f"s: {complaint}")
    paths, branches = _paths(data["paths_rad"], cell, len(s)), data.get("branches")
    plan = Plan(cell, placement, s, paths, None if branches is None else _branches(branches, cell), float(yaw))
    if data.get("freedom_rad") is not None:
        plan = plan.with_freedom(_freedom(data["freedom_rad"], cell, len(s)))
    timeline = data.get("timeline")
    return plan if timeline is None else plan.timed(timeline_from(timeline, joint_counts(cell)))


def _paths(value: Any, cell: Cell, points: int) -> dict[str, np.ndarray]:
    counts, paths = joint_counts(cell), {}
    given = _by_name(value, list(counts), "paths_rad")
    for name, joints in counts.items():
        where = f"paths_rad.{name}"
        if name not in given:
            raise KeyError(where)
        paths[name] = _finite(given[name], where)
        if paths[name].shape != (points, joints):
            raise ValueError(f"{where}: not one row of {joints} joints for each of {points} points")
    return paths


def _branches(value: Any, cell: Cell) -> dict[str, tuple[str, str, str]]:
    branches = {}
    for name, branch in _by_name(value, [station.name for station in cell.stations], "branches").items():
        if not isinstance(branch, list) or tuple(branch) not in BRANCHES:
            raise ValueError(f"branches.{name}: not one of {', '.join('-'.join(b) for b in BRANCHES)}")
        branches[name] = (branch[0], branch[1], branch[2])
    return branches


def _freedom(value: Any, cell: Cell, points: int) -> dict[str, np.ndarray]:
    if not isinstance(value, dict):
        raise ValueError("freedom_rad: not a table by angle")
    complaint = wrong_freedom(cell, value)
    if complaint:
        raise ValueError(f"freedom_rad{complaint}")
    freedom = {name: _finite(offsets, f"freedom_rad.{name}") for name, offsets in value.items()}
    for name, offsets in freedom.items():
        if offsets.shape != (points,):
            raise ValueError(f"freedom_rad.{name}: not one number for each of {points} points")
    return freedom


def _by_name(value: Any, names: list[str], where: str) -> dict[str, Any]:
    """Return a table with one entry per robot, checked to name none but the given."""
    if not isinstance(value, dict):
        raise ValueError(f"{where}: not a table by robot")
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
    return write_bytes(path, text.encode())


def refuse_existing(paths: Iterable[Path], force: bool) -> None:
    """Refuse files that exist already, unless they are to be replaced.

    Raises:
        OutputError: one exists, and ``force`` is not set.
    """
    for path in paths:
        if path.exists() and not force:
            raise OutputError(f"{path}: exists; add --force to replace it, or choose another name")


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Write a file by way of a temporary name beside it, so that it is whole or absent.

    Raises:
        OutputError: the folder or file cannot be written.
    """
    path = Path(path)
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=WRITING, delete=False) as file:
            temporary = file.name
            file.write(data)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as error:
        reason = "its folder is a file" if isinstance(error, FileExistsError) else error.strerror
        raise OutputError(f"{path}: cannot be written ({reason}); choose another --out") from None
    finally:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
    return path
