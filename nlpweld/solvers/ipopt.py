"""Ipopt on a penalised relaxation, sharpened until the exact model agrees (Waechter and Biegler 2006)."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

import casadi as ca
import numpy as np

from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation
from nlpweld.solvers.base import Budget, Incumbent, Outcome

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
Start = tuple[np.ndarray, int]  # a point and its mode


@dataclass(frozen=True)
class Ipopt:
    """Interior-point solves of ever sharper penalties, each started from the last.

    A descent that ends infeasible (the penalties' own local minimum), or betters no feasible scout, is followed by one
    from the next random start, which is still the same seed's; the message says how many starts it took.

    Attributes:
        sharpness: first sharpness of the soft penalties.
        growth: factor from one sharpening to the next.
        sharpenings: solves of one descent at most.
        settled: relative gain in objective below which a feasible answer is final.
        hopeless: total violation after the third solve above which a descent is given up.
        descents: random starts at most.
        modes_tried: where there are discrete choices, how many are followed, the most promising first; those that a
            sample of the search never met come after all others.
        scouts: random candidates of the exact model, the best of which are started from (and rank the discrete
            choices); 0 starts from the first random point itself.
        tol: Ipopt's tolerance.
        max_iter: Ipopt's iterations per solve.
    """

    sharpness: float = 30.0
    growth: float = 30.0
    sharpenings: int = 6
    settled: float = 1e-3
    hopeless: float = 1e-3
    descents: int = 10
    modes_tried: int = 3
    scouts: int = 256
    tol: float = 1e-4
    max_iter: int = 100

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {
        "default": {},
        "plain": {"scouts": 0, "sharpness": 3.0, "growth": 10.0},
        "full": {"scouts": 0, "growth": 10.0},  # the full-space form brings its starts best first
    }

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return None if nlp.relax else f"formulation '{nlp.formulation}' has no derivatives"

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Descend from random starts in the box until one ends feasible."""
        search = Incumbent(nlp)
        run = _Run(nlp, self, search, budget)
        tried = 0
        groups = self._starts(search, seed, budget)
        scouted = search.objective if search.total == 0.0 else float("-inf")  # which descents are to better
        for group in groups:
            for start, mode in _with_refined(nlp, group):
                tried += 1
                run.descend(start, mode)
                if run.stopped:
                    return search.outcome(run.build_s, f"{run.stopped} in descent {tried}")
            if search.total == 0.0 and search.objective > scouted:
                break
            run.widen()
        seen = f"; {nlp.screen()}" if nlp.screen else ""
        return search.outcome(run.build_s, f"{run.last}; {tried} descents, {run.iterations} iterations{seen}")

    def _starts(self, search: Incumbent, seed: int, budget: Budget) -> list[list[Start]]:
        """Return groups of (start, mode); a group is followed whole, the next only if it brought nothing better."""
        nlp = search.nlp
        if self.scouts == 0 and nlp.n_modes == 1:
            return [[(start, 0)] for start in nlp.starts(seed, self.descents)]
        X = nlp.starts(seed, self.scouts or self.descents)[: budget.evaluations]
        found = search.evaluate(X)
        order = np.lexsort((-found.objective, found.total))
        if nlp.n_modes == 1:
            return [[(X[i], 0)] for i in order[: self.descents]]
        return self._by_mode(nlp, X[order], found.mode[order], np.isfinite(found.objective[order]))

    def _by_mode(self, nlp: Nlp, X: np.ndarray, modes: np.ndarray, seen: np.ndarray) -> list[list[Start]]:
        """Return a start for each mode: scouts (m, n), best first, with their modes and whether these are possible.

        A mode that a sample met but no scout is best on starts from that sample. Modes in doubt come last.
        """
        starts = {int(mode): x for mode, x in zip(modes[::-1], X[::-1], strict=True)}  # the best scout of each
        ranked, doubt = dict.fromkeys(modes.tolist()), np.zeros(nlp.n_modes)
        if nlp.screen:
            screening = nlp.screen()
            met = np.flatnonzero(screening.doubt == 0).tolist()
            starts = {mode: screening.at(mode)[0] for mode in met} | starts
            doubt[:] = screening.doubt
            doubt[modes[seen]] = 0  # scouts are samples, too
        order = sorted(ranked | starts, key=lambda mode: doubt[mode])
        together = min(self.modes_tried, int((doubt[order] == doubt[order[0]]).sum()))
        groups = [order[:together], *([mode] for mode in order[together : self.descents])]
        return [[(starts[mode], mode) for mode in group] for group in groups]


def _with_refined(nlp: Nlp, group: list[Start]) -> Iterator[Start]:
    """Yield starts with their modes, each after what the problem makes of it, if it knows how to better one."""
    for start, mode in group:
        better = nlp.refine(start, mode) if nlp.refine else None
        if better is not None:
            yield better, mode
        yield start, mode


@dataclass(eq=False)
class _Run:
    """What several descents share: built solvers, the clock, the count."""

    nlp: Nlp
    options: Ipopt
    search: Incumbent
    budget: Budget
    build_s: float = 0.0
    iterations: int = 0
    last: str = ""
    stopped: str = ""
    whole: bool = False  # a relaxation may leave constraints out until a descent ends infeasible
    built: dict[int, tuple[ca.Function, "_Watch", Relaxation]] = field(default_factory=dict)  # nlpsol only borrows

    def descend(self, start: np.ndarray, mode: int) -> None:
        """Solve with growing sharpness from one start on one mode."""
        solver = self._solver(mode)
        x, before, sharpness = start, float("-inf"), self.options.sharpness
        for k in range(self.options.sharpenings):
            solution = solver(x0=x, p=sharpness, lbx=self.nlp.lower, ubx=self.nlp.upper, lbg=0.0, ubg=0.0)
            x, sharpness = np.array(solution["x"]).ravel(), sharpness * self.options.growth
            self.iterations += solver.stats()["iter_count"]
            self.last = solver.stats()["return_status"]
            found = self.search.evaluate(np.clip(x, self.nlp.lower, self.nlp.upper)[None])
            self.search.note(x)
            self.search.sharpening.append(_cost(float(solution["f"]), sharpness / self.options.growth, found))
            gain = float(found.objective[0]) - before
            before = float(found.objective[0])
            self.stopped = self.search.spent(self.budget)
            if self.stopped:
                return
            settled = found.feasible[0] and gain < self.options.settled * abs(before)
            if k >= 2 and (settled or found.total[0] > self.options.hopeless):
                return

    def widen(self) -> None:
        """Leave no constraint out from now on."""
        if not self.whole:
            self.whole = True
            self.built.clear()

    def _solver(self, mode: int) -> ca.Function:
        if mode not in self.built:
            began = time.perf_counter()
            assert self.nlp.relax is not None
            relax = self.nlp.relax(mode, self.whole)
            watch = _Watch(self, relax.equalities.value.size1_out(0) if relax.equalities else 0)
            self.built[mode] = (nlpsol(relax, self.options, watch), watch, relax)
            self.build_s += time.perf_counter() - began
        return self.built[mode][0]


def _cost(smooth: float, sharpness: float, found: Evaluation) -> dict[str, float]:
    """Return what soft penalties of a sharpness cost: the smooth objective, to be maximised, against the exact one.

    The smooth one counts MMR in a unit that keeps it of order one and takes the penalties off.
    """
    exact = {"exact": float(found.objective[0]), "missed": float(found.total[0])}
    return {"sharpness": sharpness, "smooth": -smooth, **exact}


class _Watch(ca.Callback):
    """Sees every iterate of Ipopt: keeps the path, and stops when the time is up."""

    def __init__(self, run: _Run, equalities: int = 0) -> None:
        ca.Callback.__init__(self)
        self.run, self.equalities = run, equalities
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        n, m = len(self.run.nlp.lower), self.equalities
        sizes = {"x": n, "f": 1, "g": m, "lam_x": n, "lam_g": m, "lam_p": 1}
        rows = sizes[ca.nlpsol_out(i)]
        return ca.Sparsity.dense(rows) if rows else ca.Sparsity(0, 0)

    def eval(self, arg: list[ca.DM]) -> list[float]:
        self.run.search.evaluations += 1
        self.run.search.note(np.array(arg[0]).ravel())
        return [1.0 if self.run.search.spent(self.run.budget) else 0.0]


def nlpsol(relax: Relaxation, options: Ipopt, watch: ca.Callback) -> ca.Function:
    """Return Ipopt on a relaxation with its own gradient and Hessian; takes the sharpness as its parameter."""
    x, p = ca.MX.sym("x", relax.value.size1_in(0)), ca.MX.sym("p")
    f = relax.value(x, p)
    gradient = ca.Function("nlp_grad_f", [x, p], [f, relax.gradient(x, p)], ["x", "p"], ["f", "grad_f_x"])
    g, held = _equalities(relax, x, p)
    settings = {
        "print_time": False,
        "calc_lam_p": False,
        "no_nlp_grad": True,  # it would differentiate what has derivatives of its own
        "grad_f": gradient,
        "hess_lag": _lagrangian(relax, x, p, g.numel()),
        **held,
        "iteration_callback": watch,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": options.tol,
            "max_iter": options.max_iter,
            **WARM,
            **(EQUAL if relax.equalities else {}),
        },
    }
    return ca.nlpsol("ipopt", "ipopt", {"x": x, "p": p, "f": f, "g": g}, settings)


def _equalities(relax: Relaxation, x: ca.MX, p: ca.MX) -> tuple[ca.MX, dict[str, ca.Function]]:
    """Return the constraints g (m, 1) that are to be zero, none perhaps, and the setting that differentiates them."""
    if relax.equalities is None:
        return ca.MX(0, 1), {}
    g = relax.equalities.value(x)
    jacobian = ca.Function("nlp_jac_g", [x, p], [g, relax.equalities.jacobian(x)], ["x", "p"], ["g", "jac_g_x"])
    return g, {"jac_g": jacobian}


def _lagrangian(relax: Relaxation, x: ca.MX, p: ca.MX, m: int) -> ca.Function:
    """Return the upper triangle of the Hessian of the Lagrangian with m equalities."""
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m)
    if relax.equalities is None:
        hessian = ca.triu(lam_f * relax.hessian(x, p))
    else:
        hessian = relax.equalities.hessian(x, p, lam_f, lam_g)
    names = ["x", "p", "lam_f", "lam_g"]
    return ca.Function("nlp_hess_l", [x, p, lam_f, lam_g], [hessian], names, ["triu_hess_gamma_x_x"])
