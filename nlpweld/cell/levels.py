"""What is searched, allowed and asked for: placement box, branches, levels, objective."""

from typing import Any, Literal

import numpy as np
from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from nlpweld.cell.checked import Finite, NonNegative, Positive, Sourced, Vector

READINGS = ("paper", "equal", "harmonic", "sqrt_tight", "millimetres", "product", "mean")
Reading = Literal["paper", "equal", "harmonic", "sqrt_tight", "millimetres", "product", "mean"]
OVER_SEAM = ("mean", "minimum", "soft_minimum")
OverSeam = Literal["mean", "minimum", "soft_minimum"]
WITHOUT_HANDLERS = ("product", "mean")  # readings that do not tell tight from loose robots


class Search(Sourced):
    """The placement box S: where the placement frame {P} may be in W [m], and how it may be turned about z_W.

    {P} is the workpiece frame's origin, its axes along W's, where robots carry the work; it is where a positioner
    stands where there is one. A coordinate whose bounds are equal is held.
    """

    lower_m: Vector
    upper_m: Vector
    yaw_deg: tuple[Finite, Finite] = (0.0, 0.0)

    @model_validator(mode="after")
    def _box_is_ordered(self) -> "Search":
        bounds = zip("xyz", self.lower_m, self.upper_m, strict=True)
        for axis, low, high in bounds:
            if low > high:
                raise ValueError(f"lower_m.{axis} {low:g} is not below upper_m.{axis} {high:g}; swap them")
        if self.yaw_deg[0] > self.yaw_deg[1]:
            raise ValueError(f"yaw_deg {self.yaw_deg[0]:g} is above {self.yaw_deg[1]:g}; swap them")
        return self

    @property
    def bounds(self) -> np.ndarray:
        """Bounds of x, y, z [m] and yaw [rad], shape (2, 4)."""
        low, high = np.radians(self.yaw_deg)
        return np.array([[*self.lower_m, low], [*self.upper_m, high]])


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
    """What is maximised: how the robots' manipulabilities make one number at a seam point, and those one of the seam.

    ``reading`` is one of Pan et al., eq. (16), or the product or mean of all. ``over_seam`` is the ``mean`` over the
    seam's N points, the ``minimum`` of them, or between the two the ``soft_minimum``, the power mean
    ``(1/N sum_j m_j^-p)^(-1/p)`` with ``exponent`` p: a point half as good as another weighs 2^p times as much in the
    sum. As the joint speed that a welding speed takes goes as 1/m, p = 1 (the harmonic mean) maximises what is got for
    the mean joint speed and p = 2 for its root mean square; the minimum is the limit of large p, and is exceeded by no
    more than the factor N^(1/p). All three grow with m in proportion, so none adds to what depends on the unit.
    """

    reading: Reading
    over_seam: OverSeam = "mean"
    exponent: Positive | None = None

    @model_validator(mode="after")
    def _exponent_goes_with_the_soft_minimum(self) -> "Objective":
        soft = self.over_seam == "soft_minimum"
        if soft and self.exponent is None:
            raise ValueError("over_seam 'soft_minimum' needs an exponent; add e.g. exponent = 8.0")
        if not soft and self.exponent is not None:
            raise ValueError(f"exponent is of over_seam 'soft_minimum', not of '{self.over_seam}'; remove it")
        return self

    @model_serializer(mode="wrap")
    def _without_what_is_usual(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave the mean unsaid, so that a cell's hash is the same whether or not it is stated."""
        usual = {"over_seam": "mean", "exponent": None}
        return {name: value for name, value in handler(self).items() if name not in usual or value != usual[name]}


Band = tuple[Finite, Finite]


class Freedom(Sourced):
    """What a weld leaves free along the seam, for the redundant formulations; bands are offsets from the nominal [deg].

    ``spin_deg``: torch about its own axis. ``yaw_deg``: workpiece about the vertical, where robots carry it.
    ``slope_deg``, ``rotation_deg``: how far the weld may be tilted off its position (ISO 6947), by the robots that
    carry it or by a positioner of two axes; not by one axis, nor where a corner of the bands brings the weld within a
    degree of the table axis. ``travel_deg``, ``work_deg``: tilt of a torch that is held by angles. ``joint_step_deg``:
    how far any joint of a robot may turn from one seam point to the next, and of a positioner that tilts the weld.
    """

    spin_deg: Band = (-180.0, 180.0)
    yaw_deg: Band = (-180.0, 180.0)
    slope_deg: Band = (-5.0, 5.0)
    rotation_deg: Band = (-10.0, 10.0)
    travel_deg: Band = (-5.0, 5.0)
    work_deg: Band = (-5.0, 5.0)
    joint_step_deg: Positive

    @model_validator(mode="after")
    def _bands_hold_the_nominal(self) -> "Freedom":
        for name in ("spin_deg", "yaw_deg", "slope_deg", "rotation_deg", "travel_deg", "work_deg"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} [{low:g}, {high:g}] is empty or reversed; give the lower bound first")
            if not low <= 0.0 <= high:
                raise ValueError(f"{name} [{low:g}, {high:g}] leaves out the nominal 0; widen it")
        return self
