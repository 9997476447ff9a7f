"""A trust-region interior-point method on a penalised relaxation, through SciPy (Byrd, Hribar and Nocedal 1999)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.solvers.homotopy import Homotopy, Minimiser, Minimum, Watch
from nlpweld.solvers.slopes import Smooth


@dataclass(frozen=True)
class TrustConstr(Homotopy):
    """Trust-region solves of ever sharper penalties; see :class:`~.homotopy.Homotopy` for the options they share.

    Attributes:
        gtol: tolerance of the slope.
        xtol: trust radius below which a solve ends.
        barrier: first weight of the box's barrier; small, because each solve starts at the last one's answer.
        radius: first trust radius.
        max_iter: steps per solve.
    """

    growth: float = 10.0
    gtol: float = 1e-5
    xtol: float = 1e-7
    barrier: float = 1e-4
    radius: float = 0.1
    max_iter: int = 200

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"gtol": 1e-4}}

    def minimiser(self, nlp: Nlp, relax: Relaxation, watch: Watch) -> Minimiser:
        """Return the method on a relaxation with its own gradient and Hessian."""
        smooth = Smooth(nlp, relax, watch)
        held = []
        if relax.equalities:
            held = [NonlinearConstraint(smooth.closure, 0.0, 0.0, smooth.closure_slope, smooth.closure_curve)]
        options = {
            "gtol": self.gtol,
            "xtol": self.xtol,
            "maxiter": self.max_iter,
            "initial_barrier_parameter": self.barrier,
            "initial_barrier_tolerance": self.barrier,
            "initial_tr_radius": self.radius,
        }
        box = Bounds(nlp.lower, nlp.upper, keep_feasible=True)

        def minimise(start: np.ndarray, sharpness: float) -> Minimum:
            return smooth.minimise(
                start,
                sharpness,
                lambda x: minimize(
                    smooth.value,
                    x,
                    method="trust-constr",
                    jac=smooth.gradient,
                    hess=smooth.hessian,
                    bounds=box,
                    constraints=held,
                    options=options,
                ),
            )

        return minimise
