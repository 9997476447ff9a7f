"""The one type solvers know: named variables in a box, an objective to maximise, and named constraints."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.formulation.branches import Screening


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What the exact model says of a batch of candidates.

    Attributes:
        objective: value to maximise, shape (m,); defined for infeasible candidates too, -inf where it has no meaning.
        violation: how far each constraint is missed, shape (m, K), zero when it holds with the solvers' margin.
        mode: index of the discrete choice (e.g. branch combination) that was best for each candidate, shape (m,).
    """

    objective: np.ndarray
    violation: np.ndarray
    mode: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Sum of all violations, shape (m,)."""
        return self.violation.sum(axis=1)

    @property
    def feasible(self) -> np.ndarray:
        """Whether every constraint holds, shape (m,)."""
        return self.total == 0.0


@dataclass(frozen=True, eq=False)
class Equalities:
    """Constraints ``value(x) == 0`` of a relaxation, with sparse derivatives.

    Attributes:
        value: ``x -> (m, 1)``.
        jacobian: ``x -> (m, n)``.
        hessian: ``(x, sharpness, lam_f, lam_g) -> (n, n)``, the upper triangle of the Hessian of the Lagrangian:
            ``lam_f`` times the relaxation's value plus ``lam_g`` (m, 1) times these.
    """

    value: ca.Function
    jacobian: ca.Function
    hessian: ca.Function


@dataclass(frozen=True, eq=False)
class Relaxation:
    """A smooth penalised problem: minimise ``value(x, sharpness)`` over the box.

    Attributes:
        value: ``(x, sharpness) -> scalar``; soft penalties that tend to the exact constraints as sharpness grows.
        gradient: ``(x, sharpness) -> (1, n)`` or (n, 1).
        hessian: ``(x, sharpness) -> (n, n)``.
        equalities: constraints that hold besides, or None where the box is all there is.
    """

    value: ca.Function
    gradient: ca.Function
    hessian: ca.Function
    equalities: Equalities | None = None


@dataclass(frozen=True, eq=False)
class Nlp:
    """A placement problem as solvers see it.

    Attributes:
        problem: name of the cell or toy.
        formulation: name of the formulation.
        names: names of the variables.
        lower: lower bounds, shape (n,).
        upper: upper bounds, shape (n,).
        constraints: names of the columns of ``Evaluation.violation``.
        evaluate: exact model over candidates X (m, n).
        unpack: ``(x, mode) -> `` a Plan, or a report that says why there is none; None for toys.
        relax: ``(mode, whole) -> Relaxation``, with every constraint if whole, else with those likely to matter;
            None where there are no derivatives.
        n_modes: number of discrete choices.
        widened: the same problem with margins grown by amounts for ``singularity`` [m^3], ``clearance`` [m] and
            ``joint_limit`` [rad]; None where there are none.
        refine: ``(start, mode) -> `` a better start nearby, by other means than derivatives, or None.
        sample: ``(seed, count) -> `` start points (count, n); spread over the whole box by default.
        prepare: builds what ``evaluate`` needs, so that its cost can be told apart; None where there is nothing.
        screen: tells which modes a sample met, where there is more than one; those in doubt are to be followed last.
            None where nothing is known.
        rebuild: builds this problem again in another process, so it can be pickled; None where that cannot be. Whoever
            replaces what the problem computes replaces this, too.
    """

    problem: str
    formulation: str
    names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    constraints: tuple[str, ...]
    evaluate: Callable[[np.ndarray], Evaluation]
    unpack: Callable[[np.ndarray, int], Any] | None = None
    relax: Callable[[int, bool], Relaxation] | None = None
    n_modes: int = 1
    widened: Callable[[dict[str, float]], "Nlp"] | None = None
    refine: Callable[[np.ndarray, int], np.ndarray | None] | None = None
    sample: Callable[[int, int], np.ndarray] | None = None
    prepare: Callable[[], None] | None = None
    screen: Callable[[], Screening] | None = None
    rebuild: Callable[[], "Nlp"] | None = None

    def starts(self, seed: int, count: int) -> np.ndarray:
        """Return start points in the box from a scrambled Sobol sequence, shape (count, n)."""
        if self.sample:
            return self.sample(seed, count)
        return sobol(self.lower, self.upper, seed, count)

    def started(self, x: np.ndarray) -> "Nlp":
        """Return the same problem for a descent from x (n,) alone, e.g. another solver's answer; it is not refined.

        It starts there with wider margins too.
        """
        start, widened = np.clip(x, self.lower, self.upper), self.widened
        again = widened and (lambda extra: widened(extra).started(x))
        built = self.rebuild and partial(_started, self.rebuild, x)
        return replace(self, sample=lambda seed, count: start[None], widened=again, refine=None, rebuild=built)


def _started(rebuild: Callable[[], Nlp], x: np.ndarray) -> Nlp:
    return rebuild().started(x)


def sobol(lower: np.ndarray, upper: np.ndarray, seed: int, count: int) -> np.ndarray:
    """Return points of a scrambled Sobol sequence in a box, shape (count, n)."""
    from scipy.stats import qmc  # half a second to import, and not everybody needs it

    power = int(np.ceil(np.log2(count)))
    unit = qmc.Sobol(len(lower), rng=np.random.default_rng(seed)).random_base2(power)[:count]
    return qmc.scale(unit, lower, upper)
