"""The answers a run held on its way, verified after it ended, so that a curve of quality over time can be believed."""

import numpy as np

from nlpweld.bench.answer import Answer, evaluate_plan
from nlpweld.formulation.nlp import Nlp
from nlpweld.records.model import Held
from nlpweld.solvers.base import Improvement, Outcome

MOST = 4  # answers looked at, the last included; verifying one takes a fraction of a second


def held_answers(nlp: Nlp, answer: Answer) -> list[Held]:
    """Return answers a run held, oldest first, each with the verifier's word; the last is the run's own answer.

    Where there are many, those looked at are the first and what was held at times spread evenly in their logarithm.
    What lies between counts as not held, so times to a target read from these are never too early.
    """
    outcome, found = answer.outcome, []
    for step in chosen(outcome):
        report = evaluate_plan(nlp, step.x, step.mode)[1]
        objective = report.objective if report.samples else None
        found.append(_held(step.time_s, step.evaluations, step.objective, objective, report.feasible))
    if answer.report is not None and np.isfinite(outcome.objective):
        end = outcome.build_s + outcome.solve_s
        objective = answer.report.objective if answer.plan else None
        found.append(_held(end, outcome.evaluations, outcome.objective, objective, answer.verified))
    return found


def chosen(outcome: Outcome, most: int = MOST) -> list[Improvement]:
    """Return the improvements to look at, at most one less than a number, without the final answer."""
    steps = outcome.improvements[:-1]
    if len(steps) < most:
        return list(steps)
    times = np.array([step.time_s for step in steps])
    wanted = np.geomspace(max(times[0], 1e-3), times[-1], most - 1)
    index = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(steps) - 1)
    return [steps[i] for i in dict.fromkeys(index.tolist())]


def _held(time_s: float, evaluations: int, claimed: float, objective: float | None, verified: bool) -> Held:
    value = None if objective is None or not np.isfinite(objective) else float(objective)
    return Held(time_s=time_s, evaluations=evaluations, claimed=float(claimed), objective=value, verified=verified)
