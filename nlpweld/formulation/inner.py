"""The exact inner answer: at a fixed placement, the best paths of the free angles there are on a grid.

Ipopt finds one local optimum of smooth paths. On a grid dynamic programming finds the best path of all, which tells
how much a descent left on the table, and from where to start the next. The branch of every arm and its wrist stay the
same along the seam. States keep reach, singularity floor, clearance and joint limits with the solvers' margins; from
one seam point to the next, and on a closed seam from the last to the first, no joint turns farther than solvers allow.

Joints that may turn more than once (4 and 6 of the usual arm) are the exception: how often they have turned is not
part of a state, so that the search leaves their limits out. The answer is therefore judged as the redundant form
judges its own, over unwrapped paths, and says whether it holds; where not, its value is still a bound on the grid.

The mean over the seam is a sum of values, a power mean the sum of their powers, and the minimum the least value on the
way: all three take the same search.
"""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np

from nlpweld.formulation.cycles import Chain, Links
from nlpweld.formulation.lattice import TURN, Arm, Joints, Lattice, Owner
from nlpweld.formulation.over_seam import Worth
from nlpweld.formulation.redundant import STEP_MARGIN_DEG, Redundant

COUNTS = {1: 72, 2: 36}  # values of each of so many spins and yaws
SMOOTHING = 1e-3  # weight of the bend of control points, which decides where seam points do not


@dataclass(frozen=True, eq=False)
class Inner:
    """The best paths of the free angles on a grid, at one placement.

    Attributes:
        x: the placement's coordinates, shape (d,) [m; rad].
        value: the cell's objective over the seam points.
        angles: name of a free angle to its value at every seam point, shape (N,) [rad].
        mode: index of the arm branches in the form's modes.
        states: feasible states of that mode at every seam point, shape (N,).
        holds: whether the redundant form's exact model finds nothing missed, unwrapped joint limits included; where
            not, the value is only a bound.
        seconds: wall time, kernels included where they were not built before.
    """

    x: np.ndarray
    value: float
    angles: dict[str, np.ndarray]
    mode: int
    states: np.ndarray
    holds: bool
    seconds: float


@dataclass(frozen=True, eq=False)
class Start:
    """Variables of a redundant form from paths on a grid.

    Attributes:
        z: the variables (n,), or None where an angle winds round a closed seam, as no periodic spline does.
        misfit: name of a free angle to how far its spline misses the path at most [rad]; empty without z.
        turns: name of a free angle to the whole turns it makes round a closed seam.
    """

    z: np.ndarray | None
    misfit: dict[str, float]
    turns: dict[str, int]


def inner(
    form: Redundant,
    x: np.ndarray,
    grids: Mapping[str, np.ndarray] | None = None,
    mode: int | None = None,
    banded: bool = False,
) -> Inner | None:
    """Return the best paths of a form's free angles at a placement, or None where no path keeps the constraints.

    For many placements build :func:`lattice` once and ask :func:`best`.

    Args:
        form: the redundant form.
        x: the placement's coordinates, shape (d,) [m; rad].
        grids: name of a free angle to its values [rad]; see :func:`lattice`.
        mode: index of the arm branches; all by default.
        banded: whether paths may not run across half a turn, as splines inside a band of one turn cannot.
    """
    return best(lattice(form, grids), x, mode, banded)


def lattice(form: Redundant, grids: Mapping[str, np.ndarray] | None = None) -> Lattice:
    """Return the states of a form's cell over a grid.

    Args:
        form: the redundant form.
        grids: name of a free angle to its values [rad]. By default spins and yaws are spread over their bands, 72
            values of one, 36 of each of two, 12 of each of more; tilts are held at 0.
    """
    wide = [angle for angle in form.coding.angles if angle.name.partition(".")[0] in ("spin", "yaw")]
    chosen = {angle.name: spread(angle.lower, angle.upper, COUNTS.get(len(wide), 12)) for angle in wide}
    chosen |= grids or {}
    return Lattice(form, tuple(np.asarray(chosen.get(name, [0.0]), dtype=float) for name in form.names))


def spread(lower: float, upper: float, count: int) -> np.ndarray:
    """Return evenly spread values of a band [rad]; of a whole turn or more those of one turn from half a turn back."""
    return np.linspace(lower, upper, count) if upper - lower < TURN - 1e-9 else np.arange(count) * TURN / count - np.pi


def best(
    states: Lattice, x: np.ndarray, mode: int | None = None, banded: bool = False, exponent: float | None = None
) -> Inner | None:
    """Return the best paths over a lattice at a placement x (d,), see :func:`inner`.

    With an exponent, they are the best by that power mean, whatever the cell's objective, and so is their value.
    """
    began, x, form = time.perf_counter(), np.asarray(x, dtype=float), states.form
    worth = Worth.of(form.cell, exponent)
    found = _Search(states, x, banded, worth).best(range(len(form.batch.modes)) if mode is None else [mode])
    if found is None:
        return None
    paths = states.angles(found.path)
    return Inner(
        x=x,
        value=worth.value(found.total, len(found.path)),
        angles=dict(zip(form.names, paths, strict=True)),
        mode=found.mode,
        states=found.counts,
        holds=bool(states.judged(x, paths).feasible[0]),
        seconds=time.perf_counter() - began,
    )


def start(form: Redundant, found: Inner) -> Start:
    """Return the variables whose splines come nearest to paths in the least squares, inside their bands."""
    closed = form.cell.seam.closed
    paths = {name: np.unwrap(path) for name, path in found.angles.items()}
    ends = {name: np.unwrap([path[-1], path[0]])[1] for name, path in paths.items()}
    turns = {name: round((ends[name] - path[0]) / TURN) if closed else 0 for name, path in paths.items()}
    if any(turns.values()):
        return Start(None, {}, turns)
    B, control, misfit = form.coding.basis, [], {}
    for angle in form.coding.angles:
        path = _into(paths[angle.name], angle.lower, angle.upper)
        control.append(_fit(B, path, angle.lower, angle.upper, closed))
        misfit[angle.name] = float(np.abs(B @ control[-1] - path).max())
    return Start(np.concatenate([found.x, np.array(control).T.ravel()]), misfit, turns)


def _into(path: np.ndarray, lower: float, upper: float) -> np.ndarray:
    """Return a path shifted by whole turns so that it leaves its band least."""
    shifts = TURN * np.arange(-2, 3)
    outside = [np.abs(path + shift - np.clip(path + shift, lower, upper)).max() for shift in shifts]
    return path + shifts[int(np.argmin(outside))]


def _fit(B: np.ndarray, path: np.ndarray, lower: float, upper: float, closed: bool) -> np.ndarray:
    """Return bounded control points (K,) of a path (N,) in the least squares."""
    from scipy.optimize import lsq_linear  # slow to import, and only starts need it

    bend = np.diff(np.eye(B.shape[1]), 2, axis=0)
    if closed:
        bend = np.eye(B.shape[1]) * -2 + np.roll(np.eye(B.shape[1]), 1, 0) + np.roll(np.eye(B.shape[1]), -1, 0)
    rows, wanted = np.vstack([B, SMOOTHING * bend]), np.concatenate([path, np.zeros(len(bend))])
    return np.clip(lsq_linear(rows, wanted, (lower, upper)).x, lower, upper)


@dataclass(frozen=True, eq=False)
class _Found:
    """The best path of a mode: its total, its flat states (N,), and how many there were at every point (N,)."""

    mode: int
    total: float
    path: np.ndarray
    counts: np.ndarray


@dataclass(frozen=True, eq=False)
class _Search:
    """The search at one placement; what modes share is looked at once."""

    states: Lattice
    x: np.ndarray
    banded: bool
    worth: Worth
    arms: dict[tuple[int, tuple[str, str]], Arm] = field(default_factory=dict)
    met: dict[tuple[object, ...], np.ndarray] = field(default_factory=dict)

    @cached_property
    def work(self) -> Owner:
        return self.states.work(self.x)

    @property
    def form(self) -> Redundant:
        return self.states.form

    def best(self, modes: range | list[int]) -> _Found | None:
        """Return the best path of some modes, those that promise most looked at first."""
        tried = [(mode, joints, values) for mode in modes for joints, values in self._variants(mode)]
        bounds = np.array([self.worth.joined.reduce(values.max(axis=1)) for _, _, values in tried])
        found: _Found | None = None
        for i in np.argsort(-bounds, kind="stable"):
            if not np.isfinite(bounds[i]) or (found is not None and bounds[i] <= found.total):
                break
            mode, joints, values = tried[i]
            kept = [np.flatnonzero(np.isfinite(row)) for row in values]
            path = self._chain(joints, values, kept).best()
            if path is not None and (found is None or path[0] > found.total):
                counts = np.array([len(k) for k in kept])
                flat = np.array([k[i] for k, i in zip(kept, path[1], strict=True)])
                found = _Found(mode, path[0], flat, counts)
        return found

    def _variants(self, mode: int) -> Iterator[tuple[tuple[Joints, ...], np.ndarray]]:
        """Yield joints and values (N, G) of a mode for every choice of wrists that makes a difference."""
        branches = self.form.batch.modes[mode]
        arms = [self._arm(k, branch) for k, branch in enumerate(branches)]
        clear = self.work.ok
        for k, l in combinations(range(len(arms)), 2):
            key = (k, l, branches[k], branches[l])
            if key not in self.met:
                self.met[key] = self.states.apart(k, arms[k].owner, l, arms[l].owner)
            clear = clear & self.met[key]
        values = self.worth.summands(self.states.values(arms, clear))
        for joints in self.states.choices(arms):
            ok = np.broadcast_to(np.all(np.broadcast_arrays(*(j.ok for j in joints)), axis=0), values.shape)
            yield joints, np.where(ok, values, -np.inf).reshape(len(values), -1)

    def _arm(self, k: int, branch: tuple[str, str]) -> Arm:
        if (k, branch) not in self.arms:
            self.arms[k, branch] = self.states.arm(k, self.x, branch, self.work)
        return self.arms[k, branch]

    def _chain(self, joints: tuple[Joints, ...], values: np.ndarray, kept: list[np.ndarray]) -> Chain:
        """Return the chain of the feasible states kept at every point, flat."""
        N, closed = len(kept), self.form.cell.seam.closed
        places = [self.states.rows(k) for k in kept]
        if min(len(k) for k in kept) == 0:
            return Chain([row[k] for row, k in zip(values, kept, strict=True)], [], places)  # which has no path
        links = [self._links(joints, kept, j, (j + 1) % N) for j in range(N if closed else N - 1)]
        return Chain([row[k] for row, k in zip(values, kept, strict=True)], links, places, self.worth.joined)

    def _links(self, joints: tuple[Joints, ...], kept: list[np.ndarray], j: int, ahead: int) -> Links:
        """Return which states at seam point j may be followed by which ahead: robots that few angles move come first.

        Their steps are looked at once for every two of their own states, those of the others only where these pass.
        """
        bound, mask = self.form.bound - np.radians(STEP_MARGIN_DEG), np.ones((len(kept[j]), len(kept[ahead])), bool)
        own = [self.states.states(k) for k in range(len(joints))]
        few = [k for k in range(len(joints)) if joints[k].q.shape[2] < np.prod(self.states.shape)]
        for k in few:
            count = joints[k].q.shape[2]
            here, there = np.divmod(np.arange(count * count), count)
            table = joints[k].linked(bound, here, there, j, ahead).reshape(count, count)
            mask &= table[own[k][kept[j]]][:, own[k][kept[ahead]]]
        here, there = np.nonzero(mask)
        if self.banded:
            jumps = np.abs(self.states.angles(kept[j])[:, here] - self.states.angles(kept[ahead])[:, there]).max(
                axis=0, initial=0.0
            )
            here, there = here[jumps <= np.pi], there[jumps <= np.pi]
        for k in set(range(len(joints))) - set(few):
            linked = joints[k].linked(bound, own[k][kept[j]][here], own[k][kept[ahead]][there], j, ahead)
            here, there = here[linked], there[linked]
        return Links.of(here, there)
