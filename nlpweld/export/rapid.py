"""ABB RAPID: one module for each robot, of ``MoveAbsJ`` with a time, synchronised by MultiMove where there are several.

A target is ``[[axes 1 to 6], [eax_a to eax_f]]`` in degrees; ``9E9`` stands for an external axis that is not there.
"""

import numpy as np

from nlpweld.export.moves import Moves
from nlpweld.export.text import degrees, head, module_names, refuse_other_arms, rendered

EXTERNAL = 6
LONGEST_NAME = 32


def rapid(moves: Moves) -> dict[str, str]:
    """Return one ``.mod`` for each robot by file name.

    Raises:
        OptionError: a robot does not have six joints.
    """
    refuse_other_arms(moves, "rapid")
    names = module_names(moves, LONGEST_NAME)
    files = {}
    for k, (name, mover) in enumerate(zip(names, moves.robots, strict=True)):
        outer = moves.positioner.q if moves.positioner and k == 0 else np.empty((len(moves.t_s), 0))
        targets = [_target(q, e) for q, e in zip(mover.q, outer, strict=True)]
        files[f"{name}.mod"] = rendered(
            "module.mod.j2", name=name, head=head(moves, mover), tasks=len(names), targets=targets, moves=moves
        )
    return files


def _target(q: np.ndarray, outer: np.ndarray) -> str:
    external = [degrees(angle) for angle in outer] + ["9E9"] * (EXTERNAL - len(outer))
    return f"[[{','.join(degrees(angle) for angle in q)}],[{','.join(external)}]]"
