"""SLSQP on a penalised relaxation, through SciPy (Kraft 1988: DFVLR-FB 88-28)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import Bounds, minimize

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.solvers.homotopy import Homotopy, Minimiser, Minimum, Watch
from nlpweld.solvers.slopes import Smooth


@dataclass(frozen=True)
class Slsqp(Homotopy):
    """Quasi-Newton solves of ever sharper penalties; see :class:`~.homotopy.Homotopy` for the options they share.

    Each step is a dense least-squares problem in all variables, so that large problems are declined.

    Attributes:
        ftol: change of the value below which a solve ends.
        max_iter: steps per solve.
        largest: variables at most.
    """

    growth: float = 10.0
    ftol: float = 1e-8
    max_iter: int = 100
    largest: int = 400

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"growth": 30.0, "ftol": 1e-6}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        if len(nlp.lower) > self.largest:
            return f"{len(nlp.lower)} variables are too many for its dense steps (option 'largest' is {self.largest})"
        return super().unsuitable(nlp)

    def minimiser(self, nlp: Nlp, relax: Relaxation, watch: Watch) -> Minimiser:
        """Return SLSQP on a relaxation with its own gradient."""
        smooth = Smooth(nlp, relax, watch)
        held = []
        if relax.equalities:
            held = [{"type": "eq", "fun": smooth.closure, "jac": lambda x: smooth.closure_slope(x).toarray()}]

        def minimise(start: np.ndarray, sharpness: float) -> Minimum:
            return smooth.minimise(
                start,
                sharpness,
                lambda x: minimize(
                    smooth.value,
                    x,
                    method="SLSQP",
                    jac=smooth.gradient,
                    bounds=Bounds(nlp.lower, nlp.upper),
                    constraints=held,
                    options={"ftol": self.ftol, "maxiter": self.max_iter},
                ),
            )

        return minimise
