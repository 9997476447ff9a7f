"""The genetic algorithm of Pan et al. (section 3.3, Fig. 11), through pymoo (Blank and Deb 2020)."""

import time
from dataclasses import dataclass
from typing import ClassVar

from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import Stop, evolve, first_population, population_unsuitable


@dataclass(frozen=True)
class Ga:
    """Selection of the best, crossover, mutation; stops at a generation count or when the mean fitness is still.

    Pan et al. publish none of the settings; population and crossover are MATLAB's defaults, which their figures
    suggest.

    Attributes:
        population: individuals.
        generations: generations at most.
        crossover: probability of crossing two parents (simulated binary crossover).
        crossover_eta: distribution index of the crossover.
        mutation_eta: distribution index of the polynomial mutation.
        mean_change: mean fitness change that counts as still; 0 never stops early.
        still: how many still generations end the run.
        eliminate: drop infeasible individuals, as Pan et al. write, instead of ranking them by how far they miss.
    """

    population: int = 50
    generations: int = 100
    crossover: float = 0.8
    crossover_eta: float = 15.0
    mutation_eta: float = 20.0
    mean_change: float = 0.0
    still: int = 5
    eliminate: bool = False

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {
        "default": {},
        "paper": {"eliminate": True},
        "tuned": {"crossover": 0.9, "crossover_eta": 5.0},
    }

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Evolve one population."""
        search = Incumbent(nlp)
        algorithm = GA(
            pop_size=self.population,
            crossover=SBX(prob=self.crossover, eta=self.crossover_eta),
            mutation=PM(eta=self.mutation_eta),
            **({"sampling": first_population(nlp, seed, self.population)} if nlp.sample else {}),
        )
        build_s = time.perf_counter() - search.started
        stop = Stop(self.generations, self.mean_change, self.still)
        why = evolve(algorithm, search, seed, budget, stop, eliminate=self.eliminate)
        return search.outcome(build_s, why)
