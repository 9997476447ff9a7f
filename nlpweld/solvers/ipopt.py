"""Ipopt on a penalised relaxation, sharpened until the exact model agrees (Waechter and Biegler 2006)."""

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.solvers.homotopy import Homotopy, Minimiser, Watch
from nlpweld.solvers.nlpsol import Nlpsol, jacobian, lagrangian, symbols

# Each solve starts at the last one's answer, so the barrier of the box starts small and does not push it away.
WARM = {"mu_init": 1e-6, "bound_push": 1e-6, "bound_frac": 1e-6}
# With equalities the slope of the objective is spread over many variables and looks small beside the tolerance, so it
# is scaled up. Ipopt's filter would trade much of the objective for violations that do not matter; a merit does not.
EQUAL = {
    "constr_viol_tol": 1e-9,
    "obj_scaling_factor": 1e3,
    "line_search_method": "penalty",
    "watchdog_shortened_iter_trigger": 0,  # which that line search does not know
}


@dataclass(frozen=True)
class Ipopt(Homotopy):
    """Interior-point solves of ever sharper penalties; see :class:`~.homotopy.Homotopy` for the options they share.

    Attributes:
        tol: Ipopt's tolerance.
        max_iter: Ipopt's iterations per solve.
    """

    tol: float = 1e-4
    max_iter: int = 100

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {
        "default": {},
        "plain": {"scouts": 0, "sharpness": 3.0, "growth": 10.0},
        "full": {"scouts": 0, "growth": 10.0},  # the full-space form brings its starts best first
        "tuned": {"scouts": 128, "tol": 1e-3},
    }

    def minimiser(self, nlp: Nlp, relax: Relaxation, watch: Watch) -> Minimiser:
        """Return Ipopt on a relaxation with its own gradient and Hessian."""
        x, p, f, g = symbols(relax)
        settings = {
            "grad_f": ca.Function("nlp_grad_f", [x, p], [f, relax.gradient(x, p)], ["x", "p"], ["f", "grad_f_x"]),
            "hess_lag": lagrangian(relax, upper=True),
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "tol": self.tol,
                "max_iter": self.max_iter,
                **WARM,
                **(EQUAL if relax.equalities else {}),
            },
        }
        if relax.equalities:
            names = ["x", "p"], ["g", "jac_g_x"]
            settings["jac_g"] = ca.Function("nlp_jac_g", [x, p], [g, jacobian(relax, x)], *names)
        return Nlpsol("ipopt", nlp, relax, watch, settings)
