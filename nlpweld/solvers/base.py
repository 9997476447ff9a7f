"""What every solver is: the protocol, its budget, and the outcome it reports."""

import time
from dataclasses import dataclass, field
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from nlpweld.formulation.nlp import Evaluation, Nlp

Status = Literal["SOLVED", "INFEASIBLE", "TIMEOUT", "FAILED", "SKIPPED"]


@dataclass(frozen=True)
class Budget:
    """Limits of one run; a solver stops at whichever comes first.

    Attributes:
        evaluations: candidates of the exact model, or None.
        time_s: wall time of build and solve [s], or None.
    """

    evaluations: int | None = None
    time_s: float | None = None


@dataclass(frozen=True, eq=False)
class Step:
    """One entry of a solver's trace, e.g. a generation or an iteration."""

    time_s: float
    evaluations: int
    best: float
    x: np.ndarray
    mean: float = float("nan")
    spread: float = float("nan")


@dataclass(frozen=True, eq=False)
class Improvement:
    """A feasible candidate of the exact model that was better than all before it."""

    time_s: float
    evaluations: int
    objective: float
    x: np.ndarray
    mode: int


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a solver says it did; a claim, until the verifier has looked at it.

    Attributes:
        status: SOLVED when the exact model at the seam points agrees that x is feasible.
        x: the best point found, or None.
        mode: the discrete choice that goes with x.
        objective: the exact objective at x, NaN without one.
        evaluations: candidates of the exact model, or evaluations of the smooth objective.
        build_s: time to build what the solver needs [s], and the exact model where a runner prepares it.
        solve_s: time to solve [s].
        trace: progress, oldest first.
        message: the solver's own last word.
        sharpening: of a solver with soft penalties, one entry for each solve: ``sharpness``, the ``smooth`` objective
            it ended at, the ``exact`` one there, and how much the exact model misses (``missed``).
        improvements: every feasible candidate that was the best so far, oldest first.
        starts: of a multi-start, the exact objective every start came to, NaN where it brought nothing feasible.
    """

    status: Status
    x: np.ndarray | None
    mode: int
    objective: float
    evaluations: int
    build_s: float
    solve_s: float
    trace: tuple[Step, ...] = ()
    message: str = ""
    sharpening: tuple[dict[str, float], ...] = ()
    improvements: tuple[Improvement, ...] = ()
    starts: tuple[float, ...] = ()


@runtime_checkable
class Solver(Protocol):
    """A way to solve an Nlp; its options are the fields of a frozen dataclass."""

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Solve; the same seed and budget of evaluations give the same answer."""


@dataclass(eq=False)
class Incumbent:
    """The best candidate of the exact model so far: feasible before infeasible, then by objective."""

    nlp: Nlp
    x: np.ndarray | None = None
    mode: int = 0
    objective: float = float("-inf")
    total: float = float("inf")
    evaluations: int = 0
    started: float = field(default_factory=time.perf_counter)
    trace: list[Step] = field(default_factory=list)
    sharpening: list[dict[str, float]] = field(default_factory=list)
    improvements: list[Improvement] = field(default_factory=list)

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Evaluate candidates (m, n) and remember the best."""
        found = self.nlp.evaluate(X)
        self.evaluations += len(X)
        i = int(np.lexsort((-found.objective, found.total))[0])
        if (found.total[i], -found.objective[i]) < (self.total, -self.objective):
            self.x, self.mode = np.array(X[i]), int(found.mode[i])
            self.objective, self.total = float(found.objective[i]), float(found.total[i])
            if self.total == 0.0:
                told = self.elapsed_s, self.evaluations, self.objective, self.x, self.mode
                self.improvements.append(Improvement(*told))
        return found

    @property
    def elapsed_s(self) -> float:
        """Time since the start [s]."""
        return time.perf_counter() - self.started

    def note(self, x: np.ndarray | None = None, mean: float = float("nan"), spread: float = float("nan")) -> None:
        """Add a step to the trace."""
        at = x if x is not None else self.x
        best = self.objective if self.total == 0.0 else float("nan")
        self.trace.append(Step(self.elapsed_s, self.evaluations, best, np.array(at), mean, spread))

    def spent(self, budget: Budget) -> str:
        """Return which limit is reached, ``time limit`` or ``evaluation limit``, or nothing."""
        if budget.time_s is not None and self.elapsed_s >= budget.time_s:
            return "time limit"
        if budget.evaluations is not None and self.evaluations >= budget.evaluations:
            return "evaluation limit"
        return ""

    def outcome(self, build_s: float, message: str) -> Outcome:
        """Return the outcome of the search so far; a message that starts with ``time limit`` makes it a TIMEOUT."""
        feasible = self.total == 0.0
        status: Status = "TIMEOUT" if message.startswith("time limit") else "SOLVED" if feasible else "INFEASIBLE"
        objective = self.objective if np.isfinite(self.objective) else float("nan")
        solve_s = self.elapsed_s - build_s
        cost = self.evaluations, build_s, solve_s
        told = tuple(self.trace), message, tuple(self.sharpening)
        return Outcome(status, self.x, self.mode, objective, *cost, *told, improvements=tuple(self.improvements))
