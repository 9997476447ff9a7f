"""The loop all pymoo algorithms share: whole populations per call, a trace per generation, honest stopping."""

from dataclasses import dataclass

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem
from pymoo.problems.static import StaticProblem
from scipy.spatial.distance import pdist

from nlpweld.formulation.nlp import Evaluation, Nlp
from nlpweld.solvers.base import Budget, Incumbent

ELIMINATED = 1e6  # cost of an eliminated individual; any feasible one is better


@dataclass(frozen=True)
class Stop:
    """When to stop beside the budget.

    Attributes:
        generations: generations at most.
        mean_change: change of the feasible individuals' mean objective from one generation to the next below
            which the population counts as still (Pan et al., Fig. 11); 0 never stops early.
        still: how many such generations in a row end the run.
    """

    generations: int
    mean_change: float = 0.0
    still: int = 5


def evolve(algorithm: Algorithm, search: Incumbent, seed: int, budget: Budget, stop: Stop, eliminate: bool) -> str:
    """Run a pymoo algorithm on the exact model until it stops; the incumbent keeps the best and the trace.

    Args:
        algorithm: a fresh pymoo algorithm.
        search: the incumbent, which also evaluates.
        seed: seed of every random draw.
        budget: limits; a generation is never cut in two, so evaluations may end below the limit.
        stop: further stopping rules.
        eliminate: give infeasible individuals the same worst fitness instead of ranking them by violation.

    Returns:
        Why it stopped.
    """
    nlp = search.nlp
    problem = Problem(n_var=len(nlp.lower), n_obj=1, n_ieq_constr=0 if eliminate else 1, xl=nlp.lower, xu=nlp.upper)
    algorithm.setup(problem, seed=seed, verbose=False, termination=("n_gen", stop.generations))
    mean, still = float("nan"), 0
    for _ in range(stop.generations):
        if search.x is not None and search.spent(budget):  # whoever sets out late still brings one answer
            return search.spent(budget)
        brood = algorithm.ask()
        if budget.evaluations is not None and search.evaluations + len(brood) > budget.evaluations:
            return "evaluation limit"
        found = search.evaluate(brood.get("X"))
        Evaluator().eval(_answers(problem, found, eliminate), brood)
        algorithm.tell(infills=brood)
        before, mean = mean, _generation(search, algorithm.pop.get("X"), algorithm.pop.get("F").ravel(), algorithm)
        still = still + 1 if abs(mean - before) < stop.mean_change else 0
        if still >= stop.still:
            return "mean objective still"
    return "generation limit"


def _answers(problem: Problem, found: Evaluation, eliminate: bool) -> StaticProblem:
    """Return the exact model's answers in pymoo's form: F to minimise, G <= 0 when feasible."""
    if eliminate:
        return StaticProblem(problem, F=np.where(found.feasible, -found.objective, ELIMINATED)[:, None])
    cost = np.where(np.isfinite(found.objective), -found.objective, ELIMINATED)
    return StaticProblem(problem, F=cost[:, None], G=found.total[:, None])


def _generation(search: Incumbent, X: np.ndarray, F: np.ndarray, algorithm: Algorithm) -> float:
    """Note a generation in the trace and return the mean objective of its feasible individuals."""
    feasible = (algorithm.pop.get("CV").ravel() <= 0.0) & (F < ELIMINATED)
    mean = float(-F[feasible].mean()) if feasible.any() else float("nan")
    search.note(mean=mean, spread=float(pdist(X).mean()))
    return mean


def first_population(nlp: Nlp, seed: int, count: int) -> np.ndarray:
    """Return individuals to begin with, (count, n): uniform, or where a problem knows good starts, its own.

    Uniform draws of the many variables of a path would jump from point to point and all be infeasible.
    """
    if nlp.sample:
        return nlp.starts(seed, count)
    return np.random.default_rng(seed).uniform(nlp.lower, nlp.upper, (count, len(nlp.lower)))


def population_unsuitable(nlp: Nlp) -> str | None:
    """Return why population solvers cannot take a problem, or None: they take whatever can be evaluated."""
    return None if np.isfinite([nlp.lower, nlp.upper]).all() else "the box is unbounded"
