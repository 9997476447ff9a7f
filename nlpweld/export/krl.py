"""KUKA KRL: one program for each robot, of spline blocks in axis space whose segments each take a stated time.

A target is ``{A1 .., .., A6 .., E1 .., ..}`` in degrees. The points are in the data list, ``P[1]`` on.
"""

import numpy as np

from nlpweld.export.moves import Moves
from nlpweld.export.text import degrees, programs, rendered

LONGEST_NAME = 24


def krl(moves: Moves) -> dict[str, str]:
    """Return ``.src`` and ``.dat`` for each robot by file name.

    Raises:
        OptionError: a robot does not have six joints.
    """
    made = programs(moves, "krl", LONGEST_NAME, _target)
    return {
        f"{values['name']}.{kind}": rendered(f"program.{kind}.j2", **values)
        for values in made
        for kind in ("src", "dat")
    }


def _target(q: np.ndarray, outer: np.ndarray) -> str:
    axes = [("A", k, angle) for k, angle in enumerate(q, start=1)]
    axes += [("E", k, angle) for k, angle in enumerate(outer, start=1)]
    return "{" + ",".join(f"{letter}{k} {degrees(angle)}" for letter, k, angle in axes) + "}"
