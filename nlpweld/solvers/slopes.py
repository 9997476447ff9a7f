"""A relaxation as SciPy's minimisers ask for it: callables on arrays, which stop when the budget is spent."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import OptimizeResult

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.solvers.homotopy import Minimum, Watch


class Stopped(Exception):  # noqa: N818 - not an error: it carries a minimiser out of its loop
    """The budget is spent."""


@dataclass(eq=False)
class Smooth:
    """Value, gradient and Hessian of a relaxation at one sharpness; counts every value.

    Attributes:
        nlp: the problem, for its box.
        relax: what to minimise.
        watch: sees every point whose value is asked for.
        sharpness: of the solve under way.
        at: the last accepted iterate: minimisers ask only there for a gradient.
    """

    nlp: Nlp
    relax: Relaxation
    watch: Watch
    sharpness: float = 0.0
    at: np.ndarray = field(default_factory=lambda: np.empty(0))

    def value(self, x: np.ndarray) -> float:
        """Return the value at x (n,).

        Raises:
            Stopped: the budget is spent.
        """
        if self.watch(x):
            raise Stopped
        return float(self.relax.value(x, self.sharpness))

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Return the gradient at x, shape (n,)."""
        self.at = np.array(x)
        return np.array(self.relax.gradient(x, self.sharpness)).ravel()

    def hessian(self, x: np.ndarray) -> Any:
        """Return the Hessian at x, shape (n, n), sparse where it is large."""
        found = self.relax.hessian(x, self.sharpness)
        return np.array(found) if found.is_dense() else found.sparse().tocsc()

    def minimise(self, start: np.ndarray, sharpness: float, run: Callable[[np.ndarray], OptimizeResult]) -> Minimum:
        """Return where a minimiser ends that is run from a start (n,) at a sharpness."""
        self.sharpness, self.at = sharpness, np.clip(start, self.nlp.lower, self.nlp.upper)
        try:
            found = run(self.at)
        except Stopped:
            return Minimum(self.at, float(self.relax.value(self.at, sharpness)), 0, "stopped")
        return Minimum(np.array(found.x), float(found.fun), int(found.nit), str(found.message))

    def closure(self, x: np.ndarray) -> np.ndarray:
        """Return what the equalities miss at x, shape (m,)."""
        assert self.relax.equalities is not None
        return np.array(self.relax.equalities.value(x)).ravel()

    def closure_slope(self, x: np.ndarray) -> Any:
        """Return the sparse Jacobian of the equalities at x, shape (m, n)."""
        assert self.relax.equalities is not None
        return ca.DM(self.relax.equalities.jacobian(x)).sparse().tocsc()

    def closure_curve(self, x: np.ndarray, multipliers: np.ndarray) -> Any:
        """Return the sparse Hessian of the equalities times their multipliers (m,), shape (n, n)."""
        assert self.relax.equalities is not None
        upper = self.relax.equalities.hessian(x, self.sharpness, 0.0, multipliers)
        return ca.triu2symm(upper).sparse().tocsc()
