"""One arm or positioner as nested MJCF bodies, written from the rows of its Denavit-Hartenberg table."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from nlpweld.cell import Body, Capsule, Robot
from nlpweld.errors import CellError
from nlpweld.sim.mj import mujoco

POSTURES = 5  # seen before a point counts as fixed in a frame
FIXED_M = 1e-9
POINT_M = 1e-9  # a capsule no longer than this is a ball


@dataclass(frozen=True)
class Pose:
    """Where a frame is in another one.

    Attributes:
        p_m: its origin, shape (3,) [m].
        R: its orientation.
    """

    p_m: np.ndarray
    R: Rotation

    @classmethod
    def of(cls, position_m: Sequence[float], rpy_deg: Sequence[float] = (0.0, 0.0, 0.0)) -> "Pose":
        """Return a pose from a position [m] and roll, pitch and yaw about fixed axes [deg]."""
        return cls(np.array(position_m, dtype=float), Rotation.from_euler("xyz", rpy_deg, degrees=True))

    @classmethod
    def from_matrix(cls, T: np.ndarray) -> "Pose":
        """Return a pose from a homogeneous matrix, shape (4, 4)."""
        return cls(T[:3, 3], Rotation.from_matrix(T[:3, :3]))

    def __matmul__(self, other: "Pose") -> "Pose":
        """Return this pose followed by another."""
        return Pose(self.p_m + self.R.apply(other.p_m), self.R * other.R)

    @property
    def inverse(self) -> "Pose":
        """The way back."""
        return Pose(-self.R.inv().apply(self.p_m), self.R.inv())

    @property
    def mjcf(self) -> dict[str, np.ndarray]:
        """Position and quaternion (w, x, y, z) as MJCF takes them."""
        return {"pos": self.p_m, "quat": self.R.as_quat(scalar_first=True)}


def add_chain(parent: Any, base: Pose, robot: Robot, name: str, joint_ball: tuple[float, float]) -> list[Any]:
    """Hang a chain on an MJCF body and return its links, from the base to the flange.

    The frame of every link's body is the link's DH frame; its joint turns about z of the frame before.

    Args:
        parent: the body it stands on.
        base: of link 0 in the parent.
        robot: joints and limits.
        name: of the station or positioner; leads all names.
        joint_ball: radius [m] and density [kg/m^3] of the ball on links without a capsule.
    """
    mj = mujoco()
    links = [parent.add_body(name=f"{name}.link0", **base.mjcf)]
    bare = set(range(1, len(robot.joints) + 1)) - {fixed_in(robot, body)[0] for body in robot.bodies}
    for k, (joint, limits) in enumerate(zip(robot.joints, robot.limits_rad, strict=True), start=1):
        turn, twist = np.radians([joint.offset_deg, joint.alpha_deg])
        at = np.array([joint.a_m * np.cos(turn), joint.a_m * np.sin(turn), joint.d_m])
        step = Pose(at, Rotation.from_rotvec([0, 0, turn]) * Rotation.from_rotvec([twist, 0, 0]))
        link = links[-1].add_body(name=f"{name}.link{k}", **step.mjcf)
        link.add_joint(
            name=f"{name}.J{k}",
            type=mj.mjtJoint.mjJNT_HINGE,
            pos=[-joint.a_m, -joint.d_m * np.sin(twist), -joint.d_m * np.cos(twist)],
            axis=[0, np.sin(twist), np.cos(twist)],
            range=limits,
            limited=1,
        )
        if k in bare:
            radius_m, density = joint_ball
            ball = mj.mjtGeom.mjGEOM_SPHERE
            link.add_geom(type=ball, size=[radius_m, 0, 0], density=density, contype=0, conaffinity=0, group=4)
        links.append(link)
    return links


def add_capsule(parent: Any, name: str, start: np.ndarray, end: np.ndarray, radius_m: float, **inertia: Any) -> None:
    """Add a capsule to an MJCF body; contacts are by pairs alone.

    Args:
        parent: the body.
        name: of the geom.
        start: one end of its axis in the body's frame, shape (3,) [m].
        end: the other.
        radius_m: its radius.
        inertia: density or mass, and how it is spread.
    """
    mj = mujoco()
    common = {"name": name, "contype": 0, "conaffinity": 0, **inertia}
    if np.linalg.norm(end - start) > POINT_M:
        ends = [*start, *end]
        parent.add_geom(type=mj.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=[radius_m, 0, 0], **common)
    else:
        parent.add_geom(type=mj.mjtGeom.mjGEOM_SPHERE, pos=start, size=[radius_m, 0, 0], **common)


def add_bodies(links: list[Any], robot: Robot, bodies: tuple[Body, ...], tool: Pose, name: str, density: float) -> None:
    """Hang capsules on the links of a chain, each on one in which both its ends are fixed.

    Those of an arm go on the first such link, those of a tool on the last, for the two ends of a wrist or a gripper
    may both lie on the axis of a joint.

    Args:
        links: of the chain, from the base to the flange.
        robot: the chain's joints.
        bodies: capsules of the robot or its tool.
        tool: the TCP in the flange frame.
        name: of the station or positioner.
        density: of the capsules [kg/m^3].

    Raises:
        CellError: a capsule's ends are fixed in no link.
    """
    for body in bodies:
        k = fixed_in(robot, body, tool)[0 if body in robot.bodies else -1]
        start, end = (ends[0, k] for ends in _ends_seen(robot, body, tool))
        add_capsule(links[k], f"{name}.{body.name}", start, end, body.radius_m, density=density)


def shell(capsule: Capsule, wall_m: float, density: float) -> dict[str, Any]:
    """Return mass and how it is spread of a capsule that is a tube closed by round caps, as MJCF takes them."""
    inner = max(0.0, capsule.radius_m - wall_m)
    length = float(np.linalg.norm(np.subtract(capsule.end_m, capsule.start_m)))
    volume = _volume(capsule.radius_m, length) - _volume(inner, length)
    kind = mujoco().mjtGeomInertia
    return {"mass": density * volume, "typeinertia": kind.mjINERTIA_SHELL if inner else kind.mjINERTIA_VOLUME}


def fixed_in(robot: Robot, body: Body, tool: Pose | None = None) -> list[int]:
    """Return the links in which both ends of a capsule are fixed, in order.

    Raises:
        CellError: there is none, so the capsule is no rigid body.
    """
    fixed = np.ones(len(robot.joints) + 1, dtype=bool)
    for ends in _ends_seen(robot, body, tool or Pose.of((0.0, 0.0, 0.0))):
        fixed &= np.abs(ends - ends[0]).max(axis=(0, 2)) < FIXED_M
    if not fixed.any():
        raise CellError(f"{robot.name}: body '{body.name}' is rigid to no link, so it has no inertia; mend its ends")
    return [int(k) for k in np.flatnonzero(fixed)]


def _ends_seen(robot: Robot, body: Body, tool: Pose) -> list[np.ndarray]:
    """Return both ends of a capsule in every link's frame, in several postures, each (postures, links, 3) [m]."""
    T, n = _postures(robot.dh.tobytes()), len(robot.joints)
    seen = []
    for end in (body.start, body.end):
        own, at = (n, tool.p_m + tool.R.apply(end.at_m)) if end.frame == "tcp" else (int(end.frame[4:]), end.at_m)
        p = T[:, own, :3, :3] @ np.array(at) + T[:, own, :3, 3]
        seen.append(np.einsum("kli,klij->klj", p[:, None] - T[:, :, :3, 3], T[:, :, :3, :3]))
    return seen


@cache
def _postures(dh: bytes) -> np.ndarray:
    """Return the poses of all links in the base in several postures, shape (postures, links, 4, 4)."""
    rows = np.frombuffer(dh).reshape(-1, 4)
    T = np.tile(np.eye(4), (POSTURES, len(rows) + 1, 1, 1))
    for k, q in enumerate(np.random.default_rng(0).uniform(-3.0, 3.0, (POSTURES, len(rows)))):
        pose = Pose.of((0.0, 0.0, 0.0))
        for i, ((a, d, alpha, offset), angle) in enumerate(zip(rows, q, strict=True), start=1):
            about_z = Rotation.from_rotvec([0, 0, angle + offset])
            pose = pose @ Pose(about_z.apply([a, 0, d]), about_z * Rotation.from_rotvec([alpha, 0, 0]))
            T[k, i, :3, :3], T[k, i, :3, 3] = pose.R.as_matrix(), pose.p_m
    return T


def _volume(radius_m: float, length_m: float) -> float:
    return float(np.pi * radius_m**2 * length_m + 4 / 3 * np.pi * radius_m**3) if radius_m else 0.0
