"""NSGA-II (Deb et al. 2002), through pymoo, on the exact model with a second value besides the objective."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.optimize import minimize

from nlpweld.formulation.nlp import Nlp
from nlpweld.pareto.limited import Second

WORST = 1e6  # of infeasible candidates, which rank by what they miss


class _Pair(Problem):
    """Minus objective and minus second value; what a candidate misses is a constraint."""

    def __init__(self, nlp: Nlp, second: Second) -> None:
        super().__init__(n_var=len(nlp.lower), n_obj=2, n_ieq_constr=1, xl=nlp.lower, xu=nlp.upper)
        self.nlp, self.second = nlp, second

    def _evaluate(self, X: np.ndarray, out: dict[str, Any], *args: object, **kwargs: object) -> None:
        found = self.nlp.evaluate(X)
        F, good = np.full((len(X), 2), WORST), found.feasible
        if good.any():
            F[good] = -np.column_stack([found.objective[good], self.second(X[good], found.mode[good])])
        out["F"], out["G"] = F, found.total[:, None]


def nsga(
    nlp: Nlp,
    second: Second,
    population: int = 40,
    generations: int = 50,
    seed: int = 0,
    told: Callable[[], object] | None = None,
) -> np.ndarray:
    """Return the candidates of the last generation that are feasible and that no other of them dominates.

    Crossover and mutation are those of Deb et al. (2002): simulated binary and polynomial.

    Args:
        nlp: the problem.
        second: the value to be maximised besides its objective, asked of feasible candidates alone.
        population: individuals.
        generations: generations.
        seed: of every random draw; the same seed, the same candidates.
        told: called after every generation.

    Returns:
        candidates, shape (m, n); none where nothing feasible was met.
    """
    algorithm = NSGA2(pop_size=population, crossover=SBX(prob=0.9, eta=15), mutation=PM(eta=20))
    pair, stop = _Pair(nlp, second), ("n_gen", generations)
    found = minimize(pair, algorithm, stop, seed=seed, verbose=False, callback=lambda _: told() if told else None)
    return np.empty((0, len(nlp.lower))) if found.X is None else np.atleast_2d(found.X)
