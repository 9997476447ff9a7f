"""Value, gradient and Hessian of a stage graph in one pass: its instruction list run on second-order jets (Numba).

A jet holds for each seam point the value, its first and its second derivatives by the placement variables. Each
instruction acts on jets by the chain rule, so the same graph that CasADi differentiates is differentiated here
without writing it again. The machine (:mod:`~.jet_steps`) is compiled once for a number of variables, whatever the
cell, and cached on disk. Instructions that do not depend on the placement carry values alone.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.engine import jet_steps
from nlpweld.engine.numba_kernels import INNER, JIT, load

LANES = 72  # taken at once: fewer cost more overhead; the usual number of seam points leaves none idle
CONST, INPUT, OUTPUT = ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT
FLAT = ("LT", "LE", "NOT")  # without derivative
BINARY = ("ADD", "SUB", "MUL", "DIV", "FMIN", "FMAX", "LT", "LE", "IF_ELSE_ZERO", "POW", "CONSTPOW")
UNARY = ("NEG", "TWICE", "SQ", "SQRT", "INV", "EXP", "LOG1P", "SIN", "COS", "FABS", "NOT", "ASSIGN")
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


def numbers(names: tuple[str, ...]) -> dict[int, str]:
    """Return CasADi's operations by number."""
    return {getattr(ca, f"OP_{name}"): name for name in names}


@dataclass(frozen=True, eq=False)
class Tape:
    """An instruction list as arrays.

    Attributes:
        code: operation, result, first and second operand, shape (n, 4).
        active: whether result, first and second operand depend on the variables, shape (n, 3).
        constants: the number of each CONST instruction, shape (n,).
        registers: how many jets are held at once.
    """

    code: np.ndarray
    active: np.ndarray
    constants: np.ndarray
    registers: int


def tape(f: ca.Function) -> Tape:
    """Return the instruction list of an SX function whose first input are the variables and whose output is a scalar.

    Raises:
        ValueError: an operation has no jet here, or the output is not a scalar.
    """
    if f.n_out() != 1 or f.nnz_out(0) != 1:
        raise ValueError(f"{f.name()}: jets need one scalar output")
    first = np.concatenate([[0], np.cumsum([f.nnz_in(i) for i in range(f.n_in())])])
    n = f.n_instructions()
    code, active, constants = np.zeros((n, 4), dtype=np.int64), np.zeros((n, 3), dtype=np.int64), np.zeros(n)
    alive = np.zeros(f.sz_w(), dtype=bool)
    binary, unary, flat = numbers(BINARY), numbers(UNARY), numbers(FLAT)
    for k in range(n):
        op, ins, outs = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if op == CONST:
            code[k, :2], constants[k], alive[outs[0]] = (op, outs[0]), f.instruction_constant(k), False
        elif op == INPUT:
            code[k, :3], alive[outs[0]] = (op, outs[0], first[ins[0]] + ins[1]), ins[0] == 0
            active[k, 0] = ins[0] == 0
        elif op == OUTPUT:
            code[k, :3], active[k, 1] = (op, 0, ins[0]), alive[ins[0]]
        elif op in binary or op in unary:
            a, b = ins[0], ins[1] if op in binary else ins[0]
            uses_b = op in binary and alive[b]
            code[k] = op, outs[0], a, b
            result = op not in flat and bool(alive[a] or uses_b)
            active[k], alive[outs[0]] = (result, alive[a], uses_b), result
        else:
            raise ValueError(f"{f.name()}: CasADi operation {op} has no jet; add it to nlpweld/engine/jets.py")
    code, registers = _apart(code)
    return Tape(code, active, constants, registers)


def _apart(code: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the code with registers given anew, so that no result lies where its operands do, and their number."""
    made: dict[int, int] = {}  # by which instruction each of the old registers was written last
    read: list[list[int]] = []
    for k, (op, result, a, b) in enumerate(code.tolist()):
        read.append([] if op in (CONST, INPUT) else [made[a]] if op == OUTPUT else [made[a], made[b]])
        if op != OUTPUT:
            made[result] = k
    last = {value: k for k, values in enumerate(read) for value in values}
    place, free, count, code = {}, list[int](), 0, code.copy()
    for k, values in enumerate(read):
        if code[k, 0] != OUTPUT:
            place[k] = free.pop() if free else count
            count = max(count, place[k] + 1)
            code[k, 1] = place[k]
        code[k, 2 : 2 + len(values)] = [place[value] for value in values]
        free += [place[value] for value in set(values) if last[value] == k]
    return code, count


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
    """
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
