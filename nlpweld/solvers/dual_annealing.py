"""Generalised simulated annealing on the exact model, through SciPy (Xiang, Sun, Fan and Gong 1997)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import Bounds, dual_annealing

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import population_unsuitable
from nlpweld.solvers.scalar import Scalar


@dataclass(frozen=True)
class DualAnnealing:
    """Long jumps that cool down, one candidate at a time; it can descend from good ones by Nelder and Mead's simplex.

    Attributes:
        candidates: how many when the budget does not say.
        temperature: first temperature; costs differ by three at most.
        visit: how far jumps reach: the larger, the heavier the tail.
        accept: how readily worse candidates are kept: the lower, the less.
        local: descend from good candidates.
        weight: of the penalty on violations, exact if it exceeds the constraints' multipliers; 0 puts feasible first,
            which is a cliff where the best place touches a constraint.
    """

    candidates: int = 5000
    temperature: float = 5230.0
    visit: float = 2.62
    accept: float = -5.0
    local: bool = True
    weight: float = 1.0

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"temperature": 50.0}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Anneal from the seed's first start."""
        search = Incumbent(nlp)
        cost = Scalar(search, Budget(budget.evaluations or self.candidates, budget.time_s), self.weight)

        def minimise() -> str:
            found = dual_annealing(
                cost,
                Bounds(nlp.lower, nlp.upper),
                maxiter=10**6,  # the count of candidates ends it
                maxfun=10**9,
                initial_temp=self.temperature,
                visit=self.visit,
                accept=self.accept,
                no_local_search=not self.local,
                minimizer_kwargs={"method": "Nelder-Mead", "bounds": Bounds(nlp.lower, nlp.upper)},
                x0=nlp.starts(seed, 1)[0],
                rng=np.random.default_rng(seed),
            )
            return str(found.message[0])

        return search.outcome(0.0, cost.run(minimise))
