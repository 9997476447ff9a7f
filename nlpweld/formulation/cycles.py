"""The best path through layers of states, by dynamic programming; of a closed chain the best cycle, exactly.

A path through a closed chain may end in another state than it began in, so that its total is only a bound of what
cycles reach. Cycles are found by branch and bound over sets of first states: where the best path from a set back into
the same set ends where it began, it is the set's best cycle; where not, the set is cut between the two states.
"""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Links:
    """Which states of one layer may follow which of the layer before, sorted by the follower.

    Attributes:
        sources: the state before, one per link, shape (E,).
        targets: states that have one before them, shape (T,), rising.
        begins: where the links of each of them begin, shape (T,).
    """

    sources: np.ndarray
    targets: np.ndarray
    begins: np.ndarray

    @staticmethod
    def of(sources: np.ndarray, targets: np.ndarray) -> "Links":
        """Return links from pairs of states, shapes (E,)."""
        order = np.argsort(targets, kind="stable")
        sources, targets = sources[order], targets[order]
        begins = np.flatnonzero(np.diff(targets, prepend=-1))
        return Links(sources.astype(np.int32), targets[begins], begins)

    def carry(self, totals: np.ndarray, count: int) -> np.ndarray:
        """Return for each of count followers the greatest total before it, -inf where there is none, shape (count,)."""
        carried = np.full(count, -np.inf)
        if len(self.targets):
            carried[self.targets] = np.maximum.reduceat(totals[self.sources], self.begins)
        return carried

    def before(self, totals: np.ndarray, target: int) -> int:
        """Return the state before a follower whose total is greatest."""
        k = int(np.searchsorted(self.targets, target))
        end = self.begins[k + 1] if k + 1 < len(self.begins) else len(self.sources)
        sources = self.sources[self.begins[k] : end]
        return int(sources[np.argmax(totals[sources])])


@dataclass(frozen=True, eq=False)
class Chain:
    """Layers of states and the links between them.

    Attributes:
        values: what each state is worth, one array (n_j,) per layer.
        links: from layer j to layer j + 1; those of a closed chain end with the ones from the last to the first.
        places: coordinates by which states of a layer are told apart, one array (n_j, f) per layer.
        joined: how values along a path make its total: ``np.add``, or ``np.minimum`` for the least of them.
    """

    values: Sequence[np.ndarray]
    links: Sequence[Links]
    places: Sequence[np.ndarray]
    joined: np.ufunc = np.add

    @property
    def closed(self) -> bool:
        """Whether the last layer is followed by the first."""
        return len(self.links) == len(self.values)

    def best(self) -> tuple[float, np.ndarray] | None:
        """Return the greatest total of a path and its states (N,), or None where there is no path.

        A path through a closed chain is a cycle.
        """
        if min(len(layer) for layer in self.values) == 0:
            return None
        if not self.closed:
            ends = self._totals(np.arange(len(self.values[0])))
            last = int(np.argmax(ends[-1]))
            return (float(ends[-1][last]), self._trace(ends, last)) if np.isfinite(ends[-1][last]) else None
        cut = int(np.argmin([len(layer) for layer in self.values]))
        found = self._turned(cut)._cycle()
        return None if found is None else (found[0], np.roll(found[1], cut))

    def _turned(self, k: int) -> "Chain":
        """Return a closed chain that begins with layer k."""
        values, links, places = ([*part[k:], *part[:k]] for part in (self.values, self.links, self.places))
        return Chain(values, links, places, self.joined)

    def _totals(self, firsts: np.ndarray) -> list[np.ndarray]:
        """Return the greatest totals of paths from some first states to every state, one array per layer."""
        totals = [np.full(len(self.values[0]), -np.inf)]
        totals[0][firsts] = self.values[0][firsts]
        for links, values in zip(self.links, self.values[1:], strict=False):
            totals.append(self.joined(links.carry(totals[-1], len(values)), values))
        return totals

    def _trace(self, totals: list[np.ndarray], last: int) -> np.ndarray:
        """Return the states of the best path to a last one, shape (N,)."""
        path = [last]
        for j in range(len(totals) - 2, -1, -1):
            path.append(self.links[j].before(totals[j], path[-1]))
        return np.array(path[::-1])

    def _cycle(self) -> tuple[float, np.ndarray] | None:
        """Return the best cycle: sets of first states by falling bound, cut until the best path of one closes."""
        queue: list[tuple[float, int, _Set]] = []
        pushed = 0
        open_sets = [np.arange(len(self.values[0]))]
        while open_sets or queue:
            for firsts in open_sets:
                found = self._bound(firsts)
                if found is not None:
                    heapq.heappush(queue, (-found.bound, -pushed, found))  # of equals the last, which is the smallest
                    pushed += 1
            if not queue:
                break
            best = heapq.heappop(queue)[2]
            if best.path[0] == best.end:
                return best.bound, best.path
            open_sets = self._cut(best)
        return None

    def _bound(self, firsts: np.ndarray) -> "_Set | None":
        """Return the best path from a set of first states back into it, and which of them paths come back to."""
        totals = self._totals(firsts)
        back = self.links[-1].carry(totals[-1], len(self.values[0]))[firsts]
        reached = np.isfinite(back)
        if not reached.any():
            return None
        end = int(firsts[np.argmax(back)])
        path = self._trace(totals, self.links[-1].before(totals[-1], end))
        return _Set(float(back.max()), firsts[reached], path, end)

    def _cut(self, whole: "_Set") -> list[np.ndarray]:
        """Return a set's first states in two parts, the ends of its best path one in each."""
        place = self.places[0]
        begin, end = place[whole.path[0]], place[whole.end]
        axis = int(np.argmax(np.abs(begin - end)))
        below = place[whole.firsts, axis] < (begin[axis] + end[axis]) / 2
        return [part for part in (whole.firsts[below], whole.firsts[~below]) if len(part)]


@dataclass(frozen=True, eq=False)
class _Set:
    """First states, and the best path from any of them to any of them.

    Attributes:
        bound: its total, which no cycle from the set exceeds.
        firsts: states, those that no path comes back to left out.
        path: its states (N,).
        end: the first state it comes back to.
    """

    bound: float
    firsts: np.ndarray
    path: np.ndarray
    end: int
