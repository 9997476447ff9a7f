"""Where the base of a robot may stand: the layout of a cell, searched together with the placement."""

from typing import Any

import numpy as np
from pydantic import model_validator

from nlpweld.cell.checked import Finite, Sourced

BASE_AXES = ("x_m", "y_m", "yaw_rad")  # of a base, as variables are named
AXES = ("x_m", "y_m", "yaw_deg")  # the same as a file states them
Bounds = tuple[Finite, Finite]


class Layout(Sourced):
    """Bounds of a robot's base in W: its origin, and its turn about z_W, the yaw of ``base_rpy_deg``.

    Bounds are absolute, as those of the placement in [search], and hold where the base stands. An axis that is not
    stated, or whose bounds are equal, is held. Where everything is free along an axis, bases and placement can move
    together and nothing changes: hold one base there.
    """

    x_m: Bounds | None = None
    y_m: Bounds | None = None
    yaw_deg: Bounds | None = None

    @model_validator(mode="before")
    @classmethod
    def _axes_exist(cls, data: Any) -> Any:
        for name in data if isinstance(data, dict) else ():
            if name not in cls.model_fields:
                raise ValueError(f"no axis '{name}'; a base may move along {', '.join(AXES)}")
        return data

    @model_validator(mode="after")
    def _bounds_are_ordered(self) -> "Layout":
        stated = self.stated
        if not stated:
            raise ValueError(f"no bounds; state one of {', '.join(AXES)}, or remove the table")
        for axis, (low, high) in stated.items():
            if low > high:
                raise ValueError(f"{axis} [{low:g}, {high:g}] is reversed; give the lower bound first")
            if axis == "yaw_deg" and high - low > 360.0:
                raise ValueError(f"{axis} [{low:g}, {high:g}] is more than a whole turn; narrow it")
        return self

    @property
    def stated(self) -> dict[str, Bounds]:
        """The bounds that are stated, by the file's names [m; deg]."""
        every = {axis: getattr(self, axis) for axis in AXES}
        return {axis: bounds for axis, bounds in every.items() if bounds is not None}

    def bounds(self, base: np.ndarray) -> np.ndarray:
        """Return bounds of x, y [m] and yaw [rad], shape (2, 3); an axis not stated is held where the base (3,) is."""
        found = np.array([base, base])
        for column, axis in enumerate(AXES):
            if axis in self.stated:
                stated = np.array(self.stated[axis])
                found[:, column] = np.radians(stated) if axis == "yaw_deg" else stated
        return found
