"""Every state of a cell at a fixed placement: free angles on a grid at every seam point, judged by the stage's graphs.

A robot is looked at only over the angles that move it: a torch's own, and those of the workpiece. Arrays over states
have the shape (N, *grid), one axis for each free angle, of length 1 where the angle does not matter.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from nlpweld.engine.lanes import Kernel
from nlpweld.engine.numpy_kernels import lower, numpy_kernel
from nlpweld.formulation.clearance import Meeting, boxes
from nlpweld.formulation.coded import Coding
from nlpweld.formulation.nlp import Evaluation
from nlpweld.formulation.paths import allowed, flip
from nlpweld.formulation.redundant import Redundant
from nlpweld.formulation.stage import Owners
from nlpweld.kinematics.ik import ELBOW, SHOULDER, WRIST
from nlpweld.kinematics.manipulability import mmr

CHUNK = 4096  # lanes in one call, whose arrays fit the cache together
TURN = 2 * np.pi


@dataclass(frozen=True, eq=False)
class Owner:
    """The bodies of a robot or of the work at every state.

    Attributes:
        ok: whether the state is feasible as far as this owner goes, shape (N, *grid).
        slot: its column in the ends, or -1 where they were not looked at, shape (N, *grid).
        ends: body ends, shape (6 b, L) [m].
    """

    ok: np.ndarray
    slot: np.ndarray
    ends: np.ndarray


@dataclass(frozen=True, eq=False)
class Joints:
    """A robot's joints at every state, on one wrist.

    Attributes:
        q: angles, shape (6, N, G) with the grid made flat [rad]; of joints that turn no more than once the one that
            is inside the limits, so that their differences are turns; of the others any.
        winding: whether a joint may turn more than once, shape (6,).
        ok: whether the joints that may not are inside their limits with the solvers' margin, shape (N, *grid).
    """

    q: np.ndarray
    winding: np.ndarray
    ok: np.ndarray

    def steps(self, k: int, here: np.ndarray, there: np.ndarray, j: int, ahead: int) -> np.ndarray:
        """Return how far joint k turns between states (flat) at seam points j and ahead [rad]; they broadcast."""
        turned = self.q[k, ahead][there] - self.q[k, j][here]
        return turned - TURN * np.round(turned / TURN) if self.winding[k] else turned

    def linked(self, bound: float, here: np.ndarray, there: np.ndarray, j: int, ahead: int) -> np.ndarray:
        """Return whether no joint turns farther than a bound [rad] between pairs of states, shape (P,)."""
        linked = np.ones(len(here), dtype=bool)
        for k in range(len(self.q)):
            left = np.flatnonzero(linked)
            linked[left] = np.abs(self.steps(k, here[left], there[left], j, ahead)) <= bound
        return linked


@dataclass(frozen=True, eq=False)
class Arm:
    """A station on one arm branch at every state.

    Attributes:
        owner: its bodies; ok says reach, singularity floor and clearance from workpiece and floor.
        w: manipulability, shape (N, *grid) [m^3].
        gram: det(J_v J_v^T), shape (N, *grid) [m^6], NaN where it was not looked at.
        wrists: its joints on every allowed wrist that makes a difference.
    """

    owner: Owner
    w: np.ndarray
    gram: np.ndarray
    wrists: list[Joints]


class Pointwise(Redundant):
    """The redundant form with the angles at the seam points themselves as variables."""

    @cached_property
    def coding(self) -> Coding:
        """How variables become placement and paths."""
        return Coding(self.cell.box, super().coding.angles, np.eye(self.controls))


@dataclass(frozen=True, eq=False)
class Lattice:
    """The states of a form's cell over a grid of its free angles; kernels are built once for all placements.

    Attributes:
        form: the redundant form.
        grids: values of every free angle, in the form's order [rad].
    """

    form: Redundant
    grids: tuple[np.ndarray, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of every free angle."""
        return tuple(len(grid) for grid in self.grids)

    @cached_property
    def pointwise(self) -> Pointwise:
        """The form that judges any paths of the free angles as the redundant form judges splines."""
        return Pointwise(self.form.batch, self.form.level, self.form.data.shape[1])

    def judged(self, x: np.ndarray, angles: np.ndarray) -> Evaluation:
        """Return what the exact model says of a placement (d,) and angles (f, N) [rad], on or off the grid."""
        return self.pointwise.evaluate(np.concatenate([x, angles.T.ravel()]))

    @cached_property
    def _grips(self) -> list[Kernel]:
        return [numpy_kernel(grip, ("candidate", "point", "number")) for grip in self.form.stage.grips]

    @cached_property
    def _limbs(self) -> list[Kernel]:
        return [numpy_kernel(limbs, ("candidate", "lane")) for limbs in self.form.stage.limbs]

    @cached_property
    def _work(self) -> Kernel:
        return numpy_kernel(self.form.stage.work, ("candidate", "point"))

    @cached_property
    def _meetings(self) -> dict[Owners, Meeting]:
        gap, shapes = lower(self.form.stage.gap), self.form.stage.shapes
        return {(a, b): Meeting.of(gap, pairs, shapes[a], shapes[b]) for (a, b), pairs in self.form.stage.pairs.items()}

    def _own(self, k: int) -> tuple[int, ...]:
        """Return the grid of the angles that move an owner, others of length 1."""
        stations = self.form.cell.stations
        name = stations[k].name if k < len(stations) else None
        moved = (angle.partition(".")[2] in ("", name) for angle in self.form.names)
        return tuple(n if moves else 1 for n, moves in zip(self.shape, moved, strict=True))

    def _points(self, own: tuple[int, ...]) -> np.ndarray:
        """Return the data of every seam point and value of an own grid, shape (k + f, N * G), points slowest."""
        data, count = self.form.data, int(np.prod(own))
        axes = [grid[:n] for grid, n in zip(self.grids, own, strict=True)]
        angles = np.array(np.meshgrid(*axes, indexing="ij")).reshape(len(own), count)
        return np.vstack([np.repeat(data, count, axis=1), np.tile(angles, data.shape[1])])

    def work(self, x: np.ndarray) -> Owner:
        """Return the workpiece, with what holds it, at a placement (d,)."""
        k, own = len(self.form.cell.stations), self._own(len(self.form.cell.stations))
        points = self._points(own)
        ends = np.concatenate([_columns(self._work(x[None], points[:, c])[0]) for c in _slices(points.shape[1])], 1)
        ok, slot = np.zeros(points.shape[1], dtype=bool), np.arange(points.shape[1])
        owner = Owner(ok, slot, ends)
        ok[:] = self._above_floor(k, ends)
        return _shaped(owner, (-1, *own))

    def arm(self, k: int, x: np.ndarray, branch: tuple[str, str], work: Owner) -> Arm:
        """Return station k on an arm branch (shoulder, elbow) at a placement (d,)."""
        own = self._own(k)
        cos_sin, w, reach = self._gripped(k, x, branch, self._points(own))
        wrists = self._wrists(k, cos_sin, (-1, *own))
        ok = (reach >= 0.0) & (w >= self.form.cell.constraints.floor_at_points_m3)
        ok &= np.any([joints.ok.ravel() for joints in wrists], axis=0)
        kept, slot, gram = np.flatnonzero(ok), np.full(len(ok), -1), np.full(len(ok), np.nan)
        slot[kept] = np.arange(len(kept))
        ends = np.empty((6 * len(self.form.stage.shapes[k]), len(kept)))
        for c in _slices(len(kept)):
            gram[kept[c]], ends[:, c] = map(_columns, self._limbs[k](x[None], cos_sin[:, None, kept[c]]))
        ok[kept] = self._above_floor(k, ends)
        owner = _shaped(Owner(ok, slot, ends), (-1, *own))
        owner = Owner(self.apart(k, owner, len(self.form.cell.stations), work), owner.slot, ends)
        return Arm(owner, w.reshape(owner.ok.shape), gram.reshape(owner.ok.shape), wrists)

    def _gripped(self, k: int, x: np.ndarray, branch: tuple[str, str], points: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return cosines and sines of the noflip wrist (12, L), manipulability and reach (L,)."""
        signs = np.array([SHOULDER[branch[0]], ELBOW[branch[1]], 1.0])
        parts = [self._grips[k](x[None], points[:, c], signs) for c in _slices(points.shape[1])]
        cos_sin, w, reach = (np.concatenate([_columns(part[i]) for part in parts], axis=1) for i in range(3))
        return cos_sin, w[0], reach[0]

    def _wrists(self, k: int, cos_sin: np.ndarray, shape: tuple[int, ...]) -> list[Joints]:
        """Return the joints on the allowed wrists; one where the other is inside the limits just as often."""
        robot, N = self.form.cell.stations[k].robot, self.form.data.shape[1]
        q = np.arctan2(cos_sin[6:], cos_sin[:6]) - robot.dh[:, 3][:, None]
        need = np.radians(self.form.cell.constraints.joint_margin_deg)
        low, high = robot.limits_rad.T[:, :, None] + np.array([need, -need])[:, None, None]
        winding, found = (high - low >= TURN)[:, 0], []
        for wrist in allowed(self.form.cell.configuration.wrist, WRIST):
            turned = q if wrist == "noflip" else flip(robot, q)
            inside = np.where(winding[:, None], turned, low + np.mod(turned - low, TURN))
            ok = ((inside <= high) | winding[:, None]).all(axis=0)
            found.append(Joints(inside.reshape(6, N, -1), winding, ok.reshape(shape)))
        same = len(found) == 2 and winding[3] and winding[5] and (found[0].ok == found[1].ok).all()
        return found[:1] if same else found

    def _above_floor(self, k: int, ends: np.ndarray) -> np.ndarray:
        """Return whether an owner's bodies keep their clearance from the floor, shape (L,)."""
        concerned = [i for i, body in enumerate(self.form.stage.shapes[k]) if body.above_floor]
        low = boxes(ends[:, :, None], self.form.stage.shapes[k])[0, concerned, 2].min(axis=0, initial=np.inf)
        return low >= self.form.cell.constraints.clearance_at_points_m

    def apart(self, a: int, mine: Owner, b: int, other: Owner) -> np.ndarray:
        """Return where two owners are feasible and keep their clearance from each other, shape (N, *grid)."""
        level, shapes = self.form.cell.constraints.clearance_at_points_m, self.form.stage.shapes
        ok = mine.ok & other.ok
        p, q = (np.broadcast_to(owner.slot, ok.shape)[ok] for owner in (mine, other))
        apart = np.ones(len(p), dtype=bool)
        for c in _slices(len(p)):
            here, there = mine.ends[:, p[c], None], other.ends[:, q[c], None]
            lowest = self._meetings[a, b].lowest(here, boxes(here, shapes[a]), there, boxes(there, shapes[b]), level)
            apart[c] = lowest >= level
        ok[ok] = apart
        return ok

    def values(self, arms: Sequence[Arm], clear: np.ndarray) -> np.ndarray:
        """Return the objective of every state, -inf where it is not feasible, shape (N, *grid).

        Args:
            arms: of every station.
            clear: whether the robots keep their clearance from each other, broadcasts to (N, *grid).
        """
        cell = self.form.cell
        with np.errstate(all="ignore"):  # without a floor, w and gram may be zero
            value = mmr(cell.objective.reading, [arm.w for arm in arms], [arm.gram for arm in arms], cell.tight)
        ok = clear & np.isfinite(value)
        for arm in arms:
            ok = ok & arm.owner.ok
        return np.broadcast_to(np.where(ok, value, -np.inf), (self.form.data.shape[1], *self.shape))

    def states(self, k: int) -> np.ndarray:
        """Return for every state of the whole grid that of station k's own grid, both flat, shape (G,)."""
        own = self._own(k)
        return np.broadcast_to(np.arange(np.prod(own)).reshape(own), self.shape).ravel()

    def rows(self, states: np.ndarray) -> np.ndarray:
        """Return the place in the grid of flat states (n,), one row each, shape (n, f)."""
        return np.stack(np.unravel_index(states, self.shape), axis=-1)

    def angles(self, states: np.ndarray) -> np.ndarray:
        """Return the free angles of flat states (n,), shape (f, n) [rad]."""
        return np.array([grid[i] for grid, i in zip(self.grids, self.rows(states).T, strict=True)])

    def choices(self, arms: Sequence[Arm]) -> Iterator[tuple[Joints, ...]]:
        """Yield the joints of all stations for every choice of wrists."""
        return product(*(arm.wrists for arm in arms))


def _slices(count: int) -> Iterator[slice]:
    return (slice(start, min(start + CHUNK, count)) for start in range(0, count, CHUNK))


def _columns(lanes: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Return lanes of one candidate (1, L) as rows, shape (n, L)."""
    return np.array([lane[0] for lane in lanes])


def _shaped(owner: Owner, shape: tuple[int, ...]) -> Owner:
    return Owner(owner.ok.reshape(shape), owner.slot.reshape(shape), owner.ends)
