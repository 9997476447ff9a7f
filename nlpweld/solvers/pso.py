"""Particle swarm on the exact model, through pymoo (Blank and Deb 2020).

Kennedy and Eberhart (1995) describe the swarm, Zhan et al. (2009) how it adapts.
"""

import time
from dataclasses import dataclass
from typing import ClassVar

from pymoo.algorithms.soo.nonconvex.pso import PSO

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import Stop, evolve, first_population, population_unsuitable


@dataclass(frozen=True)
class Pso:
    """Particles drawn to their own best and the swarm's; inertia and pulls adapt to how far the swarm is spread.

    Attributes:
        population: particles.
        generations: generations at most.
        inertia: first inertia.
        own: first pull to a particle's own best.
        social: first pull to the swarm's best.
        velocity: largest velocity, as a share of the box.
        adaptive: let inertia and pulls adapt.
    """

    population: int = 50
    generations: int = 100
    inertia: float = 0.9
    own: float = 2.0
    social: float = 2.0
    velocity: float = 0.2
    adaptive: bool = True

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {
        "default": {},
        "tuned": {"adaptive": False, "inertia": 0.6, "own": 1.5, "social": 1.5},
    }

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Let one swarm fly."""
        search = Incumbent(nlp)
        algorithm = PSO(
            pop_size=self.population,
            sampling=first_population(nlp, seed, self.population),
            w=self.inertia,
            c1=self.own,
            c2=self.social,
            max_velocity_rate=self.velocity,
            adaptive=self.adaptive,
        )
        build_s = time.perf_counter() - search.started
        why = evolve(algorithm, search, seed, budget, Stop(self.generations), eliminate=False)
        return search.outcome(build_s, why)
