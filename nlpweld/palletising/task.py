"""A palletising task as its file states it: axes, pick, pallet, stack and cycle, every number with its source."""

import hashlib
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from nlpweld.cell.checked import Checked, Name, Positive, Sourced
from nlpweld.cell.files import checked, find, read_toml
from nlpweld.motion import Limits

# bounds far beyond any robot, within which no displacement, time or sum overflows
Length = Annotated[float, Field(strict=True, ge=-1e3, le=1e3, allow_inf_nan=False)]
Size = Annotated[float, Field(strict=True, ge=0.0, le=1e3, allow_inf_nan=False)]
Angle = Annotated[float, Field(strict=True, ge=-360.0, le=360.0, allow_inf_nan=False)]
Rate = Annotated[float, Field(strict=True, ge=1e-3, le=1e9, allow_inf_nan=False)]
Count = Annotated[int, Field(strict=True, ge=1, le=100)]
Point = tuple[Length, Length, Length]
DECIMALS = 12  # of heights [m]: sums of round numbers stay round


class TurningAxis(Sourced):
    """Greatest speed, acceleration and jerk of an axis that turns."""

    speed_deg_s: Rate
    acceleration_deg_s2: Rate
    jerk_deg_s3: Rate

    @property
    def limits(self) -> Limits:
        """The same for S-curves, in degrees."""
        return Limits(self.speed_deg_s, self.acceleration_deg_s2, self.jerk_deg_s3)  # type: ignore[arg-type]


class LinearAxis(Sourced):
    """Greatest speed, acceleration and jerk of an axis that slides."""

    speed_m_s: Rate
    acceleration_m_s2: Rate
    jerk_m_s3: Rate

    @property
    def limits(self) -> Limits:
        """The same for S-curves, in metres."""
        return Limits(self.speed_m_s, self.acceleration_m_s2, self.jerk_m_s3)  # type: ignore[arg-type]


class Axes(Checked):
    """The robot's axes: cylindrical coordinates of the gripper, which stays upright (Cao et al., section 1).

    Attributes:
        A: swing about the base.
        B: height.
        C: distance from the base axis.
        D: wrist, about the vertical.
    """

    A: TurningAxis
    B: LinearAxis
    C: LinearAxis
    D: TurningAxis


class Pick(Sourced):
    """Where boxes are taken, from the foot of the robot's base axis, and their heading there."""

    at_m: Point
    yaw_deg: Angle


class Pallet(Sourced):
    """Where the pallet's middle is, at the height of the first layer, and the heading of its layout."""

    centre_m: Point
    yaw_deg: Angle


class Spot(Checked):
    """A box of a layer: its middle from that of the pallet, and its heading."""

    x_m: Length
    y_m: Length
    yaw_deg: Angle


class Stack(Sourced):
    """Boxes on the pallet.

    Attributes:
        box_m: length, width and height of a box.
        layer: boxes of a layer.
        layers: how many.
        turn_deg: by how much every other layer is turned about the pallet's middle.
        reference_m: how high above the underside of a box the point lies that is brought to a layer's height.
    """

    box_m: tuple[Size, Size, Size]
    layer: Annotated[tuple[Spot, ...], Field(min_length=1, max_length=1000)]
    layers: Count
    turn_deg: Angle
    reference_m: Size = 0.0


class Cycle(Sourced):
    """How a box is moved: P0 is the pick, P1 lies above it, P2 above the place P3.

    Attributes:
        rise_m: from P0 to P1.
        drop_m: from P2 to P3.
        z_a_m: how high axis B can rise.
        reading: ``round_trip``, where the way back mirrors the loaded one, or ``one_way``, which leaves it out.
        synchronised: whether axes that move together arrive together; totals do not depend on it, curves do.
    """

    rise_m: Size
    drop_m: Size
    z_a_m: Length
    reading: Literal["round_trip", "one_way"]
    synchronised: bool = True


class Stated(Sourced):
    """Totals that somebody publishes, before and after [s]: as planned, and as run on a robot."""

    planned_s: tuple[Positive, Positive]
    run_s: tuple[Positive, Positive] | None = None


class PalletTask(Checked):
    """Everything one palletising task is made of."""

    name: Name
    title: str
    axes: Axes
    pick: Pick
    pallet: Pallet
    stack: Stack
    cycle: Cycle
    stated: Stated | None = None

    @model_validator(mode="after")
    def _axis_b_rises_over_all_it_passes(self) -> "PalletTask":
        needed = float(self.heights_m.max())
        if self.cycle.z_a_m < needed:
            raise ValueError(
                f"cycle.z_a_m {self.cycle.z_a_m:g} is under the {needed:g} m that pick and places with rise and "
                "drop ask for; raise it or take layers off"
            )
        return self

    @model_validator(mode="after")
    def _nothing_stands_on_the_base_axis(self) -> "PalletTask":
        x, y = self.places_m[:, :2].T
        if self.pick.at_m[:2] == (0.0, 0.0) or (np.hypot(x, y) == 0.0).any():
            raise ValueError("pick or a place lies on the base axis, where its swing is not defined; move it")
        return self

    @property
    def legs(self) -> int:
        """How often the way between pick and place is gone for a box."""
        return 2 if self.cycle.reading == "round_trip" else 1

    @property
    def places_m(self) -> np.ndarray:
        """Where the boxes go, layer by layer from below, shape (n, 4): x, y, z [m] and heading [deg]."""
        (x, y, z), rows = self.pallet.centre_m, []
        for layer in range(self.stack.layers):
            turn = self.pallet.yaw_deg + self.stack.turn_deg * (layer % 2)
            c, s = float(np.cos(np.radians(turn))), float(np.sin(np.radians(turn)))
            height = z + layer * self.stack.box_m[2] + self.stack.reference_m
            for spot in self.stack.layer:
                along, across = c * spot.x_m - s * spot.y_m, s * spot.x_m + c * spot.y_m
                rows.append((x + along, y + across, height, turn + spot.yaw_deg))
        return np.array(rows)

    @property
    def heights_m(self) -> np.ndarray:
        """Heights of P0 to P3 for every box, shape (4, n)."""
        z3 = self.places_m[:, 2]
        z0 = np.full_like(z3, self.pick.at_m[2])
        return np.round([z0, z0 + self.cycle.rise_m, z3 + self.cycle.drop_m, z3], DECIMALS)

    @property
    def content_hash(self) -> str:
        """SHA-256 of the task, as hexadecimal digits."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()

    def with_(self, **tables: dict[str, Any]) -> "PalletTask":
        """Return a copy with some fields of some tables replaced, checked like a file.

        Args:
            tables: table name to fields, e.g. ``with_(cycle={"z_a_m": 1.6})``; axes take
                ``axes={"B": {"speed_m_s": 1.2}}``, whose other fields stay.

        Raises:
            pydantic.ValidationError: a replaced field is not valid.
        """
        data = self.model_dump(mode="python", exclude_unset=True)
        for axis, limits in tables.pop("axes", {}).items():
            data["axes"][axis].update(limits)
        for table, fields in tables.items():
            data[table] = {**(data.get(table) or {}), **fields}
        return PalletTask.model_validate(data)


def load_pallet_task(name_or_path: str | Path = "cao_25_boxes") -> PalletTask:
    """Load a built-in palletising task by name, or any by the path of its TOML file.

    Raises:
        CellError: the file is missing, is not TOML, or breaks the schema; one line names file, field and mend.
    """
    path = find(name_or_path, "palletising")
    return checked(PalletTask, {"name": path.stem, **read_toml(path)}, path)
