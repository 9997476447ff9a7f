"""The cell: robots, tools, workpiece, seam, search box and constraint levels, all frozen."""

import hashlib
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nlpweld.cell.checked import Checked, Name, NonNegative, Positive, Sourced, Vector
from nlpweld.cell.complaint import nearest
from nlpweld.cell.robot import Body, Robot
from nlpweld.cell.task import Coupling, Posture, Saddle, Tee, Tool

READINGS = ("paper", "equal", "harmonic", "sqrt_tight", "millimetres")
Reading = Literal["paper", "equal", "harmonic", "sqrt_tight", "millimetres"]
RESERVED = ("main_pipe", "branch", "floor")


class Station(Sourced):
    """A robot at its place in the cell, with its tool and its coupling to the work."""

    name: Name
    robot: Robot
    tool: Tool
    base_position_m: Vector
    base_rpy_deg: Vector = (0.0, 0.0, 0.0)
    coupling: Coupling

    @model_validator(mode="after")
    def _bodies_are_told_apart(self) -> "Station":
        names = [body.name for body in self.bodies]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two bodies of robot and tool are named '{name}'; rename one")
            if name in RESERVED:
                raise ValueError(f"body '{name}' is named like the workpiece or the floor; rename it")
        return self

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Capsules of arm and tool, from base to tip."""
        return self.robot.bodies + self.tool.bodies


class Search(Sourced):
    """The placement box S for the origin of C in W [m]."""

    lower_m: Vector
    upper_m: Vector

    @model_validator(mode="after")
    def _box_is_ordered(self) -> "Search":
        for axis, low, high in zip("xyz", self.lower_m, self.upper_m, strict=True):
            if low >= high:
                raise ValueError(f"lower_m.{axis} {low:g} is not below upper_m.{axis} {high:g}; swap them")
        return self


class Configuration(Sourced):
    """Which inverse-kinematics branches may be used; ``any`` opens both sides."""

    shoulder: Literal["front", "back", "any"]
    elbow: Literal["up", "down", "any"]
    wrist: Literal["flip", "noflip", "any"]


class Constraints(Sourced):
    """Levels that must hold along the whole seam, and the margins solvers keep at its points.

    ``verify_step_m`` is the longest motion of any body end between two configurations the verifier looks at.
    """

    singularity_floor_m3: NonNegative
    clearance_m: NonNegative
    singularity_margin_m3: NonNegative
    clearance_margin_m: NonNegative
    joint_margin_deg: NonNegative
    verify_step_m: Positive

    @property
    def floor_at_points_m3(self) -> float:
        """The singularity floor with the margin solvers keep at the seam's points [m^3]."""
        return self.singularity_floor_m3 + self.singularity_margin_m3

    @property
    def clearance_at_points_m(self) -> float:
        """The clearance with the margin solvers keep at the seam's points [m]."""
        return self.clearance_m + self.clearance_margin_m


class Objective(Sourced):
    """The reading of Pan et al., eq. (16)."""

    reading: Reading


class Cell(Checked):
    """Everything one placement problem is made of."""

    name: Name
    title: str
    stations: Annotated[tuple[Station, ...], Field(min_length=1)]
    workpiece: Tee
    seam: Saddle
    posture: Posture
    search: Search
    configuration: Configuration
    constraints: Constraints
    objective: Objective
    placements: Annotated[dict[str, Vector], Field(default_factory=dict)]

    @model_validator(mode="after")
    def _names_are_told_apart(self) -> "Cell":
        names = [s.name for s in self.stations]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"stations: two are named '{name}'; rename one")
        return self

    @model_validator(mode="after")
    def _both_kinds_of_coupling_are_there(self) -> "Cell":
        kinds = {s.coupling.kind for s in self.stations}
        for kind, what in (("tight", "holds the workpiece"), ("loose", "welds")):
            if kind not in kinds:
                raise ValueError(f"stations: none is coupled '{kind}', so nothing {what}; couple at least one")
        return self

    @model_validator(mode="after")
    def _exempt_pairs_exist(self) -> "Cell":
        works = [b.name for b in self.workpiece.bodies]
        for station in self.stations:
            known = {f"{b.name}/{w}" for b in station.bodies for w in works}
            for pair in station.coupling.may_touch:
                if pair not in known:
                    where = f"stations.{station.name}.coupling.may_touch"
                    raise ValueError(f"{where}: no pair '{pair}'; {nearest(pair, known)}")
        return self

    @model_validator(mode="after")
    def _tool_bodies_hang_on_frames_there_are(self) -> "Cell":
        for station in self.stations:
            n = len(station.robot.joints)
            for body in station.tool.bodies:
                for end in (body.start, body.end):
                    if end.frame != "tcp" and int(end.frame[4:]) > n:
                        where = f"stations.{station.name}.tool"
                        raise ValueError(f"{where}: body '{body.name}' hangs on '{end.frame}'; the flange is link{n}")
        return self

    def with_(self, **tables: dict[str, object]) -> "Cell":
        """Return a copy with some fields of some tables replaced, checked like a file.

        Args:
            tables: table name to fields, e.g. ``with_(seam={"points": 36})``.

        Raises:
            pydantic.ValidationError: a replaced field is not valid.
        """
        data = self.model_dump(mode="python", exclude_unset=True)
        for table, fields in tables.items():
            data[table] = {**data[table], **fields}
        return Cell.model_validate(data)

    @property
    def content_hash(self) -> str:
        """SHA-256 of everything the cell states, sources included, as hexadecimal digits."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()

    @property
    def tight(self) -> list[bool]:
        """For each station whether it is tightly coupled to the workpiece."""
        return [station.coupling.kind == "tight" for station in self.stations]

    @property
    def box(self) -> np.ndarray:
        """Placement bounds, shape (2, 3) [m]."""
        return np.array([self.search.lower_m, self.search.upper_m])
