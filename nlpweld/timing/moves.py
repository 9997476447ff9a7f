"""The phases of a cycle: which joints run which path, and their instants as one timeline."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from nlpweld.plan import Plan
from nlpweld.timeline import Timeline, Track
from nlpweld.timing.joints import columns
from nlpweld.timing.law import Run
from nlpweld.timing.sampling import State, States, sampled, steepest

ROUNDS = 8  # of slowing what quintics exceed
SLOWER = 1 + 1e-4  # beyond what is needed


@dataclass(frozen=True, eq=False)
class Part:
    """Some joints in one phase: runs one after the other, from rest to rest.

    Attributes:
        columns: which of all joints side by side.
        runs: what they do; none where they stand still.
    """

    columns: slice
    runs: tuple[Run, ...]

    @property
    def duration_s(self) -> float:
        """How long they take [s]."""
        return sum(run.duration_s for run in self.runs)

    def lasting(self, duration_s: float) -> "Part":
        """Return the same slowed alike to a longer duration [s]."""
        own = self.duration_s
        if not self.runs or duration_s <= own:
            return self
        return replace(self, runs=tuple(replace(run, stretch=run.stretch * duration_s / own) for run in self.runs))


def together(parts: list[Part], rest: np.ndarray, jerk: np.ndarray, step_s: float) -> States:
    """Return a phase in which parts begin and end together, the quicker ones slowed, from time 0.

    Args:
        parts: who moves; their runs have no clocks of their own.
        rest: where everything stands before, joints and seam parameter, shape (J + 1,).
        jerk: limits of all joints, and of the parameter, shape (J + 1,).
        step_s: greatest time between instants [s].
    """
    whole = max((part.duration_s for part in parts), default=0.0)
    if whole == 0.0:
        still = np.zeros((1, len(rest)))
        return States(np.zeros(1), (rest[None], still, still))
    parts, marks = [part.lasting(whole) for part in parts], [np.array([0.0, whole])]
    for part in parts:
        for begin, run in _one_by_one(part):
            marks.append(begin + run.times(run.breaks))
    t = np.concatenate(marks)
    return sampled(partial(_at, parts, rest), np.asarray, t[(t >= 0) & (t <= whole)], jerk, step_s)


def in_a_row(runs: list[Run], jerk: np.ndarray, step_s: float) -> States:
    """Return runs of everything one after the other, each by its own clock; arguments as in :func:`together`."""
    found = [_settled(run, jerk, step_s) for run in runs]
    begins = np.cumsum([0.0, *(states.t_s[-1] for states in found)])
    kept = [slice(int(k > 0), None) for k in range(len(found))]
    t = [begin + states.t_s[own] for begin, states, own in zip(begins, found, kept, strict=False)]
    parts = [[states.x[k][own] for states, own in zip(found, kept, strict=True)] for k in range(3)]
    return States(np.concatenate(t), tuple(np.concatenate(part) for part in parts))  # type: ignore[arg-type]


def _settled(run: Run, jerk: np.ndarray, step_s: float) -> States:
    """Return a run, all of one with a clock slowed by what its quintics exceed jerk limits."""
    states = sampled(run.motion, run.times, run.breaks, jerk, step_s)
    for _ in range(ROUNDS):
        over = steepest(states, jerk)
        if run.clock is None or over <= 1.0:
            break
        run = replace(run, stretch=run.stretch * over ** (1 / 3) * SLOWER)
        states = sampled(run.motion, run.times, run.breaks, jerk, step_s)
    return states


def joined(plan: Plan, named: list[tuple[str, States]]) -> Timeline:
    """Return phases one after the other as a timeline; those that take no time are left out."""
    named = [(name, states) for name, states in named if states.t_s[-1] > 0]
    begin, times, phases = 0.0, [np.zeros(1)], []
    x = [[named[0][1].x[k][:1]] for k in range(3)]
    for name, states in named:
        times.append(begin + states.t_s[1:])
        begin = float(times[-1][-1])
        phases.append((name, begin))
        for k in range(3):
            x[k].append(states.x[k][1:])
    q, rate, acceleration = (np.concatenate(parts) for parts in x)
    tracks = {n: Track(q[:, c], rate[:, c], acceleration[:, c]) for n, c in columns(plan.cell).items()}
    s = np.clip(np.maximum.accumulate(q[:, -1]), 0.0, 1.0)
    return Timeline(np.concatenate(times), s, tuple(phases), tracks)


def _one_by_one(part: Part) -> list[tuple[float, Run]]:
    """Return the runs of a part, each with when it begins [s]."""
    begins = np.cumsum([0.0, *(run.duration_s for run in part.runs)])
    return list(zip(begins.tolist(), part.runs, strict=False))


def _at(parts: list[Part], rest: np.ndarray, t: np.ndarray) -> State:
    """Return the state at instants (M,) of a phase."""
    x = (np.tile(rest, (len(t), 1)), np.zeros((len(t), len(rest))), np.zeros((len(t), len(rest))))
    for part in parts:
        for begin, run in _one_by_one(part):
            own = np.flatnonzero(t >= begin - 1e-12)
            u = np.clip((t[own] - begin) / run.stretch, 0.0, float(run.pace.duration_s))
            for whole, new in zip(x, run.motion(u), strict=True):
                whole[own, part.columns] = new
    return x
