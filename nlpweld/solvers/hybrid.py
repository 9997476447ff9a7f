"""Population first, derivatives after: a short differential evolution of the exact model, then Ipopt from its best.

The population (Storn and Price 1997) finds the valleys that penalties would hide, Ipopt (Waechter and Biegler 2006) the
bottom of the best few of them. Such memetic pairs are reviewed by Neri and Cotta (2012).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pymoo.algorithms.soo.nonconvex.de import DE

from nlpweld.formulation.nlp import Evaluation, Nlp
from nlpweld.solvers.base import Budget, Incumbent
from nlpweld.solvers.homotopy import Start
from nlpweld.solvers.ipopt import Ipopt
from nlpweld.solvers.population import Stop, evolve, population_unsuitable


@dataclass(frozen=True)
class Hybrid(Ipopt):
    """Scouts of the whole box, some generations of the best of them, and descents from the best few that differ.

    See :class:`~.homotopy.Homotopy` for what Ipopt's descents take. Where there are discrete choices, the best of each
    is followed. At most half of a budget goes into the population.

    Attributes:
        population: individuals: the best scouts.
        generations: generations they evolve.
        polished: descents that are followed in any case; the others only where these bring nothing.
        apart: how far the starts of descents lie from each other, as a share of the box.
    """

    population: int = 24
    generations: int = 10
    polished: int = 2
    apart: float = 0.05

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"polished": 1, "generations": 5}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return super().unsuitable(nlp) or population_unsuitable(nlp)

    def starts(self, search: Incumbent, seed: int, budget: Budget) -> list[list[Start]]:
        """Return the best few individuals that differ as one group, and others one by one."""
        half = Budget(
            None if budget.evaluations is None else budget.evaluations // 2,
            None if budget.time_s is None else budget.time_s / 2,
        )
        X = search.nlp.starts(seed, max(self.scouts, self.population))[: half.evaluations]
        found = search.evaluate(X)
        search.note()
        if not search.spent(half):
            evolved = self._evolved(search, X[_order(found)[: self.population]], seed, half)
            again = search.evaluate(evolved)
            X, found = np.vstack([evolved, X]), _joined(again, found)
        if search.nlp.n_modes > 1:
            return self.ranked(X, found, search.nlp)
        starts = [(x, 0) for x in self._differing(X[_order(found)], search.nlp)]
        return [starts[: self.polished], *([start] for start in starts[self.polished :])]

    def _evolved(self, search: Incumbent, X: np.ndarray, seed: int, budget: Budget) -> np.ndarray:
        """Return individuals X (m, n) after some generations."""
        algorithm = DE(pop_size=len(X), sampling=X, variant="DE/best/1/bin", CR=0.9, F=0.5)
        evolve(algorithm, search, seed, budget, Stop(self.generations), eliminate=False)
        return X if algorithm.pop is None else algorithm.pop.get("X")

    def _differing(self, X: np.ndarray, nlp: Nlp) -> list[np.ndarray]:
        """Return the first of candidates X (m, n) that lie apart from each other, as many as there may be descents."""
        kept: list[np.ndarray] = []
        for x in X:
            near = (np.abs((x - other) / (nlp.upper - nlp.lower)).max() < self.apart for other in kept)
            if not any(near):
                kept.append(x)
        return kept[: self.descents]


def _order(found: Evaluation) -> np.ndarray:
    """Return indices from the best candidate to the worst, feasible before infeasible."""
    return np.lexsort((-found.objective, found.total))


def _joined(a: Evaluation, b: Evaluation) -> Evaluation:
    """Return two evaluations as one."""
    return Evaluation(*(np.concatenate([getattr(e, f) for e in (a, b)]) for f in ("objective", "violation", "mode")))
