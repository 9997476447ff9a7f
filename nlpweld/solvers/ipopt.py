"""Ipopt on a penalised relaxation, sharpened until the exact model agrees (Waechter and Biegler 2006)."""

import time
from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.solvers.base import Budget, Incumbent, Outcome


@dataclass(frozen=True)
class Ipopt:
    """Interior-point solves of ever sharper penalties, each started from the last.

    Attributes:
        sharpness: first sharpness of the soft penalties.
        growth: factor from one sharpening to the next.
        sharpenings: how many solves at most.
        settled: relative gain in objective below which a feasible answer is final.
        tol: Ipopt's tolerance.
        max_iter: Ipopt's iterations per solve.
        modes_tried: discrete choices solved from the start, most promising first.
    """

    sharpness: float = 10.0
    growth: float = 4.0
    sharpenings: int = 8
    settled: float = 1e-5
    tol: float = 1e-8
    max_iter: int = 100
    modes_tried: int = 1

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return None if nlp.relax else f"formulation '{nlp.formulation}' has no derivatives"

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Solve from one random start in the box."""
        search = Incumbent(nlp)
        start = nlp.starts(seed, 1)[0]
        mode = int(search.evaluate(start[None]).mode[0])
        began = time.perf_counter()
        relax = nlp.relax(mode)
        solver = _nlpsol(relax, self)
        build_s = time.perf_counter() - began
        x, message = start, ""

        for k in range(self.sharpenings):
            a=self.sharpness*self.growth**k
            t=time.perf_counter()
            r=solver(x0=x,p=a,lbx=nlp.lower,ubx=nlp.upper)
            st=solver.stats()
            x=np.array(r["x"]).ravel()
            e=search.evaluate(x[None])
            search.log=getattr(search,"log",[])+[(a,st["iter_count"],x.round(4).tolist(),round(float(e.objective[0]),5),e.violation.round(5).tolist())]
        return search.outcome(build_s,message)


def _nlpsol(relax: Relaxation, options: Ipopt) -> ca.Function:
    """Build Ipopt with the relaxation's own gradient and Hessian."""
    x, p = ca.MX.sym("x", relax.value.size1_in(0)), ca.MX.sym("p")
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 0)
    f = relax.value(x, p)
    grad = ca.Function("nlp_grad_f", [x, p], [f, relax.gradient(x, p)], ["x", "p"], ["f", "grad_f_x"])
    hess = ca.Function(
        "nlp_hess_l", [x, p, lam_f, lam_g], [ca.triu(lam_f * relax.hessian(x, p))],
        ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"],
    )
    settings = {
        "print_time": False, "grad_f": grad, "hess_lag": hess,
        "ipopt": {"print_level": 0, "sb": "yes", "tol": options.tol, "max_iter": options.max_iter},
    }
    return ca.nlpsol("ipopt", "ipopt", {"x": x, "p": p, "f": f}, settings)
