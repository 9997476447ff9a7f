"""The branch of a six-joint arm with a spherical wrist, told from its joint angles."""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell import Robot, Station

LABELS = {"shoulder": ("front", "back"), "elbow": ("up", "down"), "wrist": ("noflip", "flip")}
JOINT = {"shoulder": "J1", "elbow": "J3", "wrist": "J5"}


@dataclass(frozen=True, eq=False)
class Side:
    """On which side of a singularity an arm is.

    Attributes:
        feature: ``shoulder``, ``elbow`` or ``wrist``.
        value: signed distance from the singularity, shape (M,) [m; the wrist's is a sine].
        unit: ``m`` or nothing.
    """

    feature: str
    value: np.ndarray
    unit: str

    @property
    def labels(self) -> np.ndarray:
        """The side by name, shape (M,)."""
        plus, minus = LABELS[self.feature]
        return np.where(self.value > 0, plus, minus)


def has_branches(robot: Robot) -> bool:
    """Tell whether an arm is of the kind whose branches have these names: parallel joints 2 and 3, spherical wrist."""
    if len(robot.joints) != 6:
        return False
    a, d, alpha, _ = robot.dh.T
    spherical = abs(a[3]) + abs(a[4]) + abs(d[4]) < 1e-12 and min(abs(np.sin(alpha[3:5]))) > 1e-9
    return bool(spherical and abs(np.sin(alpha[1])) < 1e-12)


def sides(station: Station, q: np.ndarray, T_W_L: np.ndarray) -> list[Side]:
    """Return the side of shoulder, elbow and wrist.

    The shoulder is in front where the wrist centre lies on the side joint 1 faces (for offset_2 = -90 deg,
    a1 + a2 sin q2 + a3 sin(q2 + q3) + d4 cos(q2 + q3) > 0); the elbow is up where d4 cos t3 + a3 sin t3 > 0;
    the wrist is not flipped where sin t5 > 0, with t the angle of the DH row, offset included.

    Args:
        station: the robot at its place; see :func:`has_branches`.
        q: joint angles, shape (M, 6) [rad].
        T_W_L: link poses, shape (M, 7, 4, 4).
    """
    a, d, _, offset = station.robot.dh.T
    theta = q + offset
    faces = T_W_L[:, 1, :3, 0]  # x of link 1 is where joint 1 points: Rx(alpha) leaves it alone
    shoulder = (faces * (T_W_L[:, 4, :3, 3] - T_W_L[:, 0, :3, 3])).sum(axis=-1)
    elbow = d[3] * np.cos(theta[:, 2]) + a[2] * np.sin(theta[:, 2])
    return [Side("shoulder", shoulder, "m"), Side("elbow", elbow, "m"), Side("wrist", np.sin(theta[:, 4]), "")]
