"""The full-space form: the placement's coordinates and every joint at every seam point are variables.

Nothing is inverted: that each chain closes on the weld is an equality at every seam point, and joint limits are bounds.
The problem is large but sparse, for seam points share nothing but the placement, so work grows in proportion to them.

Variables are the placement's coordinates [m; rad], then seam point after seam point the joints of all stations in
their order [rad], in DH direction, and the point's free angles, if any (:mod:`~.full_redundant`). A positioner is the
master: its joints follow from the seam alone and are none, but where free angles tilt the weld by them.
Where the objective over the seam is not the mean, a level of MMR that all points share comes after the placement; it
serves the descent alone.

Branches are no choice here: shoulder, elbow and wrist are the signs of the three factors of |det J|, which a descent
inherits from its start. Changing one means to pass |det J| = 0, and the penalty under the singularity floor stands
before that. It is a penalty at the seam's points, not a wall, so the exact model counts points on a wrong side.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.cell.robot import Robot
from nlpweld.errors import OptionError
from nlpweld.formulation.arrow import Arrow, Steps, arrow_relaxation
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.freedom import FreeAngle, free_angles
from nlpweld.formulation.holder import held
from nlpweld.formulation.margins import with_margins
from nlpweld.formulation.nlp import Evaluation, Nlp, Relaxation, sobol
from nlpweld.formulation.over_seam import over_seam
from nlpweld.formulation.paths import Limits, allowed, best_wrist, joint_paths, limit_margins, on_wrist, settle
from nlpweld.formulation.seam_point import LEVER_M, SeamPoint, closure_function, facts_function, full_term, moved
from nlpweld.formulation.sides import Sides
from nlpweld.formulation.smooth import Gaps, all_gaps, near_gaps
from nlpweld.formulation.stage import GAP_SCALE_M, Stage
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.ik import WRIST, signs
from nlpweld.kinematics.manipulability import magnitude
from nlpweld.plan import Plan

CONSTRAINTS = ("closure", "continuity", "branch", "joint_limit", "singularity", "clearance")
CLOSED = 1e-7  # by how much a chain may be open at a point [m; rad]; a tenth of what the verifier allows
HAIR = 1e-9  # by which bounds of joints lie inside their limits, so that rounding keeps the margin [rad]
LEVELS = (1e-3, 1e3)  # bounds of a level, which is of order one
SCOUTS = 256  # random placements of which the best are started from
NEAREST = 32  # scouts that tell which bodies come near each other
NEAR_M = 0.2  # and what is near


def full(cell: Cell, engine: str = "auto") -> Nlp:
    """Return the full-space form of a cell.

    Args:
        cell: the cell.
        engine: ``numpy``, ``numba``, ``c`` or ``auto``, of the scouts; ``c`` compiles the derivatives too, all others
            leave them to CasADi's own machine.

    Raises:
        KinematicsError: a robot has no closed-form inverse, which starts and |det J| need.
    """
    form, again = Full(Batch(cell, engine)), partial(full, cell, engine)
    return form.nlp("full", lambda extra: full(with_margins(cell, extra), engine), again)


def full_start(plan: Plan, level: str | None = None) -> np.ndarray:
    """Return the variables (n,) of a plan of any solver; its points are taken to be its cell's.

    Args:
        plan: the plan.
        level: what the form leaves free, a key of :data:`~.freedom.LEVELS`, or None; what the plan does not name is
            nominal.

    Raises:
        OptionError: the plan turns an angle that the form does not free, so that no chain would close.
    """
    names = [angle.name for angle in free_angles(plan.cell, level)] if level else []
    freedom = plan.freedom or {}
    for name, offsets in freedom.items():
        if name not in names and np.any(offsets):
            raise OptionError(f"the plan turns {name}, which the form does not free; take a level that does")
    angles = [freedom.get(name, np.zeros(len(plan.s)))[:, None] for name in names]
    robots, every = (np.hstack([plan.paths[n] for n in moved(plan.cell, free)]) for free in ((), tuple(names)))
    x, plain = plan.cell.coordinates(plan.placement), Full(Batch(plan.cell, "numpy"))
    shared = plain.with_level(x, robots.ravel())[: plain.arrow.shared]
    return np.concatenate([shared, np.hstack([every, *angles]).ravel()])


@dataclass(frozen=True)
class Full:
    """What a full-space form is made of; S stations, N seam points.

    Attributes:
        batch: the exact model of the reduced form, which tells where placements are feasible.
    """

    batch: Batch

    @property
    def cell(self) -> Cell:
        """The cell."""
        return self.batch.cell

    @property
    def stage(self) -> Stage:
        """The graphs."""
        return self.batch.stage

    @property
    def data(self) -> np.ndarray:
        """What is known of the seam points, shape (k, N)."""
        return self.batch.points

    @property
    def angles(self) -> tuple[FreeAngle, ...]:
        """What is free at every seam point besides the joints."""
        return ()

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of what the exact model looks at."""
        return CONSTRAINTS

    @property
    def steps(self) -> Steps | None:
        """What joint steps from point to point cost in the relaxation."""
        return None

    @cached_property
    def point(self) -> SeamPoint:
        """Expressions of one seam point."""
        return SeamPoint(self.stage)

    @cached_property
    def arrow(self) -> Arrow:
        """How variables are ordered."""
        return Arrow(len(self.cell.variables) + self.point.levels, self.point.own, self.data)

    @property
    def sides(self) -> Sides:
        """How branches are read off joints."""
        return Sides(self.cell.configuration, self.batch.modes)

    @cached_property
    def facts(self) -> ca.Function:
        """What the exact model looks at, at one seam point."""
        return facts_function(self.point, all_gaps(self.stage))

    @property
    def bounds(self) -> np.ndarray:
        """Bounds of all variables, shape (2, n): the placement's box, joint limits less the solvers' margin, bands."""
        bands = np.array([[a.lower, a.upper] for a in self.angles]).reshape(-1, 2).T
        level = np.tile(LEVELS, (self.point.levels, 1)).T
        own = np.dstack([self.limits + np.reshape([HAIR, -HAIR], (2, 1, 1)), self._at_all_points(bands)])
        return np.hstack([self.cell.box, level, own.reshape(2, -1)])

    @property
    def limits(self) -> np.ndarray:
        """Joint limits less the solvers' margin at every seam point, shape (2, N, joints) [rad]."""
        need = np.radians(self.cell.constraints.joint_margin_deg)
        limits = np.hstack([s.robot.limits_rad.T for s in self.cell.stations])
        return self._at_all_points(limits + np.array([[need], [-need]]))

    def _at_all_points(self, pair: np.ndarray) -> np.ndarray:
        return np.repeat(pair[:, None], self.arrow.points, axis=1)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all variables."""
        joints = [f"{name}.J{i + 1}" for name, robot in self.point.moved.items() for i in range(len(robot.joints))]
        own = joints + [angle.name for angle in self.angles]
        shared = (*self.cell.variables, *["level"] * self.point.levels)
        return (*shared, *(f"{name}[{j}]_rad" for j in range(self.arrow.points) for name in own))

    def nlp(self, formulation: str, widened: Callable[[dict[str, float]], Nlp], rebuild: Callable[[], Nlp]) -> Nlp:
        """Return the form as solvers see it, by its name, how margins grow, and how another process builds it."""
        lower, upper = self.bounds
        return Nlp(
            problem=self.cell.name,
            formulation=formulation,
            names=self.names,
            lower=lower,
            upper=upper,
            constraints=self.constraints,
            evaluate=self.evaluate,
            unpack=self.unpack,
            relax=self.relax,
            n_modes=len(self.batch.modes),
            widened=widened,
            sample=self.starts,
            prepare=self.prepare,
            rebuild=rebuild,
        )

    def prepare(self) -> None:
        """Build and compile what ``evaluate`` and the scouts need."""
        self.batch.prepare()
        self.evaluate(self.bounds.mean(axis=0)[None])

    def joints(self, Z: np.ndarray) -> np.ndarray:
        """Return joint paths of candidates Z (m, n), shape (m, joints, N) [rad]."""
        own = Z[:, self.arrow.shared :].reshape(len(Z), self.arrow.points, self.arrow.own)
        return own[..., : self.point.joints].transpose(0, 2, 1)

    def _each(self, q: np.ndarray) -> Iterator[tuple[str, Robot, np.ndarray]]:
        """Yield name, robot and joints of whatever has some, from the paths of all joints (m, joints, M)."""
        first = 0
        for name, robot in self.point.moved.items():
            yield name, robot, q[:, first : first + len(robot.joints)]
            first += len(robot.joints)

    def evaluate(self, Z: np.ndarray) -> Evaluation:
        """Return objective, violations and mode of candidates Z, shape (m, n)."""
        Z = np.atleast_2d(np.asarray(Z, dtype=float))
        offset, turn, factors, w, mmr, gap = self._judged(Z)
        levels, q = self.cell.constraints, self.joints(Z)
        open_by = np.dstack([offset / LEVER_M, turn]).max(axis=(1, 2))
        floor, margin = levels.floor_at_points_m3, np.radians(levels.joint_margin_deg)
        step, limit = self._path(q)
        missed = self._missed_steps(step) | {
            "closure": open_by - CLOSED,
            "branch": self.sides.astray(factors),
            "joint_limit": (margin - limit) / np.pi,
            "singularity": (floor - w.min(axis=(1, 2))) / (floor or 1.0),
            "clearance": (levels.clearance_at_points_m - gap.min(axis=(1, 2))) / GAP_SCALE_M,
        }
        value = over_seam(self.cell.objective, mmr[..., 0])
        violation = np.maximum(0.0, np.column_stack([missed[name] for name in self.constraints]))
        return Evaluation(np.where(np.isfinite(value), value, -np.inf), violation, self.sides.mode(factors))

    def _missed_steps(self, longest: np.ndarray) -> dict[str, np.ndarray]:
        """Return by how many half turns joints' longest steps (m,) [rad] are too long."""
        return {"continuity": (longest - np.pi) / np.pi}

    def _judged(self, Z: np.ndarray) -> list[np.ndarray]:
        """Return the facts of every candidate, each of shape (m, N, entries); factors station by station."""
        m, n, d = len(Z), self.arrow.points, self.arrow.shared
        Y = np.hstack([np.repeat(Z[:, :d], n, axis=0), Z[:, d:].reshape(m * n, -1)])
        found = self.facts.map(m * n)(Y.T, np.tile(self.data, m))
        return [np.array(fact).T.reshape(m, n, -1) for fact in found]

    def _settled(self, q: np.ndarray) -> np.ndarray:
        """Return joint paths (m, joints, N) [rad], shifted by whole turns if they must, a closed one's way back added.

        A joint that winds once about a closed seam ends a turn away from where it began, which no bound of a variable
        says. What is the same but for whole turns is one answer, so exact model and plan choose the turn alike.
        """
        if self.cell.seam.closed:
            back = q[..., -1:] + (q[..., :1] - q[..., -1:] + np.pi) % (2 * np.pi) - np.pi
            q = np.concatenate([q, back], axis=-1)
        need = np.radians(self.cell.constraints.joint_margin_deg)
        return np.hstack([settle(robot, own, need) for _, robot, own in self._each(q)])

    def _path(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return longest step and least margin to a limit of joint paths, (m,) [rad], the way back included."""
        settled = self._settled(q)
        margins = [limit_margins(robot, own).min(axis=1) for _, robot, own in self._each(settled)]
        return np.abs(np.diff(settled, axis=-1)).max(axis=(1, 2)), np.min(margins, axis=0)

    def unpack(self, z: np.ndarray, mode: int) -> Plan:
        """Return the plan of variables z (n,); its branches are those z is on, whatever the mode."""
        cell, z = self.cell, np.asarray(z, dtype=float)
        x = z[: len(cell.variables)]
        s, placement = seam_parameters(cell), cell.placement(x)
        q = self._settled(self.joints(z[None]))[..., : self.arrow.points]
        paths = {name: own[0].T for name, _, own in self._each(q)}
        turned = held(cell, s).q
        if cell.positioner and turned is not None:
            paths.setdefault(cell.positioner.name, turned)
        found = self.sides.branches(self._judged(z[None])[2])[0]
        branches = {st.name: (b[0], b[1], b[2]) for st, b in zip(cell.stations, found, strict=True)}
        return Plan(cell.laid_out(x), placement[:3], s, paths, branches, float(placement[3]))

    def starts(self, seed: int, count: int) -> np.ndarray:
        """Return the best of some random placements, with joints by inverse kinematics on their best modes, (count, n).

        Out of reach, arms point at their target, so that their chains are open.
        """
        X, found = self._scouted(seed, max(SCOUTS, count))
        best = np.lexsort((-found.objective, found.total))[:count]
        return np.array([self.start(X[i], int(found.mode[i])) for i in best])

    def start(self, x: np.ndarray, mode: int, angles: np.ndarray | None = None) -> np.ndarray:
        """Return variables (n,) of a placement (d,), with joints on a mode's branches and angles (f, N) or nominal."""
        u = np.zeros((len(self.angles), self.arrow.points)) if angles is None else angles
        points = np.vstack([self.data, u])
        return self.with_level(x, np.vstack([self._inverses(x, mode, points), u]).T.ravel())

    def _inverses(self, x: np.ndarray, mode: int, points: np.ndarray) -> np.ndarray:
        """Return joint paths (joints, N) [rad] at a placement (d,) on a mode's branches, for data with free angles."""
        return np.vstack([self._inverse(k, x, points, branch) for k, branch in enumerate(self.batch.modes[mode])])

    def with_level(self, x: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return variables (n,) of a placement (d,) and the points' own (N * own,), with their level if any."""
        if not self.point.levels:
            return np.concatenate([x, own])
        z = np.concatenate([x, [1.0], own])
        value = over_seam(self.cell.objective, self._judged(z[None])[4][..., 0])[0]
        z[len(x)] = np.clip(value / magnitude(self.cell.objective.reading, self.cell.tight), *LEVELS)
        return z

    def _scouted(self, seed: int, count: int) -> tuple[np.ndarray, Evaluation]:
        X = sobol(self.cell.box[0], self.cell.box[1], seed, count)
        return X, self.batch.evaluate(X)

    def _inverse(self, k: int, x: np.ndarray, points: np.ndarray, branch: tuple[str, str]) -> np.ndarray:
        """Return station k's joint paths, shape (6, N) [rad].

        They are unwrapped, on a wrist that keeps the joint margin if there is one, and as far inside the limits as
        whole turns bring them.
        """
        n, robot, closed = self.arrow.points, self.cell.stations[k].robot, self.cell.seam.closed
        side = np.reshape(signs((*branch, "noflip")), (3, 1))
        out = self.stage.grips[k].map(n)(np.tile(x[:, None], n), points, np.tile(side, n))[0]
        lanes = np.array(out).reshape(-1, n, 2).transpose(2, 0, 1).reshape(-1, 1, n)
        wrists, need = allowed(self.cell.configuration.wrist, WRIST), np.radians(self.cell.constraints.joint_margin_deg)
        wrist = wrists[best_wrist(Limits.of(robot, closed), lanes, wrists, need)[1][0]]
        return settle(robot, on_wrist(robot, joint_paths(robot, lanes, closed), wrist), np.inf)[0, :, :n]

    def relax(self, mode: int, whole: bool = False) -> Relaxation:
        """Return the relaxation, with every distance if whole, else with those that fall near at a mode's scouts."""
        gaps = all_gaps(self.stage) if whole else self._near(mode)
        term = full_term(self.point, gaps, self.arrow.points)
        return arrow_relaxation(term, closure_function(self.point), self.arrow, self.batch.chosen_engine, self.steps)

    def _near(self, mode: int) -> Gaps:
        """Return the distances that fall below a bound at the best scouts of a mode; all, if it has none."""
        X, found = self._scouted(0, SCOUTS)
        order = np.lexsort((-found.objective, found.total))
        X = X[[i for i in order if np.isfinite(found.objective[i]) and found.mode[i] == mode][:NEAREST]]
        if len(X) == 0:
            return all_gaps(self.stage)
        return near_gaps(self.stage, self.batch.modes[mode], X, self.data, NEAR_M)
