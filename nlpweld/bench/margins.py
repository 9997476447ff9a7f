"""Margins grown where they were too small: an answer that holds at the seam's points but not between them."""

import numpy as np

from nlpweld.formulation.nlp import Nlp
from nlpweld.verify import Report

ROUNDS = 3  # how often margins are grown and the problem solved again, at most
GROWTH = 1.5  # of what was missed
BETWEEN = ("singularity", "clearance", "joint_limit")


def wider(nlp: Nlp, report: Report) -> Nlp | None:
    """Return the problem with larger margins, or None where they would not help.

    They help an answer whose only violations are levels missed between the points, which solvers do not see.

    Args:
        nlp: the problem; it knows how to take larger margins.
        report: the verifier's, of the answer found.
    """
    if report.feasible or nlp.widened is None:
        return None
    if any(violation.constraint not in BETWEEN for violation in report.violations):
        return None
    missed = dict.fromkeys(BETWEEN, 0.0)
    for violation in report.violations:
        missed[violation.constraint] = max(missed[violation.constraint], abs(violation.value - violation.limit))
    if not np.isfinite(list(missed.values())).all():
        return None
    return nlp.widened({name: GROWTH * amount for name, amount in missed.items()})
