"""What one would write first: a loop over points and robots, 4 x 4 matrices in NumPy, python-fcl for every pair.

Everything is written apart from nlpweld's graphs; only the cell's numbers are read. Objects that can be reused are.
"""

from dataclasses import dataclass
from itertools import product
from math import acos, atan2, cos, hypot, pi, sin, sqrt

import fcl
import numpy as np

from nlpweld.cell import Cell, Grasp, Station
from nlpweld.verify.bodies import BodyTable, body_table
from nlpweld.verify.reference import rpy_matrix


@dataclass(frozen=True)
class Verdict:
    """What a contender says of one placement.

    Attributes:
        mmr: mean over the seam; -inf where it was not computed.
        feasible: whether every constraint holds with the solvers' margins.
        clearance_m: the least over pairs and points; NaN where it was not computed [m].
    """

    mmr: float
    feasible: bool
    clearance_m: float = float("nan")


@dataclass(frozen=True)
class Arm:
    """The numbers of one station: DH rows, joint limits, poses of base, tool and grasp (None for the torch)."""

    station: Station
    dh: list[tuple[float, float, float, float]]
    limits: np.ndarray
    T_W_B: np.ndarray
    T_B_W: np.ndarray
    T_F_E: np.ndarray
    T_E_F: np.ndarray
    T_C_E: np.ndarray | None


@dataclass(eq=False)
class Naive:
    """The loops.

    Attributes:
        cell: a cell whose robots stand in front, elbow up; either wrist will do.
        early: leave out clearances where joint limits or singularity floor already fail, as nlpweld does.
    """

    cell: Cell
    early: bool = False

    def __post_init__(self) -> None:
        """Prepare arms, seam and collision objects."""
        c = self.cell.configuration
        if (c.shoulder, c.elbow, c.wrist) != ("front", "up", "any"):
            raise ValueError("the naive loop knows shoulder front, elbow up, any wrist only")
        self.arms = [arm_of(s) for s in self.cell.stations]
        self.seam = seam(self.cell)
        self.table = body_table(self.cell)
        self.objects = collision_objects(self.cell, self.table)

    def __call__(self, X: np.ndarray) -> list[Verdict]:
        """Return the verdict of every placement (m, 3) [m]."""
        return [self.verdict(x) for x in X]

    def verdict(self, x: np.ndarray) -> Verdict:
        """Return the verdict of one placement (3,) [m]."""
        paths = self.joint_paths(x)
        if paths is None:
            return Verdict(float("-inf"), False)
        measures = [[measure(arm, q) for q in path] for arm, path in zip(self.arms, paths, strict=True)]
        level = self.cell.constraints
        floor = level.singularity_floor_m3 + level.singularity_margin_m3
        good = min(w for robot in measures for w, _, _ in robot) >= floor
        need = np.radians(level.joint_margin_deg)
        good = good and all(inside(arm, path, need) for arm, path in zip(self.arms, paths, strict=True))
        if self.early and not good:
            return Verdict(float("-inf"), False)
        mmr = self.mean_mmr(measures)
        clearance = min(self.clearance(x, j, [robot[j][2] for robot in measures]) for j in range(len(self.seam)))
        return Verdict(mmr, bool(good and clearance >= level.clearance_m + level.clearance_margin_m), clearance)

    def joint_paths(self, x: np.ndarray) -> list[list[np.ndarray]] | None:
        """Return the joints of every robot at every point (noflip wrist), or None where a point is out of reach."""
        paths: list[list[np.ndarray]] = [[] for _ in self.arms]
        for R_W_C, p_C in self.seam:
            for arm, path in zip(self.arms, paths, strict=True):
                q = inverse(arm.dh, flange_pose(arm, x, R_W_C, p_C))
                if q is None:
                    return None
                path.append(q)
        return paths

    def mean_mmr(self, measures: list[list[tuple]]) -> float:
        """Return the mean over the seam of Pan et al., eq. (16), for two handlers and a welder."""
        total = 0.0
        for (w_1, v_1, _), (w_2, v_2, _), (w_3, v_3, _) in zip(*measures, strict=True):
            beta_1, beta_2 = (1 / v_1 + 1 / v_2) / 2, 1 / v_3
            total += (beta_1 * w_1 * w_2 + beta_2 * w_3) / (beta_1 + beta_2)
        return total / len(measures[0])

    def clearance(self, x: np.ndarray, j: int, poses: list[list[np.ndarray]]) -> float:
        """Return the least distance of all pairs and of all bodies to the floor at one point [m]."""
        return self.least_distance(self.ends(x, j, poses))

    def ends(self, x: np.ndarray, j: int, poses: list[list[np.ndarray]]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return both axis ends of every body at one point, in the order of the body table."""
        T_W_C = pose(self.seam[j][0], x)
        ends = [e for arm, links in zip(self.arms, poses, strict=True) for e in robot_ends(arm, links)]
        return ends + [(at(T_W_C, b.start_m), at(T_W_C, b.end_m)) for b in self.cell.workpiece.bodies]

    def least_distance(self, ends: list[tuple[np.ndarray, np.ndarray]]) -> float:
        """Return the least distance of all pairs and of all bodies to the floor, given their axis ends in W [m]."""
        for body, (start, end) in zip(self.objects, ends, strict=True):
            body.setTransform(fcl.Transform(rotation_to(end - start), (start + end) / 2))
        low = min(fcl.distance(self.objects[a], self.objects[b]) for a, b in self.table.pairs)
        for b in self.table.above_floor:
            low = min(low, ends[b][0][2] - self.table.radius_m[b], ends[b][1][2] - self.table.radius_m[b])
        return float(low)


def arm_of(station: Station) -> Arm:
    """Return the numbers of a station."""
    T_W_B = pose(rpy_matrix(station.base_rpy_deg), station.base_position_m)
    T_F_E = pose(rpy_matrix(station.tool.rpy_deg), station.tool.translation_m)
    T_C_E = station.coupling.T_C_E if isinstance(station.coupling, Grasp) else None
    dh = [tuple(float(v) for v in row) for row in station.robot.dh]
    limits = station.robot.limits_rad
    return Arm(station, dh, limits, T_W_B, np.linalg.inv(T_W_B), T_F_E, np.linalg.inv(T_F_E), T_C_E)


def seam(cell: Cell) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return R_W_C and p_C of every seam point (Pan et al., eq. 17; flat position by Rodrigues' formula)."""
    ra, rb = cell.workpiece.main_radius_m, cell.workpiece.branch_radius_m
    points = []
    for j in range(cell.seam.points):
        c, s = cos(2 * pi * j / cell.seam.points), sin(2 * pi * j / cell.seam.points)
        p = np.array([rb * c, rb * s, sqrt(ra**2 - (rb * s) ** 2)])
        n = np.array([0.0, p[1], p[2]]) / ra + np.array([c, s, 0.0])
        n /= np.linalg.norm(n)
        axis = np.cross(n, [0.0, 0.0, 1.0])
        sine = np.linalg.norm(axis)
        k = axis / sine
        K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        points.append((np.eye(3) + sine * K + (1 - n[2]) * K @ K, p))
    return points


def flange_pose(arm: Arm, x: np.ndarray, R_W_C: np.ndarray, p_C: np.ndarray) -> np.ndarray:
    """Return T_B_F that the weld asks of one robot."""
    T_W_C = pose(R_W_C, x)
    if arm.T_C_E is not None:
        T_W_E = T_W_C @ arm.T_C_E
    else:
        heading = np.radians(arm.station.coupling.heading_deg)
        x_axis, z_axis = np.array([cos(heading), sin(heading), 0.0]), np.array([0.0, 0.0, -1.0])
        T_W_E = pose(np.column_stack([x_axis, np.cross(z_axis, x_axis), z_axis]), at(T_W_C, p_C))
    return arm.T_B_W @ T_W_E @ arm.T_E_F


def inverse(dh: list, T: np.ndarray, shoulder: int = 1, elbow: int = 1, wrist: int = 1) -> np.ndarray | None:
    """Return the joints (6,) [rad] of one branch for a flange pose in the base frame, or None out of reach."""
    (a1, d1, _, _), (a2, _, _, _), (a3, _, _, _), (_, d4, _, _), _, (_, d6, _, _) = dh
    wx, wy, wz = T[:3, 3] - d6 * T[:3, 2]
    radius = shoulder * hypot(wx, wy)
    q1 = atan2(shoulder * wy, shoulder * wx)
    x, z = radius - a1, wz - d1
    length = hypot(a3, d4)
    cos_elbow = (x * x + z * z - a2 * a2 - length * length) / (2 * a2 * length)
    if abs(cos_elbow) > 1:
        return None
    opening = elbow * acos(cos_elbow)
    q3 = opening - atan2(d4, a3)
    q2 = atan2(-z, x) - atan2(length * sin(opening), a2 + length * cos_elbow)
    q23, c1, s1 = q2 + q3, cos(q1), sin(q1)
    c, s = cos(q23), sin(q23)
    R = np.array([[c1 * c, s1, -c1 * s], [s1 * c, -c1, -s1 * s], [-s, 0, -c]]).T @ T[:3, :3]
    s5 = wrist * hypot(R[0, 2], R[1, 2])
    q4 = atan2(-wrist * R[1, 2], -wrist * R[0, 2])
    q6 = atan2(wrist * -R[2, 1], wrist * R[2, 0]) if s5 else 0.0
    theta = [q1, q2, q3, q4, atan2(s5, R[2, 2]), q6]
    return np.array([t - row[3] for t, row in zip(theta, dh, strict=True)])


def links(arm: Arm, q: np.ndarray) -> list[np.ndarray]:
    """Return T_W_L of link 0 (the base) to link 6 (the flange), then T_W_E."""
    poses = [arm.T_W_B]
    for (a, d, alpha, offset), angle in zip(arm.dh, q, strict=True):
        c, s, ca, sa = cos(angle + offset), sin(angle + offset), cos(alpha), sin(alpha)
        T = np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
        poses.append(poses[-1] @ T)
    return [*poses, poses[-1] @ arm.T_F_E]


def jacobian(poses: list[np.ndarray]) -> np.ndarray:
    """Return the geometric Jacobian (v; omega) of the TCP in W, shape (6, 6)."""
    z = np.array([T[:3, 2] for T in poses[:6]])
    levers = poses[-1][:3, 3] - np.array([T[:3, 3] for T in poses[:6]])
    return np.vstack([np.cross(z, levers).T, z.T])


def measure(arm: Arm, q: np.ndarray) -> tuple[float, float, list[np.ndarray]]:
    """Return w [m^3], the ellipsoid's volume up to a factor [m^3], and the poses of links and TCP."""
    poses = links(arm, q)
    J = jacobian(poses)
    return abs(np.linalg.det(J)), sqrt(np.linalg.det(J[:3] @ J[:3].T)), poses


def inside(arm: Arm, path: list[np.ndarray], need: float) -> bool:
    """Tell whether the closed path, on either wrist, keeps the joint limits after some whole turns of each joint."""
    q = np.unwrap(np.array([*path, path[0]]), axis=0)
    flipped = q + np.array([0, 0, 0, pi, 0, pi])
    flipped[:, 4] = -q[:, 4] - 2 * arm.dh[4][3]
    return any(all(fits(wrist[:, i], *arm.limits[i], need) for i in range(6)) for wrist in (q, flipped))


def fits(path: np.ndarray, lower: float, upper: float, need: float) -> bool:
    """Tell whether a joint's path keeps its limits after a turn either way or none."""
    low, high = path.min(), path.max()
    return any(low + turn - lower >= need and upper - high - turn >= need for turn in (0.0, 2 * pi, -2 * pi))


def robot_ends(arm: Arm, poses: list[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return both axis ends of every body of arm and tool in W."""
    frames = {**{f"link{i}": T for i, T in enumerate(poses[:-1])}, "tcp": poses[-1]}
    return [(at(frames[b.start.frame], b.start.at_m), at(frames[b.end.frame], b.end.at_m)) for b in arm.station.bodies]


def body_lengths(cell: Cell) -> list[float]:
    """Return the length of every body's axis [m], in the order of the body table; bodies are rigid."""
    ends = [e for s in cell.stations for arm in [arm_of(s)] for e in robot_ends(arm, links(arm, np.zeros(6)))]
    ends += [(np.array(b.start_m), np.array(b.end_m)) for b in cell.workpiece.bodies]
    return [float(np.linalg.norm(b - a)) for a, b in ends]


def collision_objects(cell: Cell, table: BodyTable) -> list[fcl.CollisionObject]:
    """Return one FCL capsule per body."""
    return [fcl.CollisionObject(fcl.Capsule(r, h)) for r, h in zip(table.radius_m, body_lengths(cell), strict=True)]


def rotation_to(axis: np.ndarray) -> np.ndarray:
    """Return a rotation whose z axis lies along a vector (an FCL capsule lies along z)."""
    z = axis / np.linalg.norm(axis)
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.7 else np.array([0.0, 1.0, 0.0])
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def pose(R: np.ndarray, p: np.ndarray | tuple) -> np.ndarray:
    """Join a rotation and a position."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def at(T: np.ndarray, p: np.ndarray | tuple) -> np.ndarray:
    """Return a point of a frame in the frame's parent."""
    return T[:3, :3] @ p + T[:3, 3]


BRANCHES = tuple(product((1, -1), repeat=3))
