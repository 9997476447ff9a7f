"""Ways to differentiate a sum over seam points: CasADi's graphs, in its machine or in C, or jets on Numba."""

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from nlpweld.engine.c_functions import compiled
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

    jet, d = _Remembered(summed_jet(term, points)), term.nnz_in(0)
    return Relaxation(
        _Part("value", lambda x, p: jet(x, p, False)[:1], d, 0),
        _Part("gradient", lambda x, p: jet(x, p, True)[1 : 1 + d], d, 1),
        _Part("hessian", lambda x, p: _matrix(jet(x, p, True)[1 + d :], d), d, d),
    )


def _matrix(triangle: np.ndarray, d: int) -> np.ndarray:
    upper = np.zeros((d, d))
    upper[np.triu_indices(d)] = triangle
    return upper + np.triu(upper, 1).T


class _Remembered:
    """A jet that remembers its last answer: value, gradient and Hessian are asked for one after the other."""

    def __init__(self, jet: Callable[[np.ndarray, float, bool], np.ndarray]) -> None:
        self.jet, self.key, self.slopes, self.answer = jet, b"", False, np.empty(0)

    def __call__(self, x: np.ndarray, sharpness: float, slopes: bool) -> np.ndarray:
        key = x.tobytes() + np.float64(sharpness).tobytes()
        if key != self.key or (slopes and not self.slopes):
            self.key, self.slopes, self.answer = key, slopes, self.jet(x, sharpness, slopes)
        return self.answer


class _Part(ca.Callback):
    """One part of a jet as a CasADi function ``(x, sharpness) -> part``; its owner must keep it alive.

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
