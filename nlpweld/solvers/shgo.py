"""Simplicial homology global optimisation on the exact model, through SciPy (Endres, Sandrock and Focke 2018)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import Bounds, shgo
from scipy.stats import qmc

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import population_unsuitable
from nlpweld.solvers.scalar import Scalar


@dataclass(frozen=True)
class Shgo:
    """Triangulates a sample of the box and descends from every vertex that is lower than its neighbours.

    The method itself draws nothing at random; the seed scrambles the Sobol sequence it samples. Descents are Nelder
    and Mead's simplex. Triangulation takes a time that grows exponentially with the number of variables.

    Attributes:
        sample: points of the sample.
        rounds: how often the sample is doubled and triangulated.
        descent: candidates of one descent at most.
        largest: variables at most.
    """

    sample: int = 256
    rounds: int = 1
    descent: int = 400
    largest: int = 6

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"sample": 512}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        if len(nlp.lower) > self.largest:
            return f"{len(nlp.lower)} variables are too many to triangulate (option 'largest' is {self.largest})"
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Sample, triangulate, descend."""
        search = Incumbent(nlp)
        cost, sobol = Scalar(search, budget), qmc.Sobol(len(nlp.lower), rng=np.random.default_rng(seed))

        def minimise() -> str:
            found = shgo(
                cost,
                Bounds(nlp.lower, nlp.upper),
                n=self.sample,
                iters=self.rounds,
                sampling_method=lambda n, d: sobol.random(n),
                minimizer_kwargs={
                    "method": "Nelder-Mead",
                    "bounds": Bounds(nlp.lower, nlp.upper),
                    "options": {"maxfev": self.descent},
                },
            )
            return str(found.message)

        return search.outcome(0.0, cost.run(minimise))
