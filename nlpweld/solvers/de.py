"""Differential evolution on the exact model, through pymoo (Storn and Price 1997; Blank and Deb 2020)."""

import time
from dataclasses import dataclass
from typing import ClassVar

from pymoo.algorithms.soo.nonconvex.de import DE

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import Stop, evolve, first_population, population_unsuitable


@dataclass(frozen=True)
class De:
    """Adds differences of individuals to others; violations are ranked as the GA ranks them.

    Attributes:
        population: individuals.
        generations: generations at most.
        variant: how a trial is made, e.g. ``DE/rand/1/bin``.
        crossover: probability of taking a variable from the trial.
        difference: weight of the difference.
    """

    population: int = 50
    generations: int = 100
    variant: str = "DE/rand/1/bin"
    crossover: float = 0.9
    difference: float = 0.8

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {
        "default": {},
        "tuned": {"variant": "DE/best/1/bin", "difference": 0.6},
    }

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Evolve one population."""
        search = Incumbent(nlp)
        algorithm = DE(
            pop_size=self.population,
            sampling=first_population(nlp, seed, self.population),
            variant=self.variant,
            CR=self.crossover,
            F=self.difference,
        )
        build_s = time.perf_counter() - search.started
        why = evolve(algorithm, search, seed, budget, Stop(self.generations), eliminate=False)
        return search.outcome(build_s, why)
