"""Sums over seam points whose variables are shared ones and each point's own: arrow-shaped, sparse derivatives.

A point's function is differentiated once, symbolically, in its few variables, and mapped over the points. What comes
out is scattered into one sparse matrix, whose only full rows and columns are those of the shared variables. So
evaluation, memory and factorisation grow in proportion to the number of points. What neighbouring points may differ by
adds entries between a variable and the same of the next point, and as few.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.engine.c_functions import compiled
from nlpweld.formulation.nlp import Equalities, Relaxation


@dataclass(frozen=True, eq=False)
class Arrow:
    """Where each point's variables are among all of them: the shared ones first, then point after point.

    Attributes:
        shared: number of variables that all points share, d.
        own: number of variables of one point, w.
        data: what is known of every point, shape (k, N).
    """

    shared: int
    own: int
    data: np.ndarray

    @property
    def points(self) -> int:
        """Number of points, N."""
        return int(self.data.shape[1])

    @property
    def size(self) -> int:
        """Number of all variables, n = d + w N."""
        return self.shared + self.own * self.points

    def local(self, z: ca.MX) -> ca.MX:
        """Return each point's variables, the shared ones on top, shape (d + w, N)."""
        own = ca.reshape(z[self.shared :], self.own, self.points)
        return ca.vertcat(ca.repmat(z[: self.shared], 1, self.points), own)

    def placed(self, index: np.ndarray) -> np.ndarray:
        """Return where a point's variables (m,) are among all, for every point, shape (N, m)."""
        return np.where(index < self.shared, index, index + self.own * np.arange(self.points)[:, None])


@dataclass(frozen=True, eq=False)
class Steps:
    """A cost of how far each of some variables goes from one point to the next.

    Attributes:
        cost: ``(difference, sharpness) -> scalar``, of one variable.
        count: the first so many of a point's own variables.
        closed: whether the last point is followed by the first.
    """

    cost: ca.Function
    count: int
    closed: bool

    def differences(self, arrow: Arrow) -> ca.DM:
        """Return the sparse matrix (m, n) that takes all variables to their steps, point by point."""
        here = arrow.placed(arrow.shared + np.arange(self.count))
        ahead = np.roll(here, -1, axis=0)
        ends = [place[: None if self.closed else -1].ravel() for place in (here, ahead)]
        rows, m = np.tile(np.arange(len(ends[0])), 2).tolist(), len(ends[0])
        signs = np.repeat([-1.0, 1.0], m)
        return ca.DM.triplet(rows, np.concatenate(ends).tolist(), ca.DM(signs), m, arrow.size)


def arrow_relaxation(
    term: ca.Function, closure: ca.Function, arrow: Arrow, engine: str = "numpy", steps: Steps | None = None
) -> Relaxation:
    """Return ``sum_j term(y_j, point_j, sharpness)`` under ``closure(y_j, point_j) == 0``, with sparse derivatives.

    Args:
        term: ``(y (d + w), point, sharpness) -> scalar``.
        closure: ``(y, point) -> (m, 1)``.
        arrow: how the y_j make up all variables.
        engine: ``c`` compiles what CasADi differentiates; all others run it in CasADi's own machine.
        steps: what the steps from point to point cost besides, if anything.
    """
    z, p, lam_f = ca.MX.sym("z", arrow.size), ca.MX.sym("sharpness"), ca.MX.sym("lam_f")
    lam_g = ca.MX.sym("lam_g", closure.numel_out(0) * arrow.points)
    slope, jacobian, curve = _derivatives(term, closure)
    cost, inclined, bent = _stepped(steps, arrow, z, p)
    alone = _curvature(curve, arrow, z, p, ca.MX(1), ca.MX.zeros(lam_g.numel())) + bent
    hessian = _curvature(curve, arrow, z, p, lam_f, lam_g) + lam_f * bent
    functions = [
        ca.Function("value", [z, p], [ca.sum2(_mapped(term, arrow, z, p)) + cost]),
        ca.Function("gradient", [z, p], [_gradient(slope, arrow, z, p) + inclined]),
        ca.Function("hessian", [z, p], [ca.triu2symm(alone)]),
        ca.Function("closure", [z], [ca.vec(_mapped(closure, arrow, z))]),
        ca.Function("jacobian", [z], [_jacobian(jacobian, closure, arrow, z)]),
        ca.Function("lagrangian", [z, p, lam_f, lam_g], [hessian]),
    ]
    value, gradient, whole, *equalities = compiled(functions) if engine == "c" else functions
    return Relaxation(value, gradient, whole, Equalities(*equalities))


@dataclass(frozen=True, eq=False)
class Entries:
    """Nonzero entries of one point's matrix as a function, and where they are."""

    function: ca.Function
    rows: np.ndarray
    columns: np.ndarray


def _derivatives(term: ca.Function, closure: ca.Function) -> tuple[ca.Function, Entries, Entries]:
    """Return one point's gradient of the term, Jacobian of the closure, and upper Hessian of its Lagrangian."""
    y, point, p = (ca.SX.sym(term.name_in(i), *term.size_in(i)) for i in range(3))
    g, lam_f = closure(y, point), ca.SX.sym("lam_f")
    lam_g = ca.SX.sym("lam_g", g.numel())
    value = term(y, point, p)
    slope = ca.Function("slope", [y, point, p], [ca.densify(ca.gradient(value, y))], {"cse": True})
    curve = ca.triu(ca.hessian(lam_f * value + ca.dot(lam_g, g), y)[0])
    return (
        slope,
        _entries("closure_jacobian", [y, point], ca.jacobian(g, y)),
        _entries("curve", [y, point, p, lam_f, lam_g], curve),
    )


def _entries(name: str, inputs: list[ca.SX], matrix: ca.SX) -> Entries:
    rows, columns = matrix.sparsity().get_triplet()
    return Entries(ca.Function(name, inputs, [matrix.nz[:]], {"cse": True}), np.array(rows), np.array(columns))


def _mapped(function: ca.Function, arrow: Arrow, z: ca.MX, *others: ca.MX) -> ca.MX:
    """Return a point's function at every point, side by side; what is the same for all points is repeated."""
    n = arrow.points
    given = [ca.repmat(other, 1, n) if other.shape[1] == 1 else other for other in others]
    return function.map(n)(arrow.local(z), ca.DM(arrow.data), *given)


def _gradient(slope: ca.Function, arrow: Arrow, z: ca.MX, p: ca.MX) -> ca.MX:
    columns = _mapped(slope, arrow, z, p)
    return ca.vertcat(ca.sum2(columns[: arrow.shared, :]), ca.vec(columns[arrow.shared :, :]))


def _jacobian(jacobian: Entries, closure: ca.Function, arrow: Arrow, z: ca.MX) -> ca.MX:
    m = closure.numel_out(0)
    rows = jacobian.rows + m * np.arange(arrow.points)[:, None]
    values = ca.vec(_mapped(jacobian.function, arrow, z))
    return _sparse((m * arrow.points, arrow.size), rows.ravel(), arrow.placed(jacobian.columns).ravel(), values)


def _curvature(curve: Entries, arrow: Arrow, z: ca.MX, p: ca.MX, lam_f: ca.MX, lam_g: ca.MX) -> ca.MX:
    """Return the upper triangle of the Hessian of ``lam_f * value + lam_g^T closure``, (n, n) sparse."""
    values = _mapped(curve.function, arrow, z, p, lam_f, ca.reshape(lam_g, -1, arrow.points))
    shared = np.flatnonzero(np.maximum(curve.rows, curve.columns) < arrow.shared)
    own = np.setdiff1d(np.arange(len(curve.rows)), shared)
    rows = np.concatenate([curve.rows[shared], arrow.placed(curve.rows[own]).ravel()])
    columns = np.concatenate([curve.columns[shared], arrow.placed(curve.columns[own]).ravel()])
    summed, scattered = ca.sum2(values[shared.tolist(), :]), ca.vec(values[own.tolist(), :])
    return _sparse((arrow.size, arrow.size), rows, columns, ca.vertcat(summed, scattered))


def _stepped(steps: Steps | None, arrow: Arrow, z: ca.MX, p: ca.MX) -> tuple[ca.MX, ca.MX, ca.MX]:
    """Return what all steps cost, its gradient (n, 1), and the upper triangle of its Hessian (n, n), sparse."""
    if steps is None:
        return ca.MX(1, 1), ca.MX(arrow.size, 1), ca.MX(arrow.size, arrow.size)
    one, sharpness = (ca.SX.sym(steps.cost.name_in(i)) for i in range(2))
    curve, slope = ca.hessian(steps.cost(one, sharpness), one)
    jet = ca.Function("step", [one, sharpness], [steps.cost(one, sharpness), slope, curve], {"cse": True})
    D = ca.MX(steps.differences(arrow))
    m = D.shape[0]
    cost, slopes, curves = jet.map(m)((D @ z).T, ca.repmat(p, 1, m))
    return ca.sum2(cost), D.T @ slopes.T, ca.triu(D.T @ (ca.diag(curves.T) @ D))


def _sparse(shape: tuple[int, int], rows: np.ndarray, columns: np.ndarray, values: ca.MX) -> ca.MX:
    """Return a sparse matrix of values at places that do not repeat."""
    order = np.lexsort((rows, columns))
    pattern = ca.Sparsity.triplet(*shape, rows[order].tolist(), columns[order].tolist())
    return ca.MX(pattern, values[order.tolist()])
