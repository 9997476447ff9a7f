"""The exact model as one number, for minimisers that know no constraints; they stop when the budget is spent."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nlpweld.formulation.nlp import Evaluation
from nlpweld.solvers.base import Budget, Incumbent


def costs(found: Evaluation, weight: float = 0.0) -> np.ndarray:
    """Return costs to minimise, shape (m,).

    Without a weight, whatever is feasible comes before whatever is not (Deb 2000): feasible candidates are ranked by
    objective, in (-1, 1), infeasible ones by their total violation, in [1, 2). With one, the cost is the exact penalty
    ``weight * violation - objective`` (Nocedal and Wright 2006, section 17.2), which is continuous wherever both are,
    for methods that compare by how much; candidates without an objective stay in [1, 2). Costs are squeezed by
    ``t / (1 + |t|)``, which keeps their order and needs no number that is larger than all others.

    Args:
        found: what the exact model says.
        weight: of the penalty; 0 for feasible first.
    """
    meant = found.feasible if weight == 0.0 else np.isfinite(found.objective)
    missed = found.total
    return np.where(meant, _squeezed(weight * missed - np.where(meant, found.objective, 0.0)), 1.0 + _squeezed(missed))


def _squeezed(t: np.ndarray) -> np.ndarray:
    return t / (1.0 + np.abs(t))


class Spent(Exception):  # noqa: N818 - not an error: it carries a minimiser out of its loop
    """The budget is spent."""


@dataclass(eq=False)
class Scalar:
    """Costs of candidates; every better one enters the trace.

    Attributes:
        search: evaluates, counts, and keeps the best.
        budget: limits; no candidate is judged beyond them.
        weight: of the exact penalty; 0 for feasible first.
    """

    search: Incumbent
    budget: Budget
    weight: float = 0.0

    def __call__(self, x: np.ndarray) -> float:
        """Return the cost of one candidate x (n,).

        Raises:
            Spent: the budget is spent.
        """
        return float(self.costs(np.asarray(x)[None])[0])

    def columns(self, X: np.ndarray) -> np.ndarray:
        """Return the costs (m,) of candidates that are columns, X (n, m), as SciPy has them."""
        return self.costs(X.T)

    def costs(self, X: np.ndarray) -> np.ndarray:
        """Return the costs (m,) of candidates X (m, n); m of them are a generation, which is never cut in two.

        Raises:
            Spent: the budget is spent, or the generation would exceed it.
        """
        search = self.search
        if search.x is not None and search.spent(self.budget):  # whoever sets out late still brings one answer
            raise Spent(search.spent(self.budget))
        if self.budget.evaluations is not None and search.evaluations + len(X) > self.budget.evaluations:
            raise Spent("evaluation limit")
        before = search.total, -search.objective
        cost = costs(search.evaluate(np.clip(X, search.nlp.lower, search.nlp.upper)), self.weight)
        if (search.total, -search.objective) < before:
            search.note()
        return cost

    def run(self, minimise: Callable[[], str]) -> str:
        """Run a minimiser of these costs and return why it ended."""
        try:
            return minimise()
        except Spent as why:
            return str(why)
