"""CasADi's nlpsol plugins as inner minimisers, with a relaxation's own derivatives (Andersson et al. 2019)."""

from typing import Any

import casadi as ca
import numpy as np

from nlpweld.formulation.nlp import Nlp, Relaxation
from nlpweld.solvers.homotopy import Minimum, Watch


class Nlpsol:
    """A plugin on one relaxation; called with a start and a sharpness.

    Args:
        plugin: name of the plugin.
        nlp: the problem, for its box.
        relax: what to minimise.
        watch: sees every iterate.
        settings: the plugin's settings, those that hand it derivatives included.
    """

    def __init__(self, plugin: str, nlp: Nlp, relax: Relaxation, watch: Watch, settings: dict[str, Any]) -> None:
        """Build the plugin on the relaxation."""
        self.box = {"lbx": nlp.lower, "ubx": nlp.upper, "lbg": 0.0, "ubg": 0.0}
        self.held = relax  # CasADi only borrows the functions, and the callback
        self.watch = _Watch(watch, len(nlp.lower), relax.equalities.value.size1_out(0) if relax.equalities else 0)
        x, p, f, g = symbols(relax)
        settings = {
            "print_time": False,
            "calc_lam_p": False,
            "no_nlp_grad": True,  # it would differentiate what has derivatives of its own
            "iteration_callback": self.watch,
            **settings,
        }
        self.solver = ca.nlpsol(plugin, plugin, {"x": x, "p": p, "f": f, "g": g}, settings)

    def __call__(self, start: np.ndarray, sharpness: float) -> Minimum:
        """Minimise from a start (n,) at a sharpness."""
        solution = self.solver(x0=start, p=sharpness, **self.box)
        x = np.array(solution["x"]).ravel()
        return Minimum(x, float(solution["f"]), *self._said())

    def _said(self) -> tuple[int, str]:
        """Return iterations and the plugin's last word; sqpmethod has none where a quadratic program fails."""
        try:
            stats = self.solver.stats()
        except RuntimeError:
            return 0, "stopped without a word"
        return int(stats["iter_count"]), stats["return_status"]


def symbols(relax: Relaxation) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX]:
    """Return variables x (n, 1), sharpness p, value f and constraints g (m, 1) to be zero, none perhaps."""
    x, p = ca.MX.sym("x", relax.value.size1_in(0)), ca.MX.sym("p")
    return x, p, relax.value(x, p), relax.equalities.value(x) if relax.equalities else ca.MX(0, 1)


def jacobian(relax: Relaxation, x: ca.MX) -> ca.MX:
    """Return the Jacobian of the constraints, (m, n)."""
    return relax.equalities.jacobian(x) if relax.equalities else ca.MX(0, x.numel())


def lagrangian(relax: Relaxation, upper: bool) -> ca.Function:
    """Return the Hessian of the Lagrangian in CasADi's order, its upper triangle or the whole."""
    x, p, _, g = symbols(relax)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.numel())
    if relax.equalities is None:
        hessian = lam_f * relax.hessian(x, p)
        hessian = ca.triu(hessian) if upper else hessian
    else:
        hessian = relax.equalities.hessian(x, p, lam_f, lam_g)
        hessian = hessian if upper else ca.triu2symm(hessian)
    names = ["x", "p", "lam_f", "lam_g"]
    out = "triu_hess_gamma_x_x" if upper else "hess_gamma_x_x"
    return ca.Function("nlp_hess_l", [x, p, lam_f, lam_g], [hessian], names, [out])


class _Watch(ca.Callback):
    """Shows every iterate to a watch, and stops the plugin when that says so."""

    def __init__(self, watch: Watch, n: int, equalities: int) -> None:
        ca.Callback.__init__(self)
        self.watch, self.n, self.equalities = watch, n, equalities
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        n, m = self.n, self.equalities
        rows = {"x": n, "f": 1, "g": m, "lam_x": n, "lam_g": m, "lam_p": 1}[ca.nlpsol_out(i)]
        return ca.Sparsity.dense(rows) if rows else ca.Sparsity(0, 0)

    def eval(self, arg: list[ca.DM]) -> list[float]:
        return [1.0 if self.watch(np.array(arg[0]).ravel()) else 0.0]
