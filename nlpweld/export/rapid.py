"""ABB RAPID: one module for each robot, of ``MoveAbsJ`` with a time, synchronised by MultiMove where there are several.

A target is ``[[axes 1 to 6], [eax_a to eax_f]]`` in degrees; ``9E9`` stands for an external axis that is not there.
"""

import numpy as np

from nlpweld.export.moves import Moves
from nlpweld.export.text import degrees, programs, rendered

EXTERNAL = 6
LONGEST_NAME = 32


def rapid(moves: Moves) -> dict[str, str]:
    """Return one ``.mod`` for each robot by file name.

    Raises:
        OptionError: a robot does not have six joints.
    """
    made = programs(moves, "rapid", LONGEST_NAME, _target)
    return {f"{values['name']}.mod": rendered("module.mod.j2", **values) for values in made}


def _target(q: np.ndarray, outer: np.ndarray) -> str:
    external = [degrees(angle) for angle in outer] + ["9E9"] * (EXTERNAL - len(outer))
    return f"[[{','.join(degrees(angle) for angle in q)}],[{','.join(external)}]]"
