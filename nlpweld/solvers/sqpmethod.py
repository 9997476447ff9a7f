"""Sequential quadratic programming on a penalised relaxation, through CasADi (Andersson et al. 2019).

Nocedal and Wright (2006, chapter 18) describe the method: exact Hessians made convex, a line search on the l1 merit,
and a quadratic program each step, which one of several plugins solves.
"""

from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from typing import Any, ClassVar

import casadi as ca

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.solvers.homotopy import Homotopy, Minimiser, Watch
from nlpweld.solvers.nlpsol import Nlpsol, jacobian, lagrangian, symbols

# What keeps a plugin silent, and brings it to a precision that the steps need.
QP: dict[str, dict[str, Any]] = {
    "qrqp": {"print_iter": False, "print_header": False},
    "osqp": {"osqp": {"verbose": False, "eps_abs": 1e-8, "eps_rel": 1e-8, "max_iter": 20_000}},
    "qpoases": {"printLevel": "none"},
    "highs": {"highs": {"output_flag": False}},
    "daqp": {},
    "proxqp": {"proxqp": {"eps_abs": 1e-8}},
    "piqp": {},
}


@dataclass(frozen=True)
class Sqpmethod(Homotopy):
    """SQP solves of ever sharper penalties; see :class:`~.homotopy.Homotopy` for the options they share.

    Attributes:
        qp: the QP plugin: ``qrqp``, ``osqp``, ``qpoases``, ``highs``, ``daqp``, ``proxqp`` or ``piqp``.
        tol: tolerance of the slope.
        max_iter: steps per solve.
        line_search: halvings of a step at most.
    """

    growth: float = 10.0
    qp: str = "qrqp"
    tol: float = 1e-4
    max_iter: int = 100
    line_search: int = 20

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {
        "default": {},
        "tuned": {"qp": "daqp"},
        "osqp": {"qp": "osqp"},
        "qpoases": {"qp": "qpoases"},
        "full": {"qp": "osqp", "scouts": 0},  # the full-space form brings its starts best first
    }

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        there = [qp for qp in QP if ca.has_conic(qp)]
        if self.qp not in there:
            return f"CasADi has no QP plugin '{self.qp}' here that is known to serve; there are: {', '.join(there)}"
        return super().unsuitable(nlp)

    def minimiser(self, nlp: Nlp, relax: Relaxation, watch: Watch) -> Minimiser:
        """Return the method on a relaxation with its own gradient and Hessian."""
        x, p, f, g = symbols(relax)
        slopes = [f, relax.gradient(x, p), g, jacobian(relax, x)]
        settings = {
            "jac_fg": ca.Function("nlp_jac_fg", [x, p], slopes, ["x", "p"], ["f", "grad_f_x", "g", "jac_g_x"]),
            "hess_lag": lagrangian(relax, upper=False),
            "qpsol": self.qp,
            "qpsol_options": {"error_on_fail": False, **QP[self.qp]},
            # clipping takes every eigenvalue, which is much for the one great block of the full-space form
            "convexify_strategy": "regularize" if relax.equalities else "eigen-clip",
            "max_iter_eig": 1000,
            "tol_du": self.tol,
            "tol_pr": 1e-9,
            "max_iter": self.max_iter,
            "beta": 0.5,
            "max_iter_ls": self.line_search,
            "min_step_size": 1e-12,
            "error_on_fail": False,
            "print_header": False,
            "print_iteration": False,
            "print_status": False,
        }
        with redirect_stdout(StringIO()):  # qpOASES greets on standard output, which may be somebody's JSON
            return Nlpsol("sqpmethod", nlp, relax, watch, settings)
