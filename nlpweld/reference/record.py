"""A reference as a file: what is known of a cell's optimum, and how far from it an answer is."""

import json
import math
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from nlpweld.cell.cell import Cell
from nlpweld.errors import ReferenceFileError
from nlpweld.plan import write_text

FORMAT, VERSION = "nlpweld-reference", 1
REBUILD = "build it again with experiments/reference.py"
CLOSURE = 1e-5  # share of the bound; a verified plan's chains may be open by 1e-6 m, which the bound's are not


@dataclass(frozen=True)
class Reference:
    """The best answer known for a cell in one formulation, and a bound on all others.

    Attributes:
        cell: name of the cell.
        content_hash: of the cell's content; a reference holds for no other.
        formulation: name of the formulation.
        objective: best verified mean MMR, in the reading's unit.
        placement: x, y, z [m] and yaw [rad] of {P} there.
        branches: shoulder, elbow and wrist of every station there.
        objective_with_margins: the best verified that Ipopt polished within the solvers' margins; its penalties stop
            just short of them, so that populations may end a few 1e-5 above.
        placement_with_margins: where.
        upper_bound: no feasible placement has a higher mean MMR; null where the search ended without a bound.
        rigorous: whether the bound is proven; else it would be a sample's.
        boxes: how many boxes were bounded for that.
        open_boxes: how many were left unsettled when the search ended: 0 unless it ran out of boxes.
        levels_points: at how many points of the seam the bound looks at the levels.
        seed: of the search for the best answer.
        candidates: placements looked at in that search, from which the best were polished.
        how: in words, how objective and bound were obtained.
        versions: of the packages used.
    """

    cell: str
    content_hash: str
    formulation: str
    objective: float
    placement: list[float]
    branches: dict[str, list[str]]
    objective_with_margins: float
    placement_with_margins: list[float]
    upper_bound: float | None
    rigorous: bool
    boxes: int
    open_boxes: int
    levels_points: int
    seed: int
    candidates: int
    how: dict[str, str]
    versions: dict[str, str]

    @property
    def gap(self) -> float:
        """How far the bound is above the best answer, as a share of the bound; infinite where there is none."""
        return math.inf if self.upper_bound is None else 1 - self.objective / self.upper_bound

    @property
    def gap_with_margins(self) -> float:
        """Likewise above the best answer with the solvers' margins."""
        return math.inf if self.upper_bound is None else 1 - self.objective_with_margins / self.upper_bound

    def save(self, path: str | Path) -> Path:
        """Write the reference as JSON, whole or not at all, its gaps beside it for whoever reads.

        Raises:
            OutputError: the file cannot be written.
        """
        gaps = {name: share if math.isfinite(share) else None for name, share in self._gaps.items()}
        return write_text(
            path, json.dumps({"format": FORMAT, "version": VERSION, **asdict(self), **gaps}, indent=1) + "\n"
        )

    @property
    def _gaps(self) -> dict[str, float]:
        return {"gap": self.gap, "gap_with_margins": self.gap_with_margins}


@dataclass(frozen=True)
class Regret:
    """By how much an objective is below the optimum, in the reading's unit.

    Attributes:
        at_least: below the best answer known; negative for one that is better.
        at_most: below the bound; infinite where there is none.
    """

    at_least: float
    at_most: float


def load_reference(path: str | Path, cell: Cell | None = None) -> Reference:
    """Read a reference.

    Args:
        path: of the file.
        cell: the cell it is wanted for, branches opened or held as it is solved; not checked by default.

    Raises:
        ReferenceFileError: the file is missing or not a reference of this version, or belongs to another cell or to
            another version of the cell.
    """
    reference = _from_data(path, _data(path))
    if cell is not None and reference.cell != cell.name:
        raise ReferenceFileError(f"{path}: cell: is of '{reference.cell}', not of '{cell.name}'; take its own file")
    if cell is not None and reference.content_hash != cell.content_hash:
        raise ReferenceFileError(
            f"{path}: content_hash: built for another version of '{cell.name}' "
            f"({reference.content_hash[:12]}, now {cell.content_hash[:12]}); {REBUILD}"
        )
    return reference


def _data(path: str | Path) -> dict[str, Any]:
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ReferenceFileError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    except (ValueError, RecursionError) as error:
        raise ReferenceFileError(f"{path}: not JSON ({error}); {REBUILD}") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise ReferenceFileError(f"{path}: format: not a reference file; {REBUILD}")
    if data.get("version") != VERSION:
        raise ReferenceFileError(f"{path}: version: {data.get('version')!r} is not {VERSION}; {REBUILD}")
    return data


def _from_data(path: str | Path, data: dict[str, Any]) -> Reference:
    for field in fields(Reference):
        if field.name not in data:
            raise ReferenceFileError(f"{path}: {field.name}: missing; the file was edited, {REBUILD}")
    for name in ("objective", "objective_with_margins", "upper_bound"):
        value, absent = data[name], name == "upper_bound" and data[name] is None
        if not absent and not (type(value) in (int, float) and math.isfinite(value)):
            raise ReferenceFileError(f"{path}: {name}: {value!r} is not a number; the file was edited, {REBUILD}")
    return Reference(**{field.name: data[field.name] for field in fields(Reference)})


def regret(objective: float, reference: Reference) -> Regret:
    """Return by how much a verified objective is below the optimum.

    Raises:
        ReferenceFileError: it is above the bound, so that bound, objective or verifier is wrong.
    """
    bound = math.inf if reference.upper_bound is None else reference.upper_bound
    if objective > bound + CLOSURE * abs(bound):
        raise ReferenceFileError(
            f"{reference.cell}: objective {objective:.9g} is above the bound {bound:.9g} of its reference; "
            f"one of them is wrong: {REBUILD} and verify the answer again"
        )
    return Regret(reference.objective - objective, bound - objective)
