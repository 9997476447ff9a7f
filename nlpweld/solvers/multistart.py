"""Many starts of a local solver, each from its own scrambled Sobol sequence, spread over processes.

Multi-start is as old as local search; Rinnooy Kan and Timmer (1987) say when to stop.
"""

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import ClassVar

import numpy as np

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers import make_solver
from nlpweld.solvers.base import Budget, Incumbent, Outcome, Step
from nlpweld.solvers.starts import NOT_BEGUN, Clock, End, Start, apart, cores, here

SAME = 1e-3  # share of the best objective within which another start counts as having found it
OVERRUN = 3  # evaluations of a start beyond its share: Ipopt's first and last iterate, and one look at its answer


@dataclass(frozen=True)
class Multistart:
    """A local solver from several groups of starts; the best feasible answer by the exact model is kept.

    The first group is that of the solver's own run on the same seed; the others are scrambled with seeds drawn from
    it. The answer is the same with any number of processes, as long as no time limit cuts a start short.

    Attributes:
        inner: name of the local solver.
        inner_preset: its options.
        starts: how many groups of starts.
        workers: processes at once; 0 for one a core, 1 for this process alone, which problems that cannot be rebuilt
            elsewhere are solved in anyway.
        least: evaluations that a start is worth beginning with; under a budget of evaluations, which is dealt out
            evenly, there are fewer starts rather than starts with less.
    """

    inner: str = "ipopt"
    inner_preset: str = "default"
    starts: int = 8
    workers: int = 0
    least: int = 500

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}, "tuned": {"inner_preset": "tuned"}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        if self.inner == "multistart":
            return "a multi-start of multi-starts makes no sense; name a local solver"
        return make_solver(self.inner, self.inner_preset).unsuitable(nlp)

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Solve from every group of starts."""
        search = Incumbent(nlp)
        clock = Clock(search.started, budget.time_s)
        starts = self._starts(seed, budget)
        workers = min(self.workers or cores(), len(starts)) if nlp.rebuild else 1
        ends, objectives = [], []
        with closing(self._ends(nlp, starts, clock, workers)) as coming:
            for end in coming:
                ends.append(end)
                objectives.append(_judged(search, end))
        build_s = sum(e.build_s + (e.outcome.build_s if e.outcome else 0.0) for e in ends) / workers
        return _told(search, ends, objectives, build_s)

    def _ends(self, nlp: Nlp, starts: Sequence[Start], clock: Clock, workers: int) -> Generator[End, None, None]:
        solver = make_solver(self.inner, self.inner_preset)
        return apart(nlp, solver, starts, clock, workers) if workers > 1 else here(nlp, solver, starts, clock)

    def _starts(self, seed: int, budget: Budget) -> list[Start]:
        """Return the starts with their shares of the evaluations; the time is everyone's."""
        count, share = max(1, self.starts), None
        if budget.evaluations is not None:
            count = max(1, min(count, budget.evaluations // self.least))
            share = max(1, budget.evaluations // count - OVERRUN)
        drawn = np.random.SeedSequence(seed).generate_state(count)
        return [Start(seed if k == 0 else int(drawn[k]), Budget(share)) for k in range(count)]


def _judged(search: Incumbent, end: End) -> float:
    """Have the exact model judge the answer of a start; return its objective, NaN where there is no feasible one."""
    if end.outcome is None:
        return float("nan")
    inner, search.evaluations = end.outcome, search.evaluations + end.outcome.evaluations
    if inner.x is None:
        return float("nan")
    found = search.evaluate(inner.x[None])
    if search.x is not None and np.array_equal(search.x, inner.x):
        search.sharpening = list(inner.sharpening)
    return float(found.objective[0]) if found.feasible[0] else float("nan")


def _told(search: Incumbent, ends: list[End], objectives: list[float], build_s: float) -> Outcome:
    """Return the outcome of all starts: the best, how many found it, and what became of the others."""
    words = [e.outcome.message if e.outcome else e.lost for e in ends]
    late = any(w.startswith(("time limit", NOT_BEGUN)) for w in words)
    limit = "time limit" if late else "evaluation limit" if any(w.startswith("evaluation limit") for w in words) else ""
    lost = [e.lost for e in ends if e.lost and e.lost != NOT_BEGUN]
    same = sum(v >= search.objective - SAME * abs(search.objective) for v in objectives)
    parts = [
        *([limit] if limit else []),
        f"{same} of {len(ends)} starts within {100 * SAME:g} % of the best",
        *([f"{len(lost)} lost: {', '.join(sorted(set(lost)))}"] if lost else []),
    ]
    outcome = search.outcome(build_s, "; ".join(parts))
    outcome = replace(outcome, starts=tuple(objectives), trace=_joined(ends))
    return replace(outcome, status="FAILED") if len(lost) == len(ends) else outcome


def _joined(ends: list[End]) -> tuple[Step, ...]:
    """Return the traces of all starts as one, by time, with the evaluations of all and the best so far."""
    steps: list[tuple[float, int, Step]] = []
    for end in ends:
        counts = [0] + [s.evaluations for s in end.outcome.trace] if end.outcome else [0]
        steps += [
            (end.began_s + s.time_s, after - before, s)
            for s, before, after in zip(end.outcome.trace if end.outcome else (), counts, counts[1:], strict=False)
        ]
    steps.sort(key=lambda step: step[0])
    evaluations = accumulate(more for _, more, _ in steps)
    best = accumulate((s.best for _, _, s in steps), lambda a, b: float(np.fmax(a, b)))
    return tuple(
        replace(s, time_s=at, evaluations=n, best=b) for (at, _, s), n, b in zip(steps, evaluations, best, strict=True)
    )
