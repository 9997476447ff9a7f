"""The cell: robots, tools, workpiece, seams, search box and constraint levels, all frozen."""

import hashlib
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from nlpweld.cell.checked import Checked, Name, Vector
from nlpweld.cell.complaint import nearest
from nlpweld.cell.layout import BASE_AXES
from nlpweld.cell.levels import WITHOUT_HANDLERS, Configuration, Constraints, Freedom, Objective, Search
from nlpweld.cell.robot import Body
from nlpweld.cell.seams import Composite, Polyline
from nlpweld.cell.station import Station
from nlpweld.cell.task import Capsule, Positioner, Posture, Saddle, Tee, Workpiece
from nlpweld.cell.timing import Timing
from nlpweld.cell.uncertainty import Uncertainty
from nlpweld.errors import OptionError
from nlpweld.html_table import html_table

VARIABLES = ("x_m", "y_m", "z_m", "yaw_rad")
Seam = Annotated[Saddle | Composite | Polyline, Field(discriminator="curve")]


class Cell(Checked):
    """Everything one placement problem is made of."""

    name: Name
    title: str
    stations: Annotated[tuple[Station, ...], Field(min_length=1)]
    positioner: Positioner | None = None
    workpiece: Workpiece
    seam: Seam
    other_seams: Annotated[dict[Name, Seam], Field(default_factory=dict)]
    posture: Posture
    search: Search
    configuration: Configuration
    constraints: Constraints
    objective: Objective
    freedom: Freedom | None = None
    uncertainty: Uncertainty | None = None
    timing: Timing | None = None
    placements: Annotated[dict[str, Vector], Field(default_factory=dict)]

    @model_validator(mode="after")
    def _names_are_told_apart(self) -> "Cell":
        names = [s.name for s in self.stations] + ([self.positioner.name] if self.positioner else [])
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"stations: two are named '{name}'; rename one")
        fixed = [body.name for body in self.fixed_bodies]
        for name in fixed:
            if fixed.count(name) > 1 or name == "floor":
                raise ValueError(f"workpiece, positioner: body name '{name}' is taken; rename one")
        for station in self.stations:
            for body in station.bodies:
                if body.name in fixed:
                    raise ValueError(
                        f"stations.{station.name}: body '{body.name}' is named like a fixed one; rename it"
                    )
        return self

    @model_validator(mode="after")
    def _the_work_is_held_and_welded(self) -> "Cell":
        kinds = [s.coupling.kind for s in self.stations]
        if "loose" not in kinds:
            raise ValueError("stations: none is coupled 'loose', so nothing welds; couple at least one")
        if self.positioner is None and "tight" not in kinds:
            raise ValueError("stations: none is coupled 'tight', so nothing holds the workpiece; couple at least one")
        if self.positioner is not None and "tight" in kinds:
            raise ValueError("stations: one is coupled 'tight' while a positioner holds the workpiece; take one away")
        rule = "flat" if self.positioner is None else "upright"
        if self.posture.rule != rule:
            who = "a positioner" if self.positioner else "robots"
            raise ValueError(f"posture.rule is '{self.posture.rule}'; where {who} hold the workpiece it is '{rule}'")
        if "tight" not in kinds and self.objective.reading not in WITHOUT_HANDLERS:
            raise ValueError(
                f"objective.reading '{self.objective.reading}' tells handlers from welders, and there are no handlers; "
                f"take one of {', '.join(WITHOUT_HANDLERS)}"
            )
        return self

    @model_validator(mode="after")
    def _seams_go_together(self) -> "Cell":
        if "main" in self.other_seams:
            raise ValueError("other_seams.main: 'main' is the name of [seam]; rename it")
        for name, seam in self.seams.items():
            if isinstance(seam, Saddle) and not isinstance(self.workpiece, Tee):
                raise ValueError(f"seam '{name}' is a saddle, which only a workpiece of shape 'tee' has")
            if (seam.points, seam.closed) != (self.seam.points, self.seam.closed):
                raise ValueError(f"other_seams.{name}: points and closed are not those of [seam]; seams run together")
        for station in self.stations:
            named = getattr(station.coupling, "seam", "main")
            if named not in self.seams:
                raise ValueError(
                    f"stations.{station.name}.coupling.seam: no seam '{named}'; {nearest(named, self.seams)}"
                )
        return self

    @model_validator(mode="after")
    def _exempt_pairs_exist(self) -> "Cell":
        works = [b.name for b in self.workpiece.bodies]
        owners = [(f"stations.{s.name}.coupling", s.bodies, s.coupling.may_touch) for s in self.stations]
        if self.positioner:
            owners.append(("positioner", self.positioner.robot.bodies, self.positioner.may_touch))
        for where, bodies, exempt in owners:
            known = {f"{b.name}/{w}" for b in bodies for w in works}
            for pair in exempt:
                if pair not in known:
                    raise ValueError(f"{where}.may_touch: no pair '{pair}'; {nearest(pair, known)}")
        return self

    @model_validator(mode="after")
    def _torches_wait_somewhere(self) -> "Cell":
        homes = self.timing.home_deg if self.timing else {}
        welders = {s.name: s.robot for s in self.stations if s.coupling.kind == "loose"} if homes else {}
        for name, joints in homes.items():
            if name not in welders:
                raise ValueError(f"timing.home_deg.{name}: no welding robot of that name; {nearest(name, welders)}")
            limits = [(joint.lower_deg, joint.upper_deg) for joint in welders[name].joints]
            if len(joints) != len(limits):
                raise ValueError(
                    f"timing.home_deg.{name}: {len(joints)} numbers for {len(limits)} joints; give one each"
                )
            for k, (angle, (low, high)) in enumerate(zip(joints, limits, strict=True), start=1):
                if not low <= angle <= high:
                    raise ValueError(f"timing.home_deg.{name}: joint {k} at {angle:g} leaves {low:g} to {high:g} deg")
        for name in welders:
            if name not in homes:
                raise ValueError(f"timing.home_deg: '{name}' has no home; add its joints")
        return self

    @model_validator(mode="after")
    def _something_is_searched(self) -> "Cell":
        if not self.variables:
            raise ValueError(
                "search: every coordinate is held; leave at least one free, its lower bound below its upper, "
                "or a base by a [stations.layout]"
            )
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
            tables: table name to fields, e.g. ``with_(seam={"points": 36})``; a table the cell lacks is added.

        Raises:
            pydantic.ValidationError: a replaced field is not valid.
        """
        data = self.model_dump(mode="python", exclude_unset=True)
        for table, fields in tables.items():
            data[table] = {**(data.get(table) or {}), **fields}
        return Cell.model_validate(data)

    def _repr_html_(self) -> str:
        """Show in a notebook who does what, and what is searched."""
        rows = [(s.name, f"{s.robot.title}, {s.coupling.kind}", str(s.base_position_m)) for s in self.stations]
        if self.positioner:
            rows.append((self.positioner.name, f"{self.positioner.robot.title}, holds the work", ""))
        rows.append(("seam", f"{self.seam.curve}, {self.seam.points} points", "closed" if self.seam.closed else "open"))
        bounds = ", ".join(f"[{low:g}, {high:g}]" for low, high in self.box.T)
        rows.append(("searched", ", ".join(self.variables), bounds))
        return html_table(f"{self.name}: {self.title}", rows, ("", "what", "base in W [m], or bounds"))

    @property
    def content_hash(self) -> str:
        """SHA-256 of everything the placement problem depends on, sources included, as hexadecimal digits.

        Speeds are no part of it: how fast a cell moves changes no placement.
        """
        stations = {k: {"robot": {"drives"}} for k in range(len(self.stations))}
        unstated = {k: {**held, "layout": True} for k, held in stations.items() if self.stations[k].layout is None}
        held: Any = {"stations": {**stations, **unstated}, "positioner": {"robot": {"drives"}}, "timing": True}
        if self.uncertainty is None:  # like layouts, younger than hashes in stored records
            held["uncertainty"] = True
        return hashlib.sha256(self.model_dump_json(exclude=held).encode()).hexdigest()

    @property
    def tight(self) -> list[bool]:
        """For each station whether it is tightly coupled to the workpiece."""
        return [station.coupling.kind == "tight" for station in self.stations]

    @property
    def seams(self) -> dict[str, Seam]:
        """All seams by name; ``main`` is the one that sets the posture."""
        return {"main": self.seam, **self.other_seams}

    @property
    def fixed_bodies(self) -> tuple[Capsule | Body, ...]:
        """Bodies of the workpiece, then of the positioner."""
        return (*self.workpiece.bodies, *(self.positioner.robot.bodies if self.positioner else ()))

    @property
    def bounds(self) -> np.ndarray:
        """Bounds of placement (4) and of every base (3), held ones included, shape (2, 4 + 3 S) [m; rad]."""
        return np.hstack([self.search.bounds, *(station.base_bounds for station in self.stations)])

    @property
    def _free(self) -> np.ndarray:
        lower, upper = self.bounds
        return lower < upper

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the coordinates that are free: of the placement, in the order x_m, y_m, z_m, yaw_rad, then of bases.

        Those of a base are led by its robot's name, as in ``welder.x_m``.
        """
        names = [*VARIABLES, *(f"{station.name}.{axis}" for station in self.stations for axis in BASE_AXES)]
        return tuple(name for name, free in zip(names, self._free, strict=True) if free)

    @property
    def drift(self) -> tuple[str, ...]:
        """Axes along which placement and all bases may move together, which changes nothing but where the answer is.

        A turn of everything also needs bases that may move along x and y, and no torch with a heading in W.
        """
        owners = ["", *(f"{station.name}." for station in self.stations)]
        open_ = [axis for axis in BASE_AXES if all(f"{owner}{axis}" in self.variables for owner in owners)]
        headed = any(getattr(station.coupling, "heading_deg", None) is not None for station in self.stations)
        return tuple(axis for axis in open_ if axis != "yaw_rad" or (len(open_) == len(BASE_AXES) and not headed))

    @property
    def box(self) -> np.ndarray:
        """Bounds of the free coordinates, shape (2, d) [m; rad]."""
        return self.bounds[:, self._free]

    def placement(self, x: np.ndarray) -> np.ndarray:
        """Return x, y, z [m] and yaw [rad] of the placement frame for free coordinates x (d,), shape (4,)."""
        return self._whole(x)[: len(VARIABLES)]

    def bases(self, x: np.ndarray) -> np.ndarray:
        """Return x, y [m] and yaw [rad] of every station's base for free coordinates x (d,), shape (S, 3)."""
        return self._whole(x)[len(VARIABLES) :].reshape(-1, len(BASE_AXES))

    def layout(self, x: np.ndarray) -> dict[str, dict[str, float]]:
        """Return by robot and axis [m; rad] where those bases stand that are not held, for free coordinates x (d,)."""
        free = self._free[len(VARIABLES) :].reshape(-1, len(BASE_AXES)).tolist()
        named = zip(self.stations, self.bases(x).tolist(), map(any, free), strict=True)
        return {station.name: dict(zip(BASE_AXES, base, strict=True)) for station, base, moves in named if moves}

    def laid_out(self, x: np.ndarray) -> "Cell":
        """Return the cell with its bases where free coordinates x (d,) put them; their bounds stay."""
        moved = [station.standing_at(base) for station, base in zip(self.stations, self.bases(x), strict=True)]
        return self.model_copy(update={"stations": tuple(moved)})

    def _whole(self, x: np.ndarray) -> np.ndarray:
        """Return placement and bases for free coordinates x (d,), shape (4 + 3 S,) [m; rad]."""
        whole = np.concatenate([self.search.bounds[0], *(station.base for station in self.stations)])
        whole[self._free] = x
        return whole

    def coordinates(self, placement: np.ndarray) -> np.ndarray:
        """Return the free coordinates (d,) of a placement (3,) [m] or (4,) [m; rad], with bases as they are stated.

        Raises:
            OptionError: a coordinate that the cell holds has another value.
        """
        given = np.concatenate([self.search.bounds[0], *(station.base for station in self.stations)])
        given[: len(placement)] = placement
        for name, free, value, held in zip(VARIABLES, self._free, given, self.search.bounds[0], strict=False):
            if not free and abs(value - held) > 1e-12:
                raise OptionError(f"{self.name}: {name} is held at {held:g} and cannot be {value:g}; open [search]")
        return given[self._free]
