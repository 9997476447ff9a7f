"""What the controllers do: gains of the servos, and the control signal that follows a planned motion."""

from typing import Any

import numpy as np

from nlpweld.cell import Cell
from nlpweld.errors import OptionError
from nlpweld.sim.mj import mujoco
from nlpweld.sim.model import Gains, joint_total
from nlpweld.sim.options import FEED_FORWARD, Servos
from nlpweld.sim.planned import planned
from nlpweld.timeline import Timeline


def servo_gains(cell: Cell, controllers: Any, q: np.ndarray, servos: Servos) -> Gains:
    """Return gains that give every joint by itself the stated frequency and damping in one posture.

    Args:
        cell: the cell.
        controllers: its :func:`~nlpweld.sim.model.open_model`.
        q: the posture, shape (n,) [rad].
        servos: frequency and damping.
    """
    mj, data = mujoco(), mujoco().MjData(controllers)
    data.qpos[:] = q
    mj.mj_forward(controllers, data)
    n = joint_total(cell)
    M = np.zeros((n, n))
    mj.mj_fullM(controllers, data, M)
    inertia, omega = M.diagonal(), 2 * np.pi * servos.frequency_hz
    return Gains(omega**2 * inertia, 2 * servos.damping_ratio * omega * inertia)


def control_signal(
    cell: Cell, timeline: Timeline, t_s: np.ndarray, controllers: Any, gains: Gains, servos: Servos
) -> np.ndarray:
    """Return what position servos are told at instants (K,), shape (K, n) [rad].

    MuJoCo's position servo gives ``kp (u - q) - kv q'``; with ``u = q_d + (kv q_d' + feed-forward) / kp`` that is a
    servo on angle and rate with a torque added.

    Raises:
        OptionError: there is no such feed-forward.
    """
    if servos.feed_forward not in FEED_FORWARD:
        raise OptionError(f"feed-forward '{servos.feed_forward}' is unknown. There are: {', '.join(FEED_FORWARD)}")
    q = planned(cell, timeline, t_s)
    if servos.feed_forward == "none":
        return q
    rate = planned(cell, timeline, t_s, 1)
    torque = np.zeros_like(q)
    if servos.feed_forward == "gravity":
        torque = inverse_dynamics(controllers, q, np.zeros_like(q), np.zeros_like(q))
    elif servos.feed_forward == "torque":
        torque = inverse_dynamics(controllers, q, rate, planned(cell, timeline, t_s, 2))
    return q + (gains.kv * rate + (1 + servos.model_error) * torque) / gains.kp


def inverse_dynamics(controllers: Any, q: np.ndarray, rate: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Return the joint torques of a motion of open chains, each argument and the answer of shape (K, n) [N m]."""
    mj, data = mujoco(), mujoco().MjData(controllers)
    torque = np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], rate[k], acceleration[k]
        mj.mj_inverse(controllers, data)
        torque[k] = data.qfrc_inverse
    return torque
