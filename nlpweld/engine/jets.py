"""Value, gradient and Hessian of a stage graph in one pass: its instruction list run on second-order jets (Numba).

A jet holds for each seam point the value, its first and its second derivatives by the placement variables. Each
instruction acts on jets by the chain rule, so the same graph that CasADi differentiates is differentiated here
without writing it again. The machine (:mod:`~.jet_steps`) is compiled once for a number of variables, whatever the
cell, and cached on disk. Instructions that do not depend on the placement carry values alone.
"""

import inspect
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.engine import jet_steps
from nlpweld.engine.numba_kernels import INNER, JIT, load
from nlpweld.engine.tape import BINARY, CONST, INPUT, OUTPUT, UNARY, numbers, tape

LANES = 72  # taken at once: fewer cost more overhead; the usual number of seam points leaves none idle
STEPS = (
    jet_steps.product,
    jet_steps.chain,
    jet_steps.scaled,
    jet_steps.times,
    jet_steps.added,
    jet_steps.blended,
    jet_steps.reciprocal,
    jet_steps.power,
    jet_steps.smooth_unary,
    jet_steps.kinked,
    jet_steps.outer,
    jet_steps.divided,
    jet_steps.step,
    jet_steps.run,
)


def machine(variables: int, lanes: int = LANES) -> Any:
    """Return the compiled machine for a number of variables."""
    rows = 1 + variables + variables * (variables + 1) // 2
    known = {**numbers(BINARY), **numbers(UNARY), CONST: "CONST", INPUT: "INPUT", OUTPUT: "OUTPUT"}
    head = ["from math import cos, exp, log1p, sin, sqrt", "", "import numba", "import numpy as np", ""]
    head += [f"{name} = {number}" for number, name in known.items()]
    head += [f"{name} = np.uint64({value})" for name, value in (("D", variables), ("W", lanes), ("JET", rows))]
    jitted = [(JIT if step is jet_steps.run else INNER) + inspect.getsource(step) for step in STEPS]
    return load("\n".join(head) + "\n\n\n" + "\n\n".join(jitted)).run


def lane_jet(f: ca.Function, points: np.ndarray) -> Callable[[np.ndarray, float, bool], np.ndarray]:
    """Return ``(z, sharpness, slopes) -> jets`` (rows, N) of ``f(z, point, sharpness)`` at every seam point.

    A jet is the value, the gradient, and the upper triangle of the Hessian row by row. Without slopes only the value
    is computed, several times faster, and the rest is not to be looked at. z is (d,) or, one for each point, (d, N).

    Args:
        f: an SX function of d variables, a seam point's data and a number.
        points: the data of every seam point, shape (k, N).

    Raises:
        ValueError: the output is not a scalar.
    """
    if f.n_out() != 1 or f.nnz_out(0) != 1:
        raise ValueError(f"{f.name()}: jets need one scalar output")
    program, run, d, n = tape(f), machine(f.nnz_in(0)), f.nnz_in(0), points.shape[1]
    rows, blocks = 1 + d + d * (d + 1) // 2, -(-n // LANES)
    inputs = np.zeros((blocks, d + len(points) + 1, rows, LANES))
    lanes = np.minimum(np.arange(blocks * LANES), n - 1)  # the last point fills the last block
    inputs[:, d:-1, 0] = points[:, lanes].reshape(len(points), blocks, LANES).transpose(1, 0, 2)
    inputs[:, range(d), range(1, d + 1)] = 1.0
    flat = inputs.reshape(blocks, d + len(points) + 1, -1)
    work, total = np.zeros((program.registers + 1) * rows * LANES + 3 * LANES), np.zeros((blocks, rows * LANES))
    passive = np.zeros_like(program.active)

    def jet(z: np.ndarray, sharpness: float, slopes: bool) -> np.ndarray:
        z = z[:, lanes] if z.ndim == 2 else np.broadcast_to(z[:, None], (d, blocks * LANES))
        inputs[:, :d, 0], inputs[:, -1, 0] = z.reshape(d, blocks, LANES).transpose(1, 0, 2), sharpness
        run(program.code, program.active if slopes else passive, program.constants, flat, work, total)
        return total.reshape(blocks, rows, LANES).transpose(1, 0, 2).reshape(rows, -1)[:, :n]

    return jet


def summed_jet(f: ca.Function, points: np.ndarray) -> Callable[[np.ndarray, float, bool], np.ndarray]:
    """Return ``(x, sharpness, slopes) -> jet``, the sum over seam points of :func:`lane_jet`; x is (d,)."""
    lanes = lane_jet(f, points)

    def jet(x: np.ndarray, sharpness: float, slopes: bool) -> np.ndarray:
        found = lanes(x, sharpness, slopes)
        total = np.zeros(len(found))
        known = len(found) if slopes else 1
        total[:known] = found[:known].sum(axis=1)
        return total

    return jet
