"""A robot at its place in a cell."""

import numpy as np
from pydantic import model_validator

from nlpweld.cell.checked import Name, Sourced, Vector
from nlpweld.cell.layout import AXES, Layout
from nlpweld.cell.robot import Body, Robot
from nlpweld.cell.task import Coupling, Tool

MOVED = "found within its layout; before: "  # leads the source of a base that a search has moved


class Station(Sourced):
    """A robot at its place in the cell, with its tool and its coupling to the work.

    Its base stands where it is stated, unless ``layout`` lets a search move it.
    """

    name: Name
    robot: Robot
    tool: Tool
    base_position_m: Vector
    base_rpy_deg: Vector = (0.0, 0.0, 0.0)
    coupling: Coupling
    layout: Layout | None = None

    @model_validator(mode="after")
    def _bodies_are_told_apart(self) -> "Station":
        names = [body.name for body in self.bodies]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two bodies of robot and tool are named '{name}'; rename one")
            if name == "floor":
                raise ValueError("body 'floor' is named like the floor; rename it")
        return self

    @model_validator(mode="after")
    def _layout_holds_the_base(self) -> "Station":
        x_m, y_m, _ = self.base_position_m
        nominal = {"x_m": x_m, "y_m": y_m, "yaw_deg": self.base_rpy_deg[2]}
        for axis, (low, high) in (self.layout.stated if self.layout else {}).items():
            if not low <= nominal[axis] <= high:
                at = f"{nominal[axis]:g}"
                raise ValueError(f"layout.{axis} [{low:g}, {high:g}] leaves out the base, which is at {at}; widen it")
        return self

    @property
    def base(self) -> np.ndarray:
        """Where the base stands: x, y [m] and yaw [rad] in W, shape (3,)."""
        return np.array([*self.base_position_m[:2], np.radians(self.base_rpy_deg[2])])

    @property
    def base_bounds(self) -> np.ndarray:
        """Bounds of :attr:`base`, shape (2, 3) [m; rad]; equal where the base is held."""
        return self.layout.bounds(self.base) if self.layout else np.array([self.base, self.base])

    def standing_at(self, base: np.ndarray) -> "Station":
        """Return the station with its base at x, y [m] and yaw [rad], shape (3,), which its layout must allow."""
        if self.layout is None or (base == self.base).all():
            return self
        asked = dict(zip(AXES, (base[0], base[1], np.degrees(base[2])), strict=True))
        # radians and back may miss a bound by a hair
        new = {axis: float(np.clip(asked[axis], *bounds)) for axis, bounds in self.layout.stated.items()}
        (x, y, z), (roll, pitch, yaw) = self.base_position_m, self.base_rpy_deg
        moved = {
            "base_position_m": (new.get("x_m", x), new.get("y_m", y), z),
            "base_rpy_deg": (roll, pitch, new.get("yaw_deg", yaw)),
        }
        return self.model_copy(update={**moved, "source": self._source_of_moved(moved)})

    def _source_of_moved(self, moved: dict[str, Vector]) -> dict[str, str]:
        """Return the sources of a copy with fields of the base moved."""
        stated = self.source if isinstance(self.source, dict) else dict.fromkeys(moved, self.source)
        before = {name: stated.get(name, "the default").removeprefix(MOVED) for name in moved}
        return {**stated, **{name: MOVED + text for name, text in before.items()}}

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Capsules of arm and tool, from base to tip."""
        return self.robot.bodies + self.tool.bodies
