"""All joints in one table, as their controllers show them."""

import csv
import io

import numpy as np

from nlpweld.export.moves import Moves
from nlpweld.export.text import number

DIGITS = 9  # of degrees: 2e-11 rad, far below what closes a chain
KINDS = {"q": "deg", "rate": "deg_s", "acceleration": "deg_s2"}


def joint_csv(moves: Moves) -> dict[str, str]:
    """Return ``joints.csv``: time, seam parameter, whether the arc is on until the next row, then every joint.

    A robot's columns are ``<name>.j1_deg`` and so on, then rates ``_deg_s``, then accelerations ``_deg_s2``.
    """
    names, columns = ["t_s", "s", "arc"], [moves.t_s, moves.s, moves.welding.astype(float)]
    for mover in moves.movers:
        for field, unit in KINDS.items():
            values = np.degrees(getattr(mover, field))
            names += [f"{mover.name}.j{k}_{unit}" for k in range(1, values.shape[1] + 1)]
            columns += list(values.T)
    digits = [6, DIGITS, 0] + [DIGITS] * (len(names) - 3)
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(names)
    for row in zip(*columns, strict=True):
        table.writerow([number(value, count) for value, count in zip(row, digits, strict=True)])
    return {"joints.csv": text.getvalue()}
