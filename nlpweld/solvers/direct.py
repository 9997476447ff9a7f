"""DIRECT on the exact model, through SciPy (Jones, Perttunen and Stuckman 1993; Gablonsky and Kelley 2001)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import Bounds, direct

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import population_unsuitable
from nlpweld.solvers.scalar import Scalar


@dataclass(frozen=True)
class Direct:
    """Divides the box, ever finer where it promises most.

    The method draws nothing at random. Seed 0 divides the box itself; any other seed divides it shifted by a random
    vector and wrapped at its faces, so that its thirds fall elsewhere and several seeds show how much that matters.

    Attributes:
        candidates: how many when the budget does not say.
        eps: least relative gain that a rectangle must promise; the larger, the more global.
        local: prefer the variant that is biased to the best rectangles.
        weight: of the penalty on violations, exact if it exceeds the constraints' multipliers; 0 puts feasible first,
            which is a cliff where the best place touches a constraint.
    """

    candidates: int = 5000
    eps: float = 1e-4
    local: bool = True
    weight: float = 1.0

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"local": False, "weight": 0.1}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Divide until the candidates are used up."""
        search, n = Incumbent(nlp), len(nlp.lower)
        allowed = budget.evaluations or self.candidates
        cost = Scalar(search, Budget(allowed, budget.time_s), self.weight)
        shift = np.random.default_rng(seed).random(n) if seed else np.zeros(n)
        width = nlp.upper - nlp.lower

        def minimise() -> str:
            found = direct(
                lambda u: cost(nlp.lower + width * ((u + shift) % 1.0)),
                Bounds(np.zeros(n), np.ones(n)),
                eps=self.eps,
                maxfun=2 * allowed,  # the count of candidates ends it
                maxiter=10**6,
                locally_biased=self.local,
                vol_tol=0.0,
                len_tol=1e-9,
            )
            return str(found.message)

        return search.outcome(0.0, cost.run(minimise))
