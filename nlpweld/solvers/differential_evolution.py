"""Differential evolution on the exact model, through SciPy (Storn and Price 1997)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import first_population, population_unsuitable
from nlpweld.solvers.scalar import Scalar


@dataclass(frozen=True)
class DifferentialEvolution:
    """Whole generations at once; feasible candidates before infeasible ones.

    Attributes:
        population: individuals.
        generations: generations at most.
        strategy: how a trial is made, by SciPy's name, e.g. ``best1bin``.
        mutation: least differential weight; it is drawn between this and ``mutation_most``.
        mutation_most: most differential weight.
        recombination: probability of crossing.
    """

    population: int = 50
    generations: int = 100
    strategy: str = "best1bin"
    mutation: float = 0.5
    mutation_most: float = 1.0
    recombination: float = 0.7

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"population": 25, "generations": 200}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Evolve one population."""
        search = Incumbent(nlp)
        cost = Scalar(search, budget)

        def minimise() -> str:
            found = differential_evolution(
                cost.columns,
                Bounds(nlp.lower, nlp.upper),
                strategy=self.strategy,
                maxiter=self.generations - 1,  # the first population is not counted
                mutation=(self.mutation, self.mutation_most),
                recombination=self.recombination,
                init=first_population(nlp, seed, self.population),
                rng=np.random.default_rng(seed),
                tol=0.0,  # spread of the costs at which it ends: none, but their rounding
                atol=1e-12,
                polish=False,
                updating="deferred",
                vectorized=True,
            )
            return str(found.message)

        return search.outcome(0.0, cost.run(minimise))
