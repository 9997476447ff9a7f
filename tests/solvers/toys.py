"""Small problems with known answers, as solvers see them."""

import os
import signal
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np

from nlpweld.formulation.branches import Screening
from nlpweld.formulation.nlp import Equalities, Evaluation, Nlp, Relaxation, sobol

PEAK = np.array([0.3, -0.2])


def disc(radius: float = 0.5, peak: np.ndarray = PEAK, centre: tuple[float, float] = (-0.2, -0.2)) -> Nlp:
    """Maximise -|x - peak|^2 within a disc; with radius < 0 nothing is feasible."""
    middle = np.array(centre)

    def evaluate(X: np.ndarray) -> Evaluation:
        outside = np.maximum(0.0, np.linalg.norm(X - middle, axis=1) - radius)
        objective = -((X - peak) ** 2).sum(axis=1)
        return Evaluation(objective, outside[:, None], np.zeros(len(X), dtype=int))

    def relax(mode: int, whole: bool) -> Relaxation:
        x, sharpness = ca.SX.sym("x", 2), ca.SX.sym("sharpness")
        miss = sharpness * (ca.sqrt(ca.sumsqr(x - middle) + 1e-12) - radius)
        value = ca.sumsqr(x - peak) + 3 * (ca.fmax(miss, 0) + ca.log1p(ca.exp(-ca.fabs(miss)))) / sharpness
        hessian, gradient = ca.hessian(value, x)
        functions = [
            ca.Function(name, [x, sharpness], [out])
            for name, out in zip("vgh", [value, gradient, hessian], strict=True)
        ]
        return Relaxation(*functions)

    box = np.ones(2)
    return Nlp("disc", "toy", ("x", "y"), -box, box, ("disc",), evaluate, relax=relax)


def optimum(nlp_radius: float, peak: np.ndarray = PEAK, centre: tuple[float, float] = (-0.2, -0.2)) -> np.ndarray:
    """The point of the disc nearest to the peak."""
    step = peak - np.array(centre)
    return np.array(centre) + step * min(1.0, nlp_radius / np.linalg.norm(step))


def ripples(
    radius: float = 2.0, slow_s: float = 0.0, deadly: int | None = None, wrong: int | None = None, seen: str = ""
) -> Nlp:
    """Maximise waves on a hill, nine of them within the box; the best is at (0, 0) and worth 1.

    Args:
        radius: of the disc; negative, nothing is feasible.
        slow_s: how long a candidate takes [s].
        deadly: the seed of starts that kills the process.
        wrong: the seed of starts that raises an error.
        seen: a folder where every process that draws starts leaves a file by its number.
    """
    free = disc(radius, centre=(0.0, 0.0))
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
    wave = 0.5 * ca.sum1(ca.cos(3 * np.pi * x)) - 0.4 * ca.sumsqr(x)
    exact = ca.Function("exact", [x], [wave])
    hessian, gradient = ca.hessian(-wave, x)
    relaxed = Relaxation(*(ca.Function(n, [x, p], [e]) for n, e in (("v", -wave), ("g", gradient), ("h", hessian))))

    def evaluate(X: np.ndarray) -> Evaluation:
        time.sleep(slow_s * len(X))
        found = free.evaluate(X)
        return Evaluation(np.array(exact(X.T)).ravel(), found.violation, found.mode)

    def sample(seed: int, count: int) -> np.ndarray:
        if seen:
            (Path(seen) / str(os.getpid())).touch()
        if seed == deadly:
            os.kill(os.getpid(), signal.SIGKILL)
        if seed == wrong:
            raise ValueError("a start that cannot be drawn")
        return sobol(free.lower, free.upper, seed, count)

    rebuild = partial(ripples, radius, slow_s, deadly, wrong, seen)
    box = free.lower, free.upper, free.constraints
    relax = (lambda mode, whole: relaxed) if radius > 1.5 else free.relax
    return Nlp("ripples", "toy", free.names, *box, evaluate, relax=relax, sample=sample, rebuild=rebuild)


def two_hills() -> Nlp:
    """Maximise over two hills, of which the higher, about x = -0.5, has its top forbidden in a hole 0.4 wide.

    The relaxation knows no hole, so a descent on that hill ends in it. The starts are one beside the hole, which is
    feasible, and a lower one on the other hill, whose top is worth 0.97.
    """
    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    height = ca.exp(-20 * (x + 0.5) ** 2) + 0.97 * ca.exp(-20 * (x - 0.5) ** 2)
    exact = ca.Function("exact", [x], [height])
    hessian, gradient = ca.hessian(-height, x)
    relaxed = Relaxation(*(ca.Function(n, [x, p], [e]) for n, e in (("v", -height), ("g", gradient), ("h", hessian))))

    def evaluate(X: np.ndarray) -> Evaluation:
        inside = np.maximum(0.0, 0.2 - np.abs(X + 0.5))
        return Evaluation(np.array(exact(X.T)).ravel(), inside, np.zeros(len(X), dtype=int))

    def sample(seed: int, count: int) -> np.ndarray:
        return np.array([[-0.29], [0.25]])

    box = np.ones(1)
    return Nlp("hills", "toy", ("x",), -box, box, ("hole",), evaluate, relax=lambda *_: relaxed, sample=sample)


def strips(closed: tuple[int, ...], met: tuple[int, ...], followed: list[int] | None = None) -> Nlp:
    """Maximise y on one of four vertical strips, the modes; the further to the right, the more it promises.

    Args:
        closed: strips where nothing is feasible.
        met: strips that a sample met.
        followed: takes down the modes that are descended on, in their order.
    """

    def evaluate(X: np.ndarray) -> Evaluation:
        mode = np.clip(np.floor(2 * X[:, 0] + 2), 0, 3).astype(int)
        missed = np.where(np.isin(mode, closed), 1.0 - 0.1 * mode, 0.0)
        return Evaluation(np.where(missed > 0.0, -np.inf, X[:, 1] + mode), missed[:, None], mode)

    def relax(mode: int, whole: bool) -> Relaxation:
        if followed is not None:
            followed.append(mode)
        x, p = ca.SX.sym("x", 2), ca.SX.sym("p")
        value = (x[0] - 0.5 * mode + 0.75) ** 2 - x[1]
        hessian, gradient = ca.hessian(value, x)
        return Relaxation(*(ca.Function(n, [x, p], [e]) for n, e in (("v", value), ("g", gradient), ("h", hessian))))

    kept = np.zeros((4, 1, 4), dtype=bool)
    kept[list(met), 0, list(met)] = True
    box = np.ones(2)
    screen = partial(Screening, np.zeros((4, 2)), kept)
    return Nlp("strips", "toy", ("x", "y"), -box, box, ("open",), evaluate, relax=relax, n_modes=4, screen=screen)


def lying(nlp: Nlp, relaxed: Nlp) -> Nlp:
    """A problem whose relaxation is another's: what its derivatives promise, its exact model does not keep."""
    return replace(nlp, relax=relaxed.relax)


def stepped(radius: float = 0.4, step: float = 0.25) -> Nlp:
    """The disc with violations in coarse steps, so that many candidates tie."""
    exact = disc(radius)

    def evaluate(X: np.ndarray) -> Evaluation:
        found = exact.evaluate(X)
        return Evaluation(found.objective, np.ceil(found.violation / step) * step, found.mode)

    return replace(exact, evaluate=evaluate)


def on_parabola() -> Nlp:
    """The disc, wide enough not to matter, on the curve y = x^2."""
    free = disc(2.0)

    def relax(mode: int, whole: bool) -> Relaxation:
        relaxed = free.relax(mode, whole)
        x, p, lam_f, lam_g = ca.MX.sym("x", 2), ca.MX.sym("p"), ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 1)
        g = x[1] - x[0] ** 2
        upper = ca.triu(lam_f * relaxed.hessian(x, p) + lam_g * ca.hessian(g, x)[0])
        equalities = Equalities(
            ca.Function("g", [x], [g]),
            ca.Function("j", [x], [ca.jacobian(g, x)]),
            ca.Function("h", [x, p, lam_f, lam_g], [upper]),
        )
        return replace(relaxed, equalities=equalities)

    return replace(free, relax=relax)
