"""Reference kinematics in plain NumPy: link poses, Jacobians and the poses the weld asks for.

Written apart from ``nlpweld.kinematics`` and ``nlpweld.formulation``, so that a mistake there is not repeated here.
Every function works on M configurations at once; poses are homogeneous matrices named ``T_a_b``.
"""

import numpy as np

from nlpweld.cell import Body, Cell, Grasp, Robot, Station, TorchAngles
from nlpweld.geometry.seam import weld_frames
from nlpweld.verify.freedom import Offsets, spun, turned_work

Offset = np.ndarray | float


def rpy_matrix(rpy_deg: tuple[float, float, float]) -> np.ndarray:
    """Return ``Rz(yaw) Ry(pitch) Rx(roll)`` from (roll, pitch, yaw) [deg], shape (3, 3); the URDF convention."""
    roll, pitch, yaw = (_axis_angle(axis, np.radians(a)) for axis, a in zip(np.eye(3), rpy_deg, strict=True))
    return yaw @ pitch @ roll


def base_pose(station: Station) -> np.ndarray:
    """Return T_W_B of a station, shape (4, 4)."""
    return _pose(rpy_matrix(station.base_rpy_deg), np.array(station.base_position_m))


def tool_pose(station: Station) -> np.ndarray:
    """Return T_F_E, the TCP in the flange frame, shape (4, 4): translation first, then rotation."""
    return _pose(rpy_matrix(station.tool.rpy_deg), np.array(station.tool.translation_m))


def joint_transforms(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return ``Rz(q + offset) Tz(d) Tx(a) Rx(alpha)`` of every joint (standard Denavit-Hartenberg).

    Args:
        robot: the robot with n joints.
        q: joint angles in DH direction, shape (M, n) [rad].

    Returns:
        T_{i-1}_i, shape (M, n, 4, 4).
    """
    a, d, alpha, offset = robot.dh.T
    ct, st = np.cos(q + offset), np.sin(q + offset)
    ca, sa = np.cos(alpha), np.sin(alpha)
    T = np.zeros((*q.shape, 4, 4))
    T[..., 0, 0], T[..., 0, 1], T[..., 0, 2], T[..., 0, 3] = ct, -st * ca, st * sa, a * ct
    T[..., 1, 0], T[..., 1, 1], T[..., 1, 2], T[..., 1, 3] = st, ct * ca, -ct * sa, a * st
    T[..., 2, 1], T[..., 2, 2], T[..., 2, 3], T[..., 3, 3] = sa, ca, d, 1.0
    return T


def link_poses(station: Station, q: np.ndarray) -> np.ndarray:
    """Return T_W_L of link 0 (the base) to link n (the flange), shape (M, n + 1, 4, 4).

    Args:
        station: the robot at its place.
        q: joint angles, shape (M, n) [rad].
    """
    return _chain(base_pose(station), joint_transforms(station.robot, q))


def placement_pose(placement: np.ndarray) -> np.ndarray:
    """Return T_W_P, shape (4, 4), of x, y, z [m] and yaw [rad]; of three numbers without yaw."""
    x, y, z, yaw = (*placement, 0.0)[:4]
    return _pose(_axis_angle(np.array([0.0, 0.0, 1.0]), yaw), np.array([x, y, z]))


def positioner_links(cell: Cell, placement: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return T_W_L of the positioner's link 0 (its base B) to its last, the table T, shape (M, n + 1, 4, 4).

    Args:
        cell: a cell with a positioner; its base stands in {P}.
        placement: of {P} in W, shape (3,) or (4,) [m; rad].
        q: joint angles, shape (M, n) [rad].
    """
    assert cell.positioner is not None
    T_P_B = _pose(rpy_matrix(cell.positioner.base_rpy_deg), np.array(cell.positioner.base_position_m))
    return _chain(placement_pose(placement) @ T_P_B, joint_transforms(cell.positioner.robot, q))


def tcp_pose(station: Station, T_W_L: np.ndarray) -> np.ndarray:
    """Return T_W_E, shape (M, 4, 4), from the link poses (M, n + 1, 4, 4)."""
    return T_W_L[:, -1] @ tool_pose(station)


def jacobian(T_W_L: np.ndarray, T_W_E: np.ndarray) -> np.ndarray:
    """Return the geometric Jacobian (v; omega) of the TCP in W, shape (M, 6, n) [m/rad; 1].

    Joint i turns about the z axis of link i - 1 (standard Denavit-Hartenberg).
    """
    z = T_W_L[:, :-1, :3, 2]
    arm = T_W_E[:, None, :3, 3] - T_W_L[:, :-1, :3, 3]
    return np.concatenate([np.cross(z, arm), z], axis=-1).swapaxes(-1, -2)


def manipulability(J: np.ndarray) -> np.ndarray:
    """Return w = sqrt(det(J J^T)) (Pan et al., eq. 11), shape (M,) [m^3], as the product of the singular values of J.

    Args:
        J: geometric Jacobians, shape (M, 6, n); fewer than six joints give zero.
    """
    if J.shape[-1] < J.shape[-2]:
        return np.zeros(J.shape[0])
    return np.linalg.svd(J, compute_uv=False).prod(axis=-1)


def body_ends(station: Station, T_W_L: np.ndarray, T_W_E: np.ndarray) -> np.ndarray:
    """Return both axis ends of every capsule of arm and tool in W, shape (M, bodies, 2, 3) [m]."""
    return _capsule_ends(station.bodies, T_W_L, T_W_E)


def positioner_ends(cell: Cell, T_W_L: np.ndarray) -> np.ndarray:
    """Return both axis ends of every capsule of the positioner in W, shape (M, bodies, 2, 3) [m]."""
    assert cell.positioner is not None
    return _capsule_ends(cell.positioner.robot.bodies, T_W_L, T_W_L[:, -1])


def workpiece_ends(cell: Cell, T_W_C: np.ndarray) -> np.ndarray:
    """Return both axis ends of every capsule of the workpiece in W, shape (M, bodies, 2, 3) [m]."""
    p_C = np.array([(body.start_m, body.end_m) for body in cell.workpiece.bodies])
    return np.einsum("mij,bej->mbei", T_W_C[:, :3, :3], p_C) + T_W_C[:, None, None, :3, 3]


def flat_rotation(normal: np.ndarray) -> np.ndarray:
    """Return the smallest rotation that turns each unit vector to +z (position PA; Pan et al., Fig. 7).

    Args:
        normal: shape (M, 3). The opposite of +z has no smallest rotation; it is turned about x.

    Returns:
        Rotations by the angle between normal and z about normal x z, shape (M, 3, 3).
    """
    across = np.cross(normal, [0.0, 0.0, 1.0])
    sine = np.linalg.norm(across, axis=-1)
    safe = np.where(sine > 1e-15, sine, 1.0)
    axis = np.where(sine[:, None] > 1e-15, across / safe[:, None], [1.0, 0.0, 0.0])
    return _axis_angle(axis, np.arctan2(sine, normal[:, 2]))


def workpiece_pose(
    cell: Cell,
    placement: np.ndarray,
    s: np.ndarray,
    table: np.ndarray | None = None,
    free: Offsets | None = None,
) -> np.ndarray:
    """Return T_W_C, shape (M, 4, 4): where the positioner's joints put it, or turned flat for each weld point.

    Without a positioner C stands at the origin of {P}, turned flat, then as its free angles say, then with {P}.

    Args:
        cell: the cell; its seam and posture are used.
        placement: of {P} in W, shape (3,) or (4,) [m; rad].
        s: seam parameter, shape (M,); of no account where there is a positioner.
        table: joint angles of the positioner, shape (M, n) [rad], where there is one.
        free: offsets of free angles; those of a workpiece on a positioner are in the positioner's joints.
    """
    if cell.positioner is not None:
        assert table is not None
        T_T_C = _pose(rpy_matrix(cell.positioner.mount_rpy_deg), np.array(cell.positioner.mount_position_m))
        return positioner_links(cell, placement, table)[:, -1] @ T_T_C
    T_W_P = placement_pose(placement)
    R_P_C = flat_rotation(weld_frames(cell, s).normal_C)
    if free is not None:
        R_C_p, turn = weld_pose(cell, s)[:, :3, :3], np.radians(cell.posture.turn_deg)
        across_C = np.cos(turn) * R_C_p[..., 1] + np.sin(turn) * R_C_p[..., 2]
        axes_P = R_P_C @ np.stack([R_C_p[..., 0], across_C], axis=-1)
        R_P_C = turned_work(R_P_C, axes_P[..., 0], axes_P[..., 1], free.at(s))
    return _pose(T_W_P[:3, :3] @ R_P_C, T_W_P[:3, 3])


def weld_pose(cell: Cell, s: np.ndarray, seam: str = "main") -> np.ndarray:
    """Return T_C_p, shape (M, 4, 4): x along the tangent, z along the weld normal (Zhang et al., Fig. 1)."""
    weld = weld_frames(cell, s, seam)
    across = np.cross(weld.normal_C, weld.tangent_C)
    return _pose(np.stack([weld.tangent_C, across, weld.normal_C], axis=-1), weld.p_C)


def torch_pose(angles: TorchAngles, travel: Offset = 0.0, work: Offset = 0.0) -> np.ndarray:
    """Return T_p_E of a torch held against the weld (Zhang et al., eq. 4), shape (..., 4, 4), from direction cosines.

    z_H, from the weld to the torch, has cos(travel) along x_p and cos(work) along y_p; x_H is across y_p and turned by
    the spin; the TCP's z axis is -z_H and its x axis x_H.

    Args:
        angles: how it is held.
        travel: offset of the travel angle, any shape (...) [rad].
        work: offset of the work angle, of the same shape; together they may ask for a direction that there is not, and
            then get no unit vector.
    """
    along, across = np.broadcast_arrays(
        np.cos(np.radians(angles.travel_deg) + travel), np.cos(np.radians(angles.work_deg) + work)
    )
    up = np.sqrt(np.maximum(0.0, 1.0 - along**2 - across**2))
    z, width = np.stack([along, across, up], axis=-1), np.hypot(along, up)[..., None]
    x = np.stack([up, np.zeros_like(up), -along], axis=-1)
    x = np.where(width > 1e-12, x / np.maximum(width, 1e-12), [1.0, 0.0, 0.0])  # along y_p there is no across
    spin = np.radians(angles.spin_deg)
    x = np.cos(spin) * x + np.sin(spin) * np.cross(z, x)
    return _pose(np.stack([x, np.cross(x, z), -z], axis=-1), angles.stand_off_m * z)


def required_pose(
    cell: Cell,
    station: Station,
    placement: np.ndarray,
    s: np.ndarray,
    table: np.ndarray | None = None,
    free: Offsets | None = None,
) -> np.ndarray:
    """Return the T_W_E that the weld asks of one robot, shape (M, 4, 4).

    A handler is rigid to the workpiece (Pan et al., eq. 1, 4, 5). A torch's TCP is at the point of its own seam, with
    z straight down and x along the heading in W (eq. 2), or held against the weld frame there (Zhang et al., eq. 13,
    14). The workpiece is where the positioner's own joints put it, so that loops close on what is and not on what
    should be. Where a torch's spin is free it is about the TCP's z axis.

    Args:
        cell: the cell.
        station: one of its stations.
        placement: of {P} in W, shape (3,) or (4,) [m; rad].
        s: seam parameter, shape (M,).
        table: joint angles of the positioner, shape (M, n) [rad], where there is one.
        free: offsets of free angles, if any.
    """
    T_W_C, coupling = workpiece_pose(cell, placement, s, table, free), station.coupling
    if isinstance(coupling, Grasp):
        return T_W_C @ coupling.T_C_E
    u = free.at(s) if free else {}
    spin = u.get(f"spin.{station.name}")
    if coupling.angles is not None:
        tilts = (u.get(f"{name}.{station.name}", 0.0) for name in ("travel", "work"))
        return spun(T_W_C @ weld_pose(cell, s, coupling.seam) @ torch_pose(coupling.angles, *tilts), spin)
    p_C = weld_frames(cell, s, coupling.seam).p_C
    assert coupling.heading_deg is not None
    heading = np.radians(coupling.heading_deg)
    x, z = np.array([np.cos(heading), np.sin(heading), 0.0]), np.array([0.0, 0.0, -1.0])
    p_W = np.einsum("mij,mj->mi", T_W_C[:, :3, :3], p_C) + T_W_C[:, :3, 3]
    return spun(_pose(np.column_stack([x, np.cross(z, x), z]), p_W), spin)


def pose_error(T_W_D: np.ndarray, T_W_E: np.ndarray) -> np.ndarray:
    """Return what takes pose E to the desired pose D: (translation [m], rotation vector [rad]) in W, shape (M, 6)."""
    R = T_W_D[:, :3, :3] @ T_W_E[:, :3, :3].swapaxes(-1, -2)
    vee = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=-1) / 2
    sine = np.linalg.norm(vee, axis=-1)
    angle = np.arctan2(sine, (np.trace(R, axis1=1, axis2=2) - 1) / 2)
    # At half a turn the skew part vanishes and the axis is lost; any axis keeps the size of the error.
    axis = np.where(sine[:, None] > 1e-300, vee / np.maximum(sine, 1e-300)[:, None], [1.0, 0.0, 0.0])
    return np.concatenate([T_W_D[:, :3, 3] - T_W_E[:, :3, 3], axis * angle[:, None]], axis=-1)


def error_size(error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (position error [m], rotation angle [rad]), each of shape (M,), of errors of shape (M, 6)."""
    return np.linalg.norm(error[:, :3], axis=-1), np.linalg.norm(error[:, 3:], axis=-1)


def _chain(T_W_B: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return link poses (M, n + 1, 4, 4) from a base pose (4, 4) and joint transforms (M, n, 4, 4)."""
    poses = np.empty((steps.shape[0], steps.shape[1] + 1, 4, 4))
    poses[:, 0] = T_W_B
    for i in range(steps.shape[1]):
        poses[:, i + 1] = poses[:, i] @ steps[:, i]
    return poses


def _capsule_ends(bodies: tuple[Body, ...], T_W_L: np.ndarray, T_W_E: np.ndarray) -> np.ndarray:
    """Return axis ends in W, shape (M, bodies, 2, 3) [m], of bodies that hang on links and TCP."""
    ends = np.empty((T_W_L.shape[0], len(bodies), 2, 3))
    for b, body in enumerate(bodies):
        for e, end in enumerate((body.start, body.end)):
            T = T_W_E if end.frame == "tcp" else T_W_L[:, int(end.frame.removeprefix("link"))]
            ends[:, b, e] = T[:, :3, :3] @ np.array(end.at_m) + T[:, :3, 3]
    return ends


def _axis_angle(axis: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Return rotations about unit axes (..., 3) by angles (...) [rad], shape (..., 3, 3) (Rodrigues)."""
    x, y, z = np.moveaxis(np.asarray(axis, dtype=float), -1, 0)
    zero = np.zeros_like(x)
    K = np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
    a = np.asarray(angle)[..., None, None]
    return np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * (K @ K)


def _pose(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Join rotations (..., 3, 3) and positions (..., 3) into poses, shape (..., 4, 4)."""
    T = np.zeros((*np.broadcast_shapes(R.shape[:-2], p.shape[:-1]), 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    return T
