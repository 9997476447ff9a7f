"""What the robots do: the workpiece, its seam, how it is held while welding, and how each robot hangs on it."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nlpweld.cell.checked import Checked, Finite, Name, Positive, Sourced, Vector
from nlpweld.cell.robot import Body


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


class Saddle(Sourced):
    """The closed seam where the pipes of a :class:`Tee` meet (Pan et al., eq. 17), in equal steps of angle."""

    curve: Literal["saddle"]
    points: Annotated[int, Field(strict=True, ge=3, le=100_000)]


class Posture(Sourced):
    """How the workpiece is turned while a point is welded.

    ``flat``: the smallest rotation that turns the weld normal to +z_W (position PA).
    """

    rule: Literal["flat"]


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


class Torch(Sourced):
    """Loose coordination: the TCP follows the weld point, z straight down, x along a heading (Pan et al., eq. 2)."""

    kind: Literal["loose"]
    heading_deg: Finite
    may_touch: tuple[str, ...] = ()


Coupling = Annotated[Grasp | Torch, Field(discriminator="kind")]


class Tool(Sourced):
    """What a flange carries: the pose of the TCP in the flange frame F, and the bodies in between."""

    translation_m: Vector
    rpy_deg: Vector = (0.0, 0.0, 0.0)
    bodies: tuple[Body, ...] = ()
