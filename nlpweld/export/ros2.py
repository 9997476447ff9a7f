"""ROS 2: one ``trajectory_msgs/msg/JointTrajectory`` for each robot and for the positioner, all on one clock."""

import json
from typing import Any

from nlpweld.export.moves import Mover, Moves
from nlpweld.export.text import number, rendered

DIGITS = 12  # of radians


def ros2_yaml(moves: Moves) -> dict[str, str]:
    """Return ``<name>.yaml`` by file name, as ``ros2 topic pub`` takes it."""
    return {
        f"{mover.name}.yaml": rendered("joint_trajectory.yaml.j2", message=_message(moves, mover))
        for mover in moves.movers
    }


def ros2_json(moves: Moves) -> dict[str, str]:
    """Return ``<name>.json`` by file name: the same messages."""
    return {f"{mover.name}.json": json.dumps(_message(moves, mover), indent=1) + "\n" for mover in moves.movers}


def joint_names(mover: Mover) -> list[str]:
    """Return what the joints are called: ``<name>_joint_1`` and so on, from the base."""
    return [f"{mover.name}_joint_{k}" for k in range(1, len(mover.robot.joints) + 1)]


def _message(moves: Moves, mover: Mover) -> dict[str, Any]:
    """Return a message as plain data; its stamp is zero, which is to say: begin when it arrives."""
    columns = {"positions": mover.q, "velocities": mover.rate, "accelerations": mover.acceleration}
    points = []
    for k, t_s in enumerate(moves.t_s):
        values = {name: [float(number(x, DIGITS)) for x in rows[k]] for name, rows in columns.items()}
        points.append({**values, "effort": [], "time_from_start": _clock(t_s)})
    stamp = {"sec": 0, "nanosec": 0}
    return {"header": {"stamp": stamp, "frame_id": ""}, "joint_names": joint_names(mover), "points": points}


def _clock(t_s: float) -> dict[str, int]:
    """Return ``builtin_interfaces/Duration``: whole seconds, and nanoseconds beyond."""
    sec, micro = divmod(round(t_s * 1e6), 1_000_000)
    return {"sec": sec, "nanosec": 1000 * micro}
