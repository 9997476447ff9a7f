"""What the robots do: the workpiece, how it is held and turned while welding, and how each robot hangs on it."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nlpweld.cell.checked import Checked, Finite, Name, Positive, Sourced, Vector
from nlpweld.cell.robot import Body, Robot


class Capsule(Checked):
    """A capsule fixed in the workpiece frame C."""

    name: Name
    start_m: Vector
    end_m: Vector
    radius_m: Positive


class Tee(Sourced):
    """Two pipes that meet at right angles: main pipe along x_C, branch along +z_C (Pan et al., Fig. 5)."""

    shape: Literal["tee"]
    main_radius_m: Positive
    branch_radius_m: Positive
    main_length_m: Positive
    branch_top_m: Positive

    @model_validator(mode="after")
    def _pipes_fit(self) -> "Tee":
        if self.branch_radius_m >= self.main_radius_m:
            raise ValueError(
                f"branch_radius_m {self.branch_radius_m:g} is not below main_radius_m {self.main_radius_m:g}; "
                "the saddle seam needs a thinner branch"
            )
        if self.main_length_m <= 2 * self.main_radius_m:
            raise ValueError("main_length_m is not above twice main_radius_m; lengthen the main pipe")
        if self.branch_top_m <= self.main_radius_m:
            raise ValueError("branch_top_m is not above main_radius_m; the branch would end inside the main pipe")
        return self

    @property
    def bodies(self) -> tuple[Capsule, ...]:
        """The pipes as capsules in C; the main pipe's round caps end at its open ends."""
        half = self.main_length_m / 2 - self.main_radius_m
        zero = (0.0, 0.0, 0.0)
        return (
            Capsule(name="main_pipe", start_m=(-half, 0.0, 0.0), end_m=(half, 0.0, 0.0), radius_m=self.main_radius_m),
            Capsule(name="branch", start_m=zero, end_m=(0.0, 0.0, self.branch_top_m), radius_m=self.branch_radius_m),
        )


class Solid(Sourced):
    """Any workpiece, as capsules fixed in C."""

    shape: Literal["capsules"]
    bodies: Annotated[tuple[Capsule, ...], Field(min_length=1)]


Workpiece = Annotated[Tee | Solid, Field(discriminator="shape")]


class Saddle(Sourced):
    """The closed seam where the pipes of a :class:`Tee` meet (Pan et al., eq. 17), in equal steps of angle."""

    curve: Literal["saddle"]
    points: Annotated[int, Field(strict=True, ge=3, le=100_000)]

    @property
    def closed(self) -> bool:
        """It goes once about the branch."""
        return True


class Posture(Sourced):
    """How the workpiece is turned while a point is welded.

    ``flat``: a workpiece carried by robots makes the smallest rotation that turns the weld normal to +z_W (position
    PA). ``upright``: a positioner turns the main seam's normal, after a turn about the tangent by ``turn_deg``, to
    +z_W: 0 for the flat and the ship position, half the angle between the plates for a horizontal fillet (PB; Zhang
    et al., section 1.1).
    """

    rule: Literal["flat", "upright"]
    turn_deg: Finite = 0.0


class Positioner(Sourced):
    """A chain of one or two axes that holds the workpiece: the master (Zhang et al., Fig. 5).

    Its base frame {B} stands in the placement frame {P}, which is what is placed; the workpiece frame C stands on the
    table {T}, the last link. ``may_touch`` lists ``body/workpiece body`` pairs that are bolted together.
    """

    name: Name = "positioner"
    robot: Robot
    base_position_m: Vector = (0.0, 0.0, 0.0)
    base_rpy_deg: Vector = (0.0, 0.0, 0.0)
    mount_position_m: Vector
    mount_rpy_deg: Vector = (0.0, 0.0, 0.0)
    may_touch: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _has_one_or_two_axes(self) -> "Positioner":
        n = len(self.robot.joints)
        if n > 2:
            raise ValueError(f"robot '{self.robot.name}' has {n} joints; a positioner has one or two")
        return self


class Grasp(Sourced):
    """Tight coordination: the TCP is rigid to the workpiece (Pan et al., eq. 1, 4, 5).

    The TCP z axis points along (azimuth, elevation) in C; its x axis is ``x_reference`` made orthogonal to it.
    ``may_touch`` lists ``body/workpiece body`` pairs whose contact is the grasp itself.
    """

    kind: Literal["tight"]
    position_m: Vector
    azimuth_deg: Finite
    elevation_deg: Finite
    x_reference: Vector
    may_touch: tuple[str, ...] = ()

    @property
    def T_C_E(self) -> np.ndarray:
        """Pose of the TCP in the workpiece frame, shape (4, 4)."""
        a, e = np.radians(self.azimuth_deg), np.radians(self.elevation_deg)
        z = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        x = np.array(self.x_reference) - z * (z @ np.array(self.x_reference))
        x /= np.linalg.norm(x)
        pose = np.eye(4)
        pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
        pose[:3, 3] = self.position_m
        return pose

    @model_validator(mode="after")
    def _reference_is_not_along_the_approach(self) -> "Grasp":
        a, e = np.radians(self.azimuth_deg), np.radians(self.elevation_deg)
        approach = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        reference = np.array(self.x_reference)
        if np.linalg.norm(np.cross(approach, reference)) <= 1e-6 * np.linalg.norm(reference):
            raise ValueError("x_reference is parallel to the approach direction; choose another")
        return self


class TorchAngles(Checked):
    """How a torch is held against the weld frame {p} of its seam (Zhang et al., eq. 2 to 4).

    ``travel_deg``: from the tangent to the torch axis, which points from the weld to the torch. ``work_deg``: from
    y_p = normal x tangent to the torch axis, counted negative; -90 is in the plane of normal and tangent.
    ``spin_deg``: about the torch axis. ``stand_off_m``: from the weld point to the TCP.
    """

    travel_deg: Annotated[float, Field(strict=True, gt=0.0, lt=180.0)]
    work_deg: Annotated[float, Field(strict=True, ge=-180.0, le=0.0)]
    spin_deg: Finite
    stand_off_m: Finite = 0.0

    @model_validator(mode="after")
    def _some_direction_has_both(self) -> "TorchAngles":
        t, w = np.cos(np.radians([self.travel_deg, self.work_deg]))
        if t * t + w * w > 1 + 1e-12:
            raise ValueError(
                f"no torch direction has travel_deg {self.travel_deg:g} and work_deg {self.work_deg:g}: "
                f"cos^2 + cos^2 is {t * t + w * w:.4g}, above 1; bring one of them nearer to a right angle"
            )
        return self


class Torch(Sourced):
    """Loose coordination: the TCP follows the weld point (Pan et al., eq. 2; Zhang et al., eq. 13, 14).

    With ``heading_deg`` its z axis points straight down and its x axis along a heading in W, from +x_W. With
    ``angles`` it is held against the weld frame, z_E pointing at the weld. ``seam`` names which seam it welds.
    """

    kind: Literal["loose"]
    heading_deg: Finite | None = None
    angles: TorchAngles | None = None
    seam: Name = "main"
    may_touch: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _is_held_in_one_way(self) -> "Torch":
        if (self.heading_deg is None) == (self.angles is None):
            raise ValueError("give either heading_deg or angles, and not both")
        return self


Coupling = Annotated[Grasp | Torch, Field(discriminator="kind")]


class Tool(Sourced):
    """What a flange carries: the pose of the TCP in the flange frame F, and the bodies in between."""

    translation_m: Vector
    rpy_deg: Vector = (0.0, 0.0, 0.0)
    bodies: tuple[Body, ...] = ()
