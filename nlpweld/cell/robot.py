"""A robot as its file states it: Denavit-Hartenberg rows, limits, and capsule bodies."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nlpweld.cell.checked import Checked, Finite, Name, Positive, Rate, Sourced, Vector

DRIVES = ("speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")


class Joint(Checked):
    """One row of the standard Denavit-Hartenberg table, ``Rz(q + offset) Tz(d) Tx(a) Rx(alpha)``.

    Inside nlpweld a joint angle counts about +z of its DH frame; ``sign`` says which way the
    controller counts, and the limits are written as the controller shows them.
    """

    a_m: Finite
    d_m: Finite
    alpha_deg: Finite
    offset_deg: Finite = 0.0
    sign: Literal[-1, 1] = 1
    lower_deg: Finite
    upper_deg: Finite

    @model_validator(mode="after")
    def _limits_are_ordered(self) -> "Joint":
        if self.lower_deg >= self.upper_deg:
            raise ValueError(f"lower_deg {self.lower_deg:g} is not below upper_deg {self.upper_deg:g}; swap them")
        return self


class Drives(Sourced):
    """How fast the joints of a robot may move, in their order; a limit that is not stated is not known."""

    speed_deg_s: tuple[Rate, ...]
    acceleration_deg_s2: tuple[Rate, ...] | None = None
    jerk_deg_s3: tuple[Rate, ...] | None = None

    @property
    def stated(self) -> dict[str, tuple[float, ...]]:
        """The limits that are stated, by the names of their fields."""
        limits = {name: getattr(self, name) for name in DRIVES}
        return {name: values for name, values in limits.items() if values is not None}


class End(Checked):
    """One end of a capsule axis: a point fixed in a frame of the robot or its tool.

    ``frame`` is ``link0`` (the base) to ``linkN`` (the flange), or ``tcp``.
    """

    frame: Annotated[str, Field(pattern=r"^(link(0|[1-9]\d*)|tcp)$")]
    at_m: Vector = (0.0, 0.0, 0.0)


class Body(Sourced):
    """A capsule of a robot or tool: all points within ``radius_m`` of the segment between two ends."""

    name: Name
    start: End
    end: End
    radius_m: Positive


class Robot(Sourced):
    """A serial robot: joints from base to flange, and the bodies of its arm."""

    name: Name
    title: str
    joints: Annotated[tuple[Joint, ...], Field(min_length=1)]
    bodies: tuple[Body, ...] = ()
    drives: Drives | None = None
    zero_flange_m: Vector
    reach_m: Positive

    @model_validator(mode="after")
    def _every_joint_has_a_drive(self) -> "Robot":
        for name, values in (self.drives.stated if self.drives else {}).items():
            if len(values) != len(self.joints):
                raise ValueError(
                    f"drives.{name} has {len(values)} numbers for {len(self.joints)} joints; give one each"
                )
        return self

    @model_validator(mode="after")
    def _bodies_hang_on_links_there_are(self) -> "Robot":
        for body in self.bodies:
            for end in (body.start, body.end):
                if end.frame == "tcp" or int(end.frame[4:]) > len(self.joints):
                    raise ValueError(
                        f"body '{body.name}' hangs on '{end.frame}'; a robot body takes link0 to link{len(self.joints)}"
                    )
        return self

    @property
    def limits_rad(self) -> np.ndarray:
        """Joint limits in DH direction, shape (n, 2) [rad]."""
        rows = [sorted((j.sign * j.lower_deg, j.sign * j.upper_deg)) for j in self.joints]
        return np.radians(np.array(rows, dtype=float))

    @property
    def drive_limits(self) -> np.ndarray:
        """Greatest speed, acceleration and jerk of the joints, shape (3, n) [rad/s and so on]; NaN where not stated."""
        rows = [getattr(self.drives, name, None) for name in DRIVES]
        return np.radians([[np.nan] * len(self.joints) if row is None else row for row in rows])

    @property
    def dh(self) -> np.ndarray:
        """Rows (a [m], d [m], alpha [rad], offset [rad]), shape (n, 4)."""
        return np.array([(j.a_m, j.d_m, np.radians(j.alpha_deg), np.radians(j.offset_deg)) for j in self.joints])
