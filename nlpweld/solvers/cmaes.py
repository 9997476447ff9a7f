"""CMA-ES on the exact model, through pycma (Hansen and Ostermeier 2001; restarts after Auger and Hansen 2005)."""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Incumbent, Outcome
from nlpweld.solvers.population import first_population, population_unsuitable
from nlpweld.solvers.scalar import Scalar


@dataclass(frozen=True)
class Cmaes:
    """Samples a normal distribution and learns its shape from the ranks; feasible candidates before infeasible ones.

    Every run begins at the best of a random population; where it has converged, the next one begins with twice the
    candidates a generation.

    Attributes:
        candidates: how many when the budget does not say.
        population: candidates of a generation in the first run; 0 for the usual 4 + 3 log n.
        scouts: random candidates of which a run begins at the best; at most a quarter of all.
        sigma: first standard deviation, as a share of the box.
        growth: factor on the generation from one run to the next.
        largest: variables at most; a full covariance is learnt of all pairs.
    """

    candidates: int = 5000
    population: int = 0
    scouts: int = 50
    sigma: float = 0.2
    growth: int = 2
    largest: int = 400

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"population": 24, "scouts": 250}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        if find_spec("cma") is None:
            return "package 'cma' is not installed"
        if len(nlp.lower) > self.largest:
            return f"{len(nlp.lower)} variables are too many for a covariance (option 'largest' is {self.largest})"
        return population_unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Run again and again until the candidates are used up."""
        search = Incumbent(nlp)
        cost = Scalar(search, Budget(budget.evaluations or self.candidates, budget.time_s))

        def minimise() -> str:
            rng, runs = np.random.default_rng(seed), 0
            scouts = min(self.scouts, 1 + (budget.evaluations or self.candidates) // 4)
            while True:
                self._run(nlp, cost, rng, runs, scouts)
                runs += 1

        return search.outcome(0.0, cost.run(minimise))

    def _run(self, nlp: Nlp, cost: Scalar, rng: np.random.Generator, runs: int, scouts: int) -> None:
        """Sample until the distribution has converged."""
        import cma

        X = first_population(nlp, int(rng.integers(2**31)), scouts)
        width = nlp.upper - nlp.lower
        start = (X[np.argmin(cost.costs(X))] - nlp.lower) / width
        found = cma.CMAEvolutionStrategy(start, self.sigma, self._options(len(start), rng, runs))
        while not found.stop():
            U = found.ask()
            found.tell(U, cost.costs(nlp.lower + width * np.array(U)).tolist())

    def _options(self, n: int, rng: np.random.Generator, runs: int) -> dict[str, Any]:
        """Return pycma's options for a run; nothing is drawn from, or seeds, NumPy's global state."""
        first = self.population or 4 + int(3 * np.log(n))
        return {
            "bounds": [0.0, 1.0],
            "popsize": first * self.growth**runs,
            "seed": np.nan,
            "randn": lambda *size: rng.standard_normal(size),
            "verbose": -9,
            "verb_log": 0,
            "tolfun": 1e-9,
            **({"maxstd": np.inf} if n == 1 else {}),  # pycma cannot hold back a single deviation
        }
