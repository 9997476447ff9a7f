"""Ways to differentiate a sum over seam points: CasADi's graphs, in its machine or in C, or jets on Numba."""

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from nlpweld.engine.c_functions import compiled
from nlpweld.formulation.coded import Lanes
from nlpweld.formulation.nlp import Relaxation


def by_casadi(term: ca.Function, points: np.ndarray) -> Relaxation:
    """Return value, gradient and Hessian of ``sum_j term(x, point_j, sharpness)`` as CasADi functions.

    The Hessian is built once for a single seam point and mapped, which keeps the graph small.
    """
    x, point, sharpness = (ca.SX.sym(term.name_in(i), *term.size_in(i)) for i in range(3))
    value = term(x, point, sharpness)
    hessian, gradient = ca.hessian(value, x)
    outputs = {"value": value, "gradient": gradient, "hessian": ca.densify(hessian)}
    data = ca.DM(points)
    return Relaxation(*(_summed(name, [x, point, sharpness], out, data) for name, out in outputs.items()))


def by_c(term: ca.Function, points: np.ndarray) -> Relaxation:
    """Return the same compiled from C, which takes ten seconds for a new cell and none for one that is known.

    Raises:
        OptionError: there is no C compiler.
    """
    found = by_casadi(term, points)
    return Relaxation(*compiled([found.value, found.gradient, found.hessian]))


def _summed(name: str, inputs: list[ca.SX], output: ca.SX, data: ca.DM) -> ca.Function:
    """Return ``(x, sharpness) -> sum over the seam points`` of one point's output."""
    n = data.shape[1]
    one = ca.Function(name, inputs, [output], {"cse": True})
    x, sharpness = ca.MX.sym("x", inputs[0].numel()), ca.MX.sym("sharpness")
    columns = one.map(n)(ca.repmat(x, 1, n), data, ca.repmat(sharpness, 1, n))
    width = output.shape[1]
    total = ca.horzcat(*[ca.sum2(columns[:, k::width]) for k in range(width)])
    return ca.Function(name, [x, sharpness], [total], ["x", "sharpness"], [name])


def by_jets(term: ca.Function, points: np.ndarray) -> Relaxation:
    """Return the same by second-order jets: one pass gives all three, kept for the calls that follow at one point."""
    from nlpweld.engine.jets import summed_jet

    jet, d = summed_jet(term, points), term.nnz_in(0)

    def slopes(x: np.ndarray, p: float) -> tuple[np.ndarray, np.ndarray]:
        found = jet(x, p, True)
        return found[1 : 1 + d], _matrix(found[1 + d :], d)

    return by_functions(lambda x, p: float(jet(x, p, False)[0]), slopes, d)


def by_functions(
    value: Callable[[np.ndarray, float], float],
    slopes: Callable[[np.ndarray, float], tuple[np.ndarray, np.ndarray]],
    d: int,
) -> Relaxation:
    """Return a relaxation of functions in Python; gradient and Hessian (d, d) at one point are computed together."""
    remembered = _Remembered(slopes)
    return Relaxation(
        _Part("value", lambda x, p: np.array(value(x, p)), d, 0),
        _Part("gradient", lambda x, p: remembered(x, p)[0], d, 1),
        _Part("hessian", lambda x, p: remembered(x, p)[1], d, d),
    )


def _matrix(triangle: np.ndarray, d: int) -> np.ndarray:
    upper = np.zeros((d, d))
    upper[np.triu_indices(d)] = triangle
    return upper + np.triu(upper, 1).T


def lanes_of(term: ca.Function, points: np.ndarray, engine: str) -> Lanes:
    """Return ``(z (d, N), sharpness, slopes) -> values, gradients, Hessians`` of a term at every seam point.

    Args:
        term: ``(z, point, sharpness) -> scalar``.
        points: the data of every seam point, shape (k, N).
        engine: ``numba`` differentiates by jets; else CasADi does, in C with engine ``c``.
    """
    d = term.nnz_in(0)
    upper = np.triu_indices(d)
    found = _jets(term, points) if engine == "numba" else _mapped(term, points, engine)

    def lanes(z: np.ndarray, sharpness: float, slopes: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        jets = found(z, sharpness, slopes)
        if not slopes:
            return jets[0], np.empty(0), np.empty(0)
        H = np.empty((d, d, points.shape[1]))
        H[upper] = H[upper[::-1]] = jets[1 + d :]
        return jets[0], jets[1 : 1 + d], H

    return lanes


def _jets(term: ca.Function, points: np.ndarray) -> Callable[[np.ndarray, float, bool], np.ndarray]:
    from nlpweld.engine.jets import lane_jet

    return lane_jet(term, points)


def _mapped(term: ca.Function, points: np.ndarray, engine: str) -> Callable[[np.ndarray, float, bool], np.ndarray]:
    """Return what a lane jet gives, by CasADi's own derivatives."""
    z, point, sharpness = (ca.SX.sym(term.name_in(i), *term.size_in(i)) for i in range(3))
    value = term(z, point, sharpness)
    hessian, gradient = ca.hessian(value, z)
    rows, columns = np.triu_indices(z.numel())
    triangle = ca.vertcat(*[hessian[int(i), int(j)] for i, j in zip(rows, columns, strict=True)])
    inputs, data, n = [z, point, sharpness], ca.DM(points), points.shape[1]
    pair = [
        ca.Function("value", inputs, [value], {"cse": True}).map(n),
        ca.Function("jet", inputs, [ca.densify(ca.vertcat(value, gradient, triangle))], {"cse": True}).map(n),
    ]
    if engine == "c":
        pair = compiled(pair)
    return lambda z, p, slopes: np.array(pair[slopes](z, data, np.full((1, n), p)))


class _Remembered:
    """Slopes that remember their last answer: gradient and Hessian are asked for one after the other."""

    def __init__(self, slopes: Callable[[np.ndarray, float], tuple[np.ndarray, np.ndarray]]) -> None:
        self.slopes, self.key = slopes, b""
        self.answer = (np.empty(0), np.empty(0))

    def __call__(self, x: np.ndarray, sharpness: float) -> tuple[np.ndarray, np.ndarray]:
        key = x.tobytes() + np.float64(sharpness).tobytes()
        if key != self.key:
            self.key, self.answer = key, self.slopes(x, sharpness)
        return self.answer


class _Part(ca.Callback):
    """One part of a relaxation as a CasADi function ``(x, sharpness) -> part``; its owner must keep it alive.

    With no columns the part is a number, else it has d rows.
    """

    def __init__(self, name: str, part: Callable[[np.ndarray, float], np.ndarray], d: int, columns: int) -> None:
        ca.Callback.__init__(self)
        self.part, self.d, self.columns = part, d, columns
        self.construct(name, {})

    def get_n_in(self) -> int:
        return 2

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.d if i == 0 else 1, 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(1 if self.columns == 0 else self.d, max(1, self.columns))

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        return [ca.DM(self.part(np.array(arg[0]).ravel(), float(arg[1])))]


DERIVATIVES = {"numpy": by_casadi, "numba": by_jets, "c": by_c}
