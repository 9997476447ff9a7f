"""KUKA KRL: one program for each robot, of spline blocks in axis space whose segments each take a stated time.

A target is ``{A1 .., .., A6 .., E1 .., ..}`` in degrees. The points are in the data list, ``P[1]`` on.
"""

import numpy as np

from nlpweld.export.moves import Moves
from nlpweld.export.text import degrees, head, module_names, refuse_other_arms, rendered

LONGEST_NAME = 24


def krl(moves: Moves) -> dict[str, str]:
    """Return ``.src`` and ``.dat`` for each robot by file name.

    Raises:
        OptionError: a robot does not have six joints.
    """
    refuse_other_arms(moves, "krl")
    names = module_names(moves, LONGEST_NAME)
    files: dict[str, str] = {}
    for k, (name, mover) in enumerate(zip(names, moves.robots, strict=True)):
        outer = moves.positioner.q if moves.positioner and k == 0 else np.empty((len(moves.t_s), 0))
        targets = [_target(q, e) for q, e in zip(mover.q, outer, strict=True)]
        values: dict[str, object] = {
            "name": name,
            "head": head(moves, mover),
            "robots": len(names),
            "targets": targets,
            "moves": moves,
        }
        files |= {f"{name}.{kind}": rendered(f"program.{kind}.j2", **values) for kind in ("src", "dat")}
    return files


def _target(q: np.ndarray, outer: np.ndarray) -> str:
    axes = [("A", k, angle) for k, angle in enumerate(q, start=1)]
    axes += [("E", k, angle) for k, angle in enumerate(outer, start=1)]
    return "{" + ",".join(f"{letter}{k} {degrees(angle)}" for letter, k, angle in axes) + "}"
