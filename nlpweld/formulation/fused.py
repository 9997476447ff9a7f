"""The exact model on Numba: a cell's kernels and the loops of :mod:`~.candidate`, compiled as one module."""

import inspect
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.cell.cell import Cell
from nlpweld.engine.lanes import Kinds
from nlpweld.engine.numba_kernels import INNER, JIT, kernel_source, load
from nlpweld.formulation import candidate
from nlpweld.formulation.facts import Facts, Scratch
from nlpweld.formulation.nlp import Evaluation
from nlpweld.formulation.paths import allowed
from nlpweld.formulation.stage import GAP_SCALE_M, Stage
from nlpweld.formulation.staged import NEAR
from nlpweld.kinematics.ik import ELBOW, SHOULDER, WRIST
from nlpweld.kinematics.manipulability import mmr

STEPS: tuple[Callable[..., Any], ...] = (
    candidate.least,
    candidate.greatest,
    candidate.lowest_end,
    candidate.any_near,
    candidate.axes_near,
    candidate.rank,
    candidate.middles,
    candidate.angle,
    candidate.joint_range,
    candidate.margin,
    candidate.missed_joints,
    candidate.lowest_gap,
    candidate.lowest_height,
    candidate.missed_gap,
    candidate.gripped,
    candidate.missed_alone,
    candidate.placed_work,
    candidate.placed_limbs,
    candidate.sides,
    candidate.missed_together,
    candidate.seam_value,
    candidate.missed_by,
    candidate.judge,
)
# what is compiled is kept under its text, and knows the types it was given by name: so the text names them too
TYPES = "".join(f"# {t.__module__}.{t.__name__}: {', '.join(t._fields)}\n" for t in (Facts, Scratch))
HEAD = """from math import atan2, copysign, cos, floor, inf, isfinite, isnan, nan, pi, sin, sqrt

import numba
import numpy as np

N = {n}
CLOSED = {closed}
NEAR = {near!r}
GAP_SCALE_M = {scale!r}
EXPONENT = {exponent!r}
"""
OVER_SEAM: dict[str, tuple[Callable[..., Any], ...]] = {
    "mean": (candidate.seam_mean,),
    "minimum": (candidate.seam_minimum,),
    "soft_minimum": (candidate.seam_minimum, candidate.seam_soft_minimum),
}  # the last of them is the one, the others are what it calls


@dataclass(frozen=True)
class Fused:
    """Judges candidates one by one in compiled code; what :class:`~.staged.Staged` says, for long lists of them.

    Attributes:
        cell: the cell.
        stage: its graphs.
        points: the data of every seam point, shape (d, N).
        arm_branches: the (shoulder, elbow) pairs the cell allows.
    """

    cell: Cell
    stage: Stage
    points: np.ndarray
    arm_branches: list[tuple[str, str]]

    def at(self, points: np.ndarray, only: int = -1) -> "Fused":
        """Return the same over other data of as many seam points, shape (d, N); what is built is kept.

        Args:
            points: the data.
            only: the mode, or negative for all.
        """
        facts, _, _ = self._facts, self._judge, self._scratch  # built before the copy, which shares them
        other = copy(self)
        object.__setattr__(other, "points", points)
        vars(other)["_facts"] = facts._replace(points=points.ravel(), only=only)
        return other

    def evaluate(self, X: np.ndarray) -> Evaluation:
        """Return objective, violations and best mode of placements X, shape (m, d)."""
        m = len(X)
        found = Evaluation(np.empty(m), np.empty((m, 4)), np.empty(m, dtype=int))
        X = np.ascontiguousarray(X)
        self._judge(X, self._facts, self._scratch, found.objective, found.violation, found.mode)
        return found

    @cached_property
    def _judge(self) -> Any:
        return load(source(self.stage, self.points.shape[1])).judge

    @cached_property
    def _facts(self) -> Facts:
        cell, level = self.cell, self.cell.constraints
        robots = [station.robot for station in cell.stations]
        meetings = [(owners, pairs) for owners, pairs in self.stage.pairs.items() if pairs]
        flat = [(a, i, b, j) for (a, b), pairs in meetings for i, j in pairs]
        shapes = self.stage.shapes
        both = [(shapes[a][i], shapes[b][j]) for a, i, b, j in flat]
        floors = [(k, i, s.radius_m) for k, own in enumerate(shapes) for i, s in enumerate(own) if s.above_floor]
        return Facts(
            points=self.points.ravel(),
            only=-1,
            signs=np.array([[SHOULDER[s], ELBOW[e], 1.0] for s, e in self.arm_branches]),
            joints=np.array([[*robot.limits_rad.T, robot.dh[:, 3]] for robot in robots]),
            wrists=np.array([name in allowed(cell.configuration.wrist, WRIST) for name in ("noflip", "flip")]),
            levels=np.array(
                [np.radians(level.joint_margin_deg), level.floor_at_points_m3, level.clearance_at_points_m]
            ),
            owners=np.array([owners for owners, _ in meetings], dtype=int).reshape(-1, 2),
            first=np.cumsum([0, *(len(pairs) for _, pairs in meetings)]),
            bodies=np.array([(i, j) for _, i, _, j in flat], dtype=int).reshape(-1, 2),
            counts=np.array([len(own) for own in shapes]),
            numbers=np.array([(p.sq_length, q.sq_length, p.radius_m + q.radius_m) for p, q in both]).reshape(-1, 3),
            halves=np.array([(np.sqrt(p.sq_length) + np.sqrt(q.sq_length)) / 2 for p, q in both]),
            floors=np.array(floors, dtype=float).reshape(-1, 3),
        )

    @cached_property
    def _scratch(self) -> Scratch:
        facts, n = self._facts, self.points.shape[1]
        s, b, bodies = len(facts.joints), len(facts.signs), max(len(own) for own in self.stage.shapes)
        return Scratch(
            cos_sin=np.zeros(2 * facts.joints.shape[2] * n),
            spare=np.zeros(n),
            w=np.zeros((s, b, n)),
            gram=np.zeros((s, b, n)),
            ends=np.zeros((s + 1, b, 6 * bodies * n)),
            middles=np.zeros((s + 1, b, 3 * bodies * n)),
            missed=np.zeros((s, b, 4)),
            seen=np.zeros((s, b), dtype=bool),
            known=np.zeros((len(facts.owners), b, b)),
            w_chosen=np.zeros(s * n),
            gram_chosen=np.zeros(s * n),
            choice=np.zeros(s, dtype=int),
            total=np.zeros(4),
        )


def source(stage: Stage, n: int) -> str:
    """Return the source text of the module that judges a cell's candidates at n seam points."""
    kernels: dict[str, tuple[ca.Function, Kinds]]
    kernels = {f"grip_{k}": (f, ("candidate", "point", "number")) for k, f in enumerate(stage.grips)}
    kernels |= {f"limbs_{k}": (f, ("candidate", "lane", "point")[: f.n_in()]) for k, f in enumerate(stage.limbs)}
    kernels["work"] = stage.work, ("candidate", "point")
    kernels["gap"] = stage.gap, ("lane", "lane", "number")
    kernels["value"] = value_graph(stage.cell), ("lane", "lane")
    closed, objective = stage.cell.seam.closed, stage.cell.objective
    numbers = {"n": n, "closed": closed, "near": NEAR, "scale": GAP_SCALE_M, "exponent": objective.exponent}
    parts = [TYPES + HEAD.format(**numbers)]
    parts += [INNER + kernel_source(f, kinds, n, name) for name, (f, kinds) in kernels.items()]
    stations = range(len(stage.grips))
    parts.append(_switch("grip", "x, points, signs, cos_sin, w, reach", stations))
    parts.append(_switch("limbs", "x, cos_sin, points, gram, ends", stations, "" if stage.errors else "points, "))
    chosen = OVER_SEAM[objective.over_seam]
    parts += [(JIT if f is candidate.judge else INNER) + inspect.getsource(f) for f in (*chosen, *STEPS)]
    parts.append(f"over_seam = {chosen[-1].__name__}\n")
    return "\n\n".join(parts)


def _switch(name: str, arguments: str, stations: range, dropped: str = "") -> str:
    """Return the source of a function that calls station k's kernel for one candidate, less an argument perhaps."""
    lines = [f"def {name}(k, {arguments}):"]
    for k in stations:
        lines += [f"    if k == {k}:", f"        {name}_{k}(1, {arguments.replace(dropped, '')})"]
    return INNER + "\n".join(lines) + "\n"


def value_graph(cell: Cell) -> ca.Function:
    """Return ``(w, gram) -> value``, the objective at one seam point, from the columns of all stations."""
    count = len(cell.stations)
    w, gram = ca.SX.sym("w", count), ca.SX.sym("gram", count)
    value = mmr(cell.objective.reading, ca.vertsplit(w), ca.vertsplit(gram), cell.tight)
    return ca.Function("value", [w, gram], [value], {"cse": True})
