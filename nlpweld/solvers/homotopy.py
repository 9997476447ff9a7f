"""Ever sharper penalties: the loop all solvers on derivatives share, with the inner minimiser left to each of them."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation
from nlpweld.solvers.base import Budget, Incumbent, Outcome

Start = tuple[np.ndarray, int]  # a point and the mode to follow from there
Watch = Callable[[np.ndarray], bool]  # counts a point and keeps it in the trace; tells whether the budget is spent


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where one inner solve ended.

    Attributes:
        x: the last iterate, shape (n,).
        value: the relaxation's value there.
        iterations: iterations it took.
        status: the minimiser's own last word.
    """

    x: np.ndarray
    value: float
    iterations: int
    status: str


Minimiser = Callable[[np.ndarray, float], Minimum]  # from a start (n,), at a sharpness


@dataclass(frozen=True)
class Homotopy(ABC):
    """Solves of ever sharper penalties, each started from the last.

    A descent that ends infeasible (the penalties' own local minimum), or below the best scout, is followed by one
    from the next start, which is still the same seed's; the message says how many starts it took. A solver is a
    subclass with its own ``minimiser``.

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
    """

    sharpness: float = 30.0
    growth: float = 30.0
    sharpenings: int = 6
    settled: float = 1e-3
    hopeless: float = 1e-3
    descents: int = 10
    modes_tried: int = 3
    scouts: int = 256

    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}}

    def unsuitable(self, nlp: Nlp) -> str | None:
        """Return why this solver cannot take the problem, or None when it can."""
        return None if nlp.relax else f"formulation '{nlp.formulation}' has no derivatives"

    @abstractmethod
    def minimiser(self, nlp: Nlp, relax: Relaxation, watch: Watch) -> Minimiser:
        """Return what minimises a relaxation over the box from a start, and shows every iterate to the watch."""

    def solve(self, nlp: Nlp, *, seed: int, budget: Budget) -> Outcome:
        """Descend from random starts in the box until one ends feasible, and no worse than the best scout."""
        search = Incumbent(nlp)
        groups = self.starts(search, seed, budget)
        if search.x is not None and search.spent(budget):  # whoever sets out late still brings one answer
            return search.outcome(0.0, f"{search.spent(budget)} before the first descent")
        run = _Run(self, search, budget, scouted=search.objective if search.total == 0.0 else float("-inf"))
        for group in groups:
            for start, mode in _with_refined(nlp, group):
                run.descend(start, mode)
                if run.stopped:
                    return search.outcome(run.build_s, f"{run.stopped} in descent {run.descents}")
            if run.content:
                break
            run.widen()
        seen = f"; {nlp.screen()}" if nlp.screen else ""
        return search.outcome(run.build_s, f"{run.last}; {run.descents} descents, {run.iterations} iterations{seen}")

    def starts(self, search: Incumbent, seed: int, budget: Budget) -> list[list[Start]]:
        """Return groups of starts; a group is followed whole, the next only if it brought nothing better than scouts.

        Args:
            search: evaluates the scouts and keeps the best.
            seed: seed of every random draw.
            budget: limits of the whole run.
        """
        nlp = search.nlp
        if self.scouts == 0 and nlp.n_modes == 1:
            return [[(start, 0)] for start in nlp.starts(seed, self.descents)]
        X = nlp.starts(seed, self.scouts or self.descents)[: budget.evaluations]
        return self.ranked(X, search.evaluate(X), nlp)

    def ranked(self, X: np.ndarray, found: Evaluation, nlp: Nlp) -> list[list[Start]]:
        """Return groups of the best of some candidates X (m, n): one after the other, or the best of each mode."""
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
    """What several descents share: built minimisers, the clock, the count."""

    options: Homotopy
    search: Incumbent
    budget: Budget
    scouted: float  # the best objective of a feasible scout
    build_s: float = 0.0
    descents: int = 0
    iterations: int = 0
    last: str = ""
    stopped: str = ""
    reached: float = float("-inf")  # the best feasible objective of a descent
    whole: bool = False  # a relaxation may leave constraints out until a descent ends infeasible
    built: dict[int, Minimiser] = field(default_factory=dict)

    @property
    def content(self) -> bool:
        """Whether a descent brought something feasible that is not below the scouts."""
        below = self.scouted - self.reached
        return np.isfinite(self.reached) and not below > self.options.settled * abs(self.scouted)

    def descend(self, start: np.ndarray, mode: int) -> None:
        """Solve with growing sharpness from one start on one mode."""
        self.descents += 1
        minimise, nlp = self._minimiser(mode), self.search.nlp
        x, before, sharpness = start, float("-inf"), self.options.sharpness
        for k in range(self.options.sharpenings):
            ended = minimise(x, sharpness)
            x, self.last = ended.x, ended.status
            self.iterations += ended.iterations
            found = self.search.evaluate(np.clip(x, nlp.lower, nlp.upper)[None])
            self.search.note(x)
            self.search.sharpening.append(_cost(ended.value, sharpness, found))
            gain = float(found.objective[0]) - before
            before = float(found.objective[0])
            if found.feasible[0]:
                self.reached = max(self.reached, before)
            self.stopped = self.search.spent(self.budget)
            if self.stopped:
                return
            settled = found.feasible[0] and gain < self.options.settled * abs(before)
            if k >= 2 and (settled or found.total[0] > self.options.hopeless):
                return
            sharpness *= self.options.growth

    def watch(self, x: np.ndarray) -> bool:
        """Count an evaluation of the smooth objective at x (n,) and tell whether the budget is spent."""
        self.search.evaluations += 1
        self.search.note(x)
        return bool(self.search.spent(self.budget))

    def widen(self) -> None:
        """Leave no constraint out from now on."""
        if not self.whole:
            self.whole = True
            self.built.clear()

    def _minimiser(self, mode: int) -> Minimiser:
        if mode not in self.built:
            began = time.perf_counter()
            nlp = self.search.nlp
            assert nlp.relax is not None
            self.built[mode] = self.options.minimiser(nlp, nlp.relax(mode, self.whole), self.watch)
            self.build_s += time.perf_counter() - began
        return self.built[mode]


def _cost(smooth: float, sharpness: float, found: Evaluation) -> dict[str, float]:
    """Return what soft penalties of a sharpness cost: the smooth objective, to be maximised, against the exact one.

    The smooth one counts MMR in a unit that keeps it of order one and takes the penalties off.
    """
    exact = {"exact": float(found.objective[0]), "missed": float(found.total[0])}
    return {"sharpness": sharpness, "smooth": -smooth, **exact}
