"""Plans for the cells with a positioner from closed forms of their own: neither the verifier's nor the model's code.

Poses as in the prototype of these cells: PB is the positioner's base with z up, T the table, C the workpiece, p a weld
frame, H the torch's (z_H from the seam to the torch), E the TCP. N seam points lead every shape.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from nlpweld.cell import Cell, Robot
from nlpweld.plan import Plan

PLACES = {"A": (-0.5, -1.3), "B": (0.0, -1.2), "C": (0.4, -1.3), "D": (0.2, -1.4)}
HEIGHT = 0.5  # of PB
TABLE = 0.25  # from the tilt axis
BRANCH = ("front", "up", "noflip")


def rot(axes: str, *angles) -> np.ndarray:
    """Return products of rotations about the current axes, e.g. ``rot("YX", a, b)`` = Ry(a) Rx(b), (N, 3, 3)."""
    return Rotation.from_euler(axes, np.stack(np.broadcast_arrays(*angles), axis=-1)).as_matrix()


def turned(R: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...j->...i", R, v)


def trough(s: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return p_C, R_C_p and outward normal of the U plate, of the far (+1) or the near (-1) seam of the trough."""
    radius, leg, length = 0.15, 0.30, 1.00
    arc = np.pi * radius
    way = s * (2 * leg + arc)
    psi = np.clip((way - leg) / radius, 0, np.pi) + np.pi / 2
    n, t = (np.stack([np.cos(a), np.sin(a), 0 * a], axis=-1) for a in (psi, psi + np.pi / 2))
    p = radius * n + [0, 0, side * length / 2]
    p[:, 0] += np.maximum(leg - way, 0) + np.maximum(way - leg - arc, 0)
    z = (n - [0, 0, side]) / np.sqrt(2)
    return p, np.stack([t, np.cross(z, t), z], axis=-1), n


def flange(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return p_C, R_C_p and the direction to be upright, its z axis, of the foot of the pipe."""
    psi = 2 * np.pi * s
    n, t = (np.stack([np.cos(a), np.sin(a), 0 * a], axis=-1) for a in (psi, psi + np.pi / 2))
    z = (n + np.array([0, 0, 1])) / np.sqrt(2)
    return 0.06 * n, np.stack([t, np.cross(z, t), z], axis=-1), z


def table_angles(e: np.ndarray) -> np.ndarray:
    """Return theta1, theta2 (N, 2) that turn directions of the table upright, by Zhang et al., eq. 8, k = 0."""
    theta2 = np.unwrap(np.arctan2(-e[:, 1], e[:, 0]))
    theta2 -= 2 * np.pi * np.round((theta2.max() + theta2.min()) / 2 / (2 * np.pi))
    theta1 = np.arctan2(e[:, 1] * np.sin(theta2) - e[:, 0] * np.cos(theta2), -e[:, 2])
    return np.stack([theta1, theta2], axis=-1)


def torch_rotation(travel, work, spin) -> np.ndarray:
    """Return R_p_H = Ry(phi) Rx(eta) Rz(spin), angles in degrees (Zhang et al., eq. 4)."""
    phi = np.arcsin(np.minimum(1.0, np.cos(np.radians(travel)) / np.sin(np.radians(np.abs(work)))))
    return rot("YXZ", phi, np.radians(-(90 + work)), np.radians(spin))


def joints(robot: Robot, R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return joint angles (N, 6) of flange poses in the base frame: front, up, noflip, in the middle of the limits."""
    (a1, a2, a3), d1, d4, d6 = robot.dh[:3, 0], robot.dh[0, 1], robot.dh[3, 1], robot.dh[5, 1]
    x, y, z = (p - d6 * R[..., 2]).T
    out, down, forearm = np.hypot(x, y) - a1, d1 - z, np.hypot(a3, d4)
    bend = np.arccos((out**2 + down**2 - a2**2 - forearm**2) / (2 * a2 * forearm))
    t1, t3 = np.arctan2(y, x), bend - np.arctan2(d4, a3)
    t2 = np.arctan2(down, out) - np.arctan2(forearm * np.sin(bend), a2 + forearm * np.cos(bend))
    right = -np.pi / 2
    R_0_3 = rot("ZX", t1, right) @ rot("ZX", t2 + t3, right)
    wrist = Rotation.from_matrix(R_0_3.swapaxes(1, 2) @ R).as_euler("ZYZ") - [np.pi, 0, np.pi]
    q = np.unwrap(np.column_stack([t1, t2, t3, wrist]) - robot.dh[:, 3], axis=0)
    middle = (q.max(axis=0) + q.min(axis=0)) / 2
    return q - 2 * np.pi * np.round((middle - robot.limits_rad.mean(axis=1)) / (2 * np.pi))


def plan(cell: Cell, at: tuple[float, float], off: float = 0.0, freedom: dict[str, np.ndarray] | None = None) -> Plan:
    """Return the plan of one of the two cells with PB at (x, y) [m], the tilt axis off by an angle [rad].

    What is to be upright is tilted by slope and rotation, written out along tangent, across and up.
    """
    dual, n = cell.name == "dual_welder_positioner", cell.seam.points
    s = np.linspace(0, 1, n) if dual else np.arange(n) / n
    seams = {"main": trough(s, 1), "second": trough(s, -1)} if dual else {"main": flange(s)}
    mount = np.array([0.15, 0, 0.55 + TABLE] if dual else [0.10, 0, 0.05 + TABLE])
    R_T_C = rot("Z", np.pi)
    t, up = seams["main"][1][..., 0], seams["main"][2]
    slope, rotation = ((freedom or {}).get(a, np.zeros(n))[:, None] for a in ("slope", "rotation"))
    level = np.cos(rotation) * up + np.sin(rotation) * np.cross(up, t)
    theta = table_angles(turned(R_T_C, np.cos(slope) * level + np.sin(slope) * t))
    theta[:, 0] += off
    R_W_T = rot("YXZ", theta[:, 0], np.pi, theta[:, 1])
    R_W_C, c = R_W_T @ R_T_C, np.array([*at, HEIGHT]) + turned(R_W_T, mount)
    paths = {"positioner": theta}
    for station in cell.stations:
        p_C, R_C_p, _ = seams[station.coupling.seam]
        held = station.coupling.angles
        travel, work, spin = (
            (freedom or {}).get(f"{a}.{station.name}", np.zeros(n)) for a in ("travel", "work", "spin")
        )
        tilt = held.travel_deg + np.degrees(travel), held.work_deg + np.degrees(work)
        R_W_H = R_W_C @ R_C_p @ torch_rotation(*tilt, held.spin_deg)
        R_W_F = R_W_H @ rot("XZY", np.pi, spin, np.radians(-22))
        flange_W = c + turned(R_W_C, p_C) + 0.003 * R_W_H[..., 2] - 0.40 * R_W_F[..., 2]
        R_B_W = rot("Z", np.radians(90))  # the robots look along -y
        base = np.array(station.base_position_m)
        paths[station.name] = joints(station.robot, R_B_W @ R_W_F, turned(R_B_W, flange_W - base))
    branches = {station.name: BRANCH for station in cell.stations}
    return Plan(cell, np.array([*at, HEIGHT]), s, paths, branches, freedom=freedom)
