"""Random search, the null baseline: uniform candidates, the best feasible one kept."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import population_unsuitable


@dataclass(frozen=True)
class RandomSearch:
    """Uniform candidates in the box.

    Attributes:
        candidates: how many when the budget does not say.
        batch: candidates per call of the exact model.
    """

    candidates: int = 5000
    batch: int = 100

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Draw candidates until the budget is spent."""
        search, rng = Incumbent(nlp), np.random.default_rng(seed)
        wanted = self.candidates if budget.evaluations is None else budget.evaluations
        while search.evaluations < wanted and search.spent(budget) != "time limit":
            count = min(self.batch, wanted - search.evaluations)
            search.evaluate(rng.uniform(nlp.lower, nlp.upper, (count, len(nlp.lower))))
            search.note()
        return search.outcome(0.0, "time limit" if search.evaluations < wanted else "all candidates drawn")
