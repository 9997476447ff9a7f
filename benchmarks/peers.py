"""What one would build from good libraries: EAIK (inverse), pinocchio (poses, Jacobians), coal (capsule distances).

One pinocchio model holds all arms and, as one more free joint, the workpiece, so that a single C++ call a point
gives every pose, one more every Jacobian column, and one more every distance. Loops in Python run over points only.
Candidates are left out as early as nlpweld does: reach, limits and singularity before any clearance.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import coal
import numpy as np
import pinocchio as pin
from eaik.IK_DH import DhRobot

from benchmarks.naive import Arm, Verdict, arm_of, inside, rotation_to, seam
from nlpweld.cell import Body, Cell
from nlpweld.verify.bodies import body_table

LOST = Verdict(float("-inf"), False)


@dataclass(eq=False)
class Peers:
    """EAIK, pinocchio and coal on one cell.

    Attributes:
        cell: a cell whose robots stand in front, elbow up; either wrist will do.
    """

    cell: Cell
    arms: list[Arm] = field(init=False)

    def __post_init__(self) -> None:
        """Build all models."""
        self.arms = [arm_of(s) for s in self.cell.stations]
        self.solvers = [DhRobot(*(np.array(arm.dh)[:, i] for i in (2, 0, 1))) for arm in self.arms]
        self.T_C = _workpiece_turns(self.cell)
        self.p_C = np.array([p for _, p in seam(self.cell)])
        self.model, self.tcps = robots_model(self.arms)
        self.geometry = collision_model(self.cell, self.model)
        self.data, self.gaps = self.model.createData(), self.geometry.createData()
        self.turned = [pin.Quaternion(T[:3, :3]).coeffs() for T in self.T_C]

    def __call__(self, X: np.ndarray) -> list[Verdict]:
        """Return the verdict of every placement (m, 3) [m]."""
        return [self.verdict(x) for x in X]

    def verdict(self, x: np.ndarray) -> Verdict:
        """Return the verdict of one placement (3,) [m]."""
        level = self.cell.constraints
        need = np.radians(level.joint_margin_deg)
        paths = []
        for k, arm in enumerate(self.arms):
            path = self.joint_path(k, x)
            if path is None or not inside(arm, path, need):
                return LOST
            paths.append(path)
        configurations = self.configurations(x, paths)
        w, volume = self.measures(configurations)
        if w.min() < level.singularity_floor_m3 + level.singularity_margin_m3:
            return LOST
        clearance = min(self.clearance(q) for q in configurations)
        feasible = clearance >= level.clearance_m + level.clearance_margin_m
        return Verdict(_mean_mmr(w, volume), feasible, clearance)

    def joint_path(self, k: int, x: np.ndarray) -> np.ndarray | None:
        """Return the joints of robot k at every point (N, 6) [rad], noflip wrist, or None where out of reach."""
        solve, poses = self.solvers[k].IK, list(self.flange_poses(k, x))
        if front_up(self.arms[k], [solve(poses[0])]) is None:  # most that fail, fail everywhere
            return None
        return front_up(self.arms[k], [solve(T) for T in poses])

    def flange_poses(self, k: int, x: np.ndarray) -> np.ndarray:
        """Return T_B_F of robot k at every point, shape (N, 4, 4)."""
        arm, T_W_C = self.arms[k], self.T_C.copy()
        T_W_C[:, :3, 3] = x
        if arm.T_C_E is not None:
            return arm.T_B_W @ T_W_C @ (arm.T_C_E @ arm.T_E_F)
        heading = np.radians(arm.station.coupling.heading_deg)
        x_axis = np.array([np.cos(heading), np.sin(heading), 0.0])
        T_W_E = np.tile(np.eye(4), (len(T_W_C), 1, 1))
        T_W_E[:, :3, :3] = np.column_stack([x_axis, np.cross([0, 0, -1.0], x_axis), [0, 0, -1.0]])
        T_W_E[:, :3, 3] = np.einsum("nij,nj->ni", T_W_C[:, :3, :3], self.p_C) + x
        return arm.T_B_W @ T_W_E @ arm.T_E_F

    def configurations(self, x: np.ndarray, paths: list[np.ndarray]) -> np.ndarray:
        """Return pinocchio's configuration at every point: all joints, then the workpiece's pose."""
        return np.hstack([*paths, np.tile(x, (len(self.turned), 1)), self.turned])

    def measures(self, configurations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return w [m^3] and the ellipsoids' volumes up to a factor, each (N, robots)."""
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        J = np.empty((len(configurations), len(self.arms), 6, 6))
        for j, q in enumerate(configurations):
            pin.computeJointJacobians(self.model, self.data, q)
            for k, tcp in enumerate(self.tcps):
                J[j, k] = pin.getFrameJacobian(self.model, self.data, tcp, world)[:, 6 * k : 6 * k + 6]
        linear = J[..., :3, :]
        return np.abs(np.linalg.det(J)), np.sqrt(np.linalg.det(linear @ linear.swapaxes(-1, -2)))

    def clearance(self, q: np.ndarray) -> float:
        """Return the least distance of all pairs and of all bodies to the floor at one configuration [m]."""
        nearest = pin.computeDistances(self.model, self.data, self.geometry, self.gaps, q)
        return self.gaps.distanceResults[nearest].min_distance


def jacobian_job(arm: Arm, path: np.ndarray) -> Callable[[], object]:
    """Return what computes TCP pose, Jacobian and its determinant along a path (N, 6)."""
    model, (tcp,) = robots_model([arm], workpiece=False)
    data, world = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def run() -> np.ndarray:
        J = np.empty((len(path), 6, 6))
        for j, q in enumerate(path):
            pin.computeJointJacobians(model, data, q)
            J[j] = pin.getFrameJacobian(model, data, tcp, world)
        return np.linalg.det(J)

    return run


def inverse_job(arm: Arm, poses: list[np.ndarray]) -> Callable[[], object]:
    """Return what finds all solutions of many flange poses."""
    dh = np.array(arm.dh)
    solve = DhRobot(dh[:, 2], dh[:, 0], dh[:, 1]).IK
    return lambda: [solve(T).Q for T in poses]


def clearance_job(cell: Cell, x: np.ndarray, paths: list[np.ndarray]) -> Callable[[], object]:
    """Return what finds the least distance at every point; the poses of the bodies are part of it."""
    peers = Peers(cell)
    configurations = peers.configurations(x, paths)
    return lambda: [peers.clearance(q) for q in configurations]


def front_up(arm: Arm, solutions: list) -> np.ndarray | None:
    """Return of each pose's solutions the one with shoulder front, elbow up, noflip wrist, or None if one has none."""
    theta = np.concatenate([s.Q.reshape(-1, 6) for s in solutions])
    guessed = np.concatenate([s.is_LS for s in solutions])  # least-squares answers to poses out of reach
    q2, q23, q3 = theta[:, 1], theta[:, 1] + theta[:, 2], theta[:, 2]
    (a1, *_), (a2, *_), (a3, *_), (_, d4, *_) = arm.dh[:4]
    radius = a1 + a2 * np.cos(q2) + a3 * np.cos(q23) - d4 * np.sin(q23)
    elbow = d4 * np.cos(q3) + a3 * np.sin(q3)
    chosen = (radius > 0) & (elbow > 0) & (np.sin(theta[:, 4]) > 0) & ~guessed.astype(bool)
    pose = np.repeat(np.arange(len(solutions)), [len(s.Q) for s in solutions])[chosen]
    found, first = np.unique(pose, return_index=True)
    return theta[chosen][first] - [row[3] for row in arm.dh] if len(found) == len(solutions) else None


def robots_model(arms: list[Arm], workpiece: bool = True) -> tuple[pin.Model, list[int]]:
    """Return one model of all arms in the world frame and the free workpiece, and the frames of the TCPs."""
    model, tcps = pin.Model(), []
    for arm in arms:
        name, parent, fixed = arm.station.name, 0, pin.SE3(arm.T_W_B)
        model.addFrame(pin.Frame(f"{name}.link0", 0, fixed, pin.FrameType.OP_FRAME))
        for i, (a, d, alpha, offset) in enumerate(arm.dh, start=1):
            turn = pin.SE3(pin.utils.rotate("z", offset), np.zeros(3))
            parent = model.addJoint(parent, pin.JointModelRZ(), fixed * turn, f"{name}.joint{i}")
            fixed = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0.0, d]))
            model.addFrame(pin.Frame(f"{name}.link{i}", parent, fixed, pin.FrameType.OP_FRAME))
        tcp = pin.Frame(f"{name}.tcp", parent, fixed * pin.SE3(arm.T_F_E), pin.FrameType.OP_FRAME)
        tcps.append(model.addFrame(tcp))
    if workpiece:
        model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "workpiece")
    return model, tcps


def collision_model(cell: Cell, model: pin.Model) -> pin.GeometryModel:
    """Return one coal capsule per body, in the order of the body table, and all pairs."""
    table, geometry = body_table(cell), pin.GeometryModel()
    bodies = [(s.name, body) for s in cell.stations for body in s.bodies]
    for label, (owner, body) in zip(table.label, bodies, strict=False):
        joint, ends = _in_joint(model, owner, body)
        _add(geometry, label, joint, ends, body.radius_m)
    for piece in cell.workpiece.bodies:
        ends = np.array([piece.start_m, piece.end_m])
        _add(geometry, f"workpiece.{piece.name}", model.getJointId("workpiece"), ends, piece.radius_m)
    for a, b in table.pairs:
        geometry.addCollisionPair(pin.CollisionPair(int(a), int(b)))
    half_space = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    floor = geometry.addGeometryObject(pin.GeometryObject("floor", 0, pin.SE3.Identity(), half_space))
    for b in table.above_floor:
        geometry.addCollisionPair(pin.CollisionPair(int(b), floor))
    return geometry


def _in_joint(model: pin.Model, owner: str, body: Body) -> tuple[int, np.ndarray]:
    """Return the joint a body is rigid to, found by moving the joints, and its ends (2, 3) in that joint's frame."""
    frames = [model.getFrameId(f"{owner}.{end.frame}") for end in (body.start, body.end)]
    rng, seen = np.random.default_rng(0), []
    for q in (pin.neutral(model), pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))):
        data = model.createData()
        pin.framesForwardKinematics(model, data, q)
        ends = [data.oMf[f].act(np.array(e.at_m)) for f, e in zip(frames, (body.start, body.end), strict=True)]
        seen.append([np.array([M.actInv(p) for p in ends]) for M in data.oMi])
    joint = next(i for i, (here, there) in enumerate(zip(*seen, strict=True)) if np.allclose(here, there, atol=1e-12))
    return joint, seen[0][joint]


def _add(geometry: pin.GeometryModel, name: str, joint: int, ends: np.ndarray, radius_m: float) -> None:
    axis = ends[1] - ends[0]
    placement = pin.SE3(rotation_to(axis), ends.mean(axis=0))
    capsule = coal.Capsule(radius_m, float(np.linalg.norm(axis)))
    geometry.addGeometryObject(pin.GeometryObject(name, joint, placement, capsule))


def _workpiece_turns(cell: Cell) -> np.ndarray:
    """Return T_W_C with the origin in (0, 0, 0) at every seam point, shape (N, 4, 4)."""
    T = np.tile(np.eye(4), (cell.seam.points, 1, 1))
    T[:, :3, :3] = [R for R, _ in seam(cell)]
    return T


def _mean_mmr(w: np.ndarray, volume: np.ndarray) -> float:
    """Return the mean over the seam of Pan et al., eq. (16), for two handlers and a welder."""
    beta_1, beta_2 = (1 / volume[:, 0] + 1 / volume[:, 1]) / 2, 1 / volume[:, 2]
    return float(np.mean((beta_1 * w[:, 0] * w[:, 1] + beta_2 * w[:, 2]) / (beta_1 + beta_2)))
