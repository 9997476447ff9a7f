"""The margins that solvers keep at the seam's points, because levels hold between the points as well."""

import numpy as np

from nlpweld.cell.cell import Cell


def with_margins(cell: Cell, extra: dict[str, float]) -> Cell:
    """Return the cell with larger margins.

    Args:
        cell: the cell.
        extra: what is added to the margins of ``singularity`` [m^3], ``clearance`` [m] and ``joint_limit`` [rad].
    """
    level = cell.constraints
    return cell.with_(
        constraints={
            "singularity_margin_m3": level.singularity_margin_m3 + extra["singularity"],
            "clearance_margin_m": level.clearance_margin_m + extra["clearance"],
            "joint_margin_deg": level.joint_margin_deg + float(np.degrees(extra["joint_limit"])),
        }
    )
