"""Two ways to differentiate a sum over seam points: CasADi's graphs, or jets on Numba where it is installed."""

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from nlpweld.formulation.nlp import Relaxation

UPPER = np.triu_indices(3)


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


def _summed(name: str, inputs: list[ca.SX], output: ca.SX, data: ca.DM) -> ca.Function:
    """Return ``(x, sharpness) -> sum over the seam points`` of one point's output."""
    n = data.shape[1]
    one = ca.Function(name, inputs, [output], {"cse": True})
    x, sharpness = ca.MX.sym("x", 3), ca.MX.sym("sharpness")
    columns = one.map(n)(ca.repmat(x, 1, n), data, ca.repmat(sharpness, 1, n))
    width = output.shape[1]
    total = ca.horzcat(*[ca.sum2(columns[:, k::width]) for k in range(width)])
    return ca.Function(name, [x, sharpness], [total], ["x", "sharpness"], [name])


def by_jets(term: ca.Function, points: np.ndarray) -> Relaxation:
    """Return the same by second-order jets: one pass gives all three, kept for the calls that follow at one point."""
    from nlpweld.engine.jets import summed_jet

    jet = _Remembered(summed_jet(term, points))
    return Relaxation(
        _Part("value", lambda x, p: jet(x, p, False)[:1], (1, 1)),
        _Part("gradient", lambda x, p: jet(x, p, True)[1:4], (3, 1)),
        _Part("hessian", lambda x, p: _matrix(jet(x, p, True)), (3, 3)),
    )


def _matrix(jet: np.ndarray) -> np.ndarray:
    upper = np.zeros((3, 3))
    upper[UPPER] = jet[4:]
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
    """One part of a jet as a CasADi function ``(x, sharpness) -> part``; its owner must keep it alive."""

    def __init__(self, name: str, part: Callable[[np.ndarray, float], np.ndarray], shape: tuple[int, int]) -> None:
        ca.Callback.__init__(self)
        self.part, self.shape = part, shape
        self.construct(name, {})

    def get_n_in(self) -> int:
        return 2

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(3 if i == 0 else 1, 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(*self.shape)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        return [ca.DM(self.part(np.array(arg[0]).ravel(), float(arg[1])))]
