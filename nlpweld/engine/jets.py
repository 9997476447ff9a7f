"""Value, gradient and Hessian of a stage graph in one pass: its instruction list run on second-order jets (Numba).

A jet holds ten numbers for each seam point: the value, three first and six second derivatives by the three placement
variables, in the order f, x, y, z, xx, xy, xz, yy, yz, zz. Each instruction acts on jets by the chain rule, so the
same graph that CasADi differentiates is differentiated here without writing it again. The machine below is compiled
once for all cells and cached on disk. Instructions that do not depend on the placement carry values alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, log1p, sqrt

import casadi as ca
import numba
import numpy as np

JET = 10
CONST, INPUT, OUTPUT = ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT
ADD, SUB, MUL, DIV = ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV
NEG, TWICE, SQ, SQRT, INV = ca.OP_NEG, ca.OP_TWICE, ca.OP_SQ, ca.OP_SQRT, ca.OP_INV
EXP, LOG1P, POW, CONSTPOW = ca.OP_EXP, ca.OP_LOG1P, ca.OP_POW, ca.OP_CONSTPOW
FMIN, FMAX, FABS = ca.OP_FMIN, ca.OP_FMAX, ca.OP_FABS
LT, LE, NOT, IF_ELSE_ZERO, ASSIGN = ca.OP_LT, ca.OP_LE, ca.OP_NOT, ca.OP_IF_ELSE_ZERO, ca.OP_ASSIGN
FLAT = (LT, LE, NOT)  # without derivative
BINARY = (ADD, SUB, MUL, DIV, FMIN, FMAX, LT, LE, IF_ELSE_ZERO, POW, CONSTPOW)
UNARY = (NEG, TWICE, SQ, SQRT, INV, EXP, LOG1P, FABS, NOT, ASSIGN)
jit = numba.njit(error_model="numpy", cache=True)


@dataclass(frozen=True, eq=False)
class Tape:
    """An instruction list as arrays.

    Attributes:
        code: operation, result, first and second operand, shape (n, 4).
        active: whether result, first and second operand depend on the variables, shape (n, 3).
        constants: the number of each CONST instruction, shape (n,).
        registers: size of the work vector.
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
    for k in range(n):
        op, ins, outs = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if op == CONST:
            code[k, :2], constants[k], alive[outs[0]] = (op, outs[0]), f.instruction_constant(k), False
        elif op == INPUT:
            code[k, :3], alive[outs[0]] = (op, outs[0], first[ins[0]] + ins[1]), ins[0] == 0
            active[k, 0] = ins[0] == 0
        elif op == OUTPUT:
            code[k, :3], active[k, 1] = (op, 0, ins[0]), alive[ins[0]]
        elif op in BINARY or op in UNARY:
            a, b = ins[0], ins[1] if op in BINARY else ins[0]
            uses_b = op in BINARY and alive[b]
            code[k] = op, outs[0], a, b
            result = op not in FLAT and bool(alive[a] or uses_b)
            active[k], alive[outs[0]] = (result, alive[a], uses_b), result
        else:
            raise ValueError(f"{f.name()}: CasADi operation {op} has no jet; add it to nlpweld/engine/jets.py")
    return Tape(code, active, constants, f.sz_w())


def summed_jet(f: ca.Function, points: np.ndarray) -> Callable[[np.ndarray, float, bool], np.ndarray]:
    """Return ``(x, sharpness, slopes) -> jet`` (10,) of the sum over seam points of ``f(x (3,), point, sharpness)``.

    Without slopes only the value is computed, several times faster, and the rest is zero.

    Args:
        f: an SX function of three variables, a seam point's data and a number.
        points: the data of every seam point, shape (d, N).
    """
    program = tape(f)
    n = points.shape[1]
    inputs = np.zeros((3 + len(points) + 1, JET, n))
    inputs[3:-1, 0] = points
    inputs[range(3), range(1, 4)] = 1.0
    work, spare, out = np.zeros((program.registers, JET, n)), np.zeros((JET + 3, n)), np.zeros((JET, n))

    passive = np.zeros_like(program.active)

    def jet(x: np.ndarray, sharpness: float, slopes: bool) -> np.ndarray:
        inputs[:3, 0], inputs[-1, 0] = np.reshape(x, (3, 1)), sharpness
        run(program.code, program.active if slopes else passive, program.constants, inputs, work, spare, out)
        return out.sum(axis=1)

    return jet


@jit
def chain(r, p, f, g, h):  # type: ignore[no-untyped-def]
    """Write into r the jet of a function of jet p, given its value f, slope g and curvature h at each point."""
    for j in range(f.shape[0]):
        px, py, pz, s, c = p[1, j], p[2, j], p[3, j], g[j], h[j]
        cx, cy, cz = c * px, c * py, c * pz
        xx, xy, xz = s * p[4, j] + cx * px, s * p[5, j] + cx * py, s * p[6, j] + cx * pz
        yy, yz, zz = s * p[7, j] + cy * py, s * p[8, j] + cy * pz, s * p[9, j] + cz * pz
        r[0, j], r[1, j], r[2, j], r[3, j] = f[j], s * px, s * py, s * pz
        r[4, j], r[5, j], r[6, j], r[7, j], r[8, j], r[9, j] = xx, xy, xz, yy, yz, zz


@jit
def product(r, p, q):  # type: ignore[no-untyped-def]
    """Write into r the product of two jets."""
    for j in range(r.shape[1]):
        a, ax, ay, az = p[0, j], p[1, j], p[2, j], p[3, j]
        b, bx, by, bz = q[0, j], q[1, j], q[2, j], q[3, j]
        xx = a * q[4, j] + b * p[4, j] + 2.0 * ax * bx
        xy = a * q[5, j] + b * p[5, j] + ax * by + ay * bx
        xz = a * q[6, j] + b * p[6, j] + ax * bz + az * bx
        yy = a * q[7, j] + b * p[7, j] + 2.0 * ay * by
        yz = a * q[8, j] + b * p[8, j] + ay * bz + az * by
        zz = a * q[9, j] + b * p[9, j] + 2.0 * az * bz
        r[0, j], r[1, j], r[2, j], r[3, j] = a * b, a * bx + b * ax, a * by + b * ay, a * bz + b * az
        r[4, j], r[5, j], r[6, j], r[7, j], r[8, j], r[9, j] = xx, xy, xz, yy, yz, zz


@jit
def scaled(r, p, f, rows):  # type: ignore[no-untyped-def]
    """Write into r the first rows of jet p, each point times the number f."""
    for i in range(rows):
        for j in range(f.shape[0]):
            r[i, j] = p[i, j] * f[j]


@jit
def blended(r, p, p_rows, q, q_rows, u, v):  # type: ignore[no-untyped-def]
    """Write into r the sum of jets p times u and q times v, each known to some rows and zero beyond."""
    for i in range(max(p_rows, q_rows)):
        for j in range(u.shape[0]):
            total = u[j] * p[i, j] if i < p_rows else 0.0
            r[i, j] = total + v[j] * q[i, j] if i < q_rows else total


@jit
def reciprocal(p, f, g, h):  # type: ignore[no-untyped-def]
    """Write value, slope and curvature of 1/p."""
    for j in range(f.shape[0]):
        f[j] = 1.0 / p[0, j]
        g[j] = -f[j] * f[j]
        h[j] = -2.0 * g[j] * f[j]


@jit
def power(p, q, f, g, h):  # type: ignore[no-untyped-def]
    """Write value, slope and curvature of p to a power q that does not depend on the variables."""
    for j in range(f.shape[0]):
        e = q[0, j]
        f[j] = p[0, j] ** e
        g[j] = e * f[j] / p[0, j]
        h[j] = (e - 1.0) * g[j] / p[0, j]


@jit
def smooth_unary(op, p, f, g, h):  # type: ignore[no-untyped-def]
    """Write value, slope and curvature of a smooth function of one number."""
    for j in range(f.shape[0]):
        a = p[0, j]
        if op == SQ:
            f[j], g[j], h[j] = a * a, 2.0 * a, 2.0
        elif op == SQRT:
            f[j] = sqrt(a)
            g[j] = 0.5 / f[j]
            h[j] = -0.5 * g[j] / a
        elif op == EXP:
            f[j] = exp(a)
            g[j] = f[j]
            h[j] = f[j]
        elif op == LOG1P:
            f[j] = log1p(a)
            g[j] = 1.0 / (1.0 + a)
            h[j] = -g[j] * g[j]


@jit
def kinked(op, p, q, u, v):  # type: ignore[no-untyped-def]
    """Write by which factors two operands enter a minimum, maximum, absolute value, comparison or choice."""
    for j in range(u.shape[0]):
        a, b = p[0, j], q[0, j]
        if op == FMIN:
            u[j] = 1.0 if a <= b else 0.0
        elif op == FMAX:
            u[j] = 1.0 if a >= b else 0.0
        elif op == FABS:
            u[j] = 1.0 if a >= 0.0 else -1.0
        elif op == IF_ELSE_ZERO:
            u[j] = 1.0 if a != 0.0 else 0.0
        elif op == LT:
            u[j] = 1.0 if a < b else 0.0
        elif op == LE:
            u[j] = 1.0 if a <= b else 0.0
        elif op == NOT:
            u[j] = 1.0 if a == 0.0 else 0.0
        v[j] = 1.0 - u[j]


@jit
def run(code, active, constants, inputs, work, spare, out):  # type: ignore[no-untyped-def]
    """Run a tape: inputs (n_in, 10, N) to out (10, N), with registers work (n_w, 10, N) and spare (13, N)."""
    f, g, h, inverse = spare[0], spare[1], spare[2], spare[3:]
    for k in range(code.shape[0]):
        op, here, p, q = code[k, 0], code[k, 1], work[code[k, 2] % work.shape[0]], work[code[k, 3]]
        r = work[here]
        p_rows, q_rows = (10 if active[k, 1] else 1), (10 if active[k, 2] else 1)
        if op == CONST:
            r[0, :] = constants[k]
        elif op == INPUT:
            n = 10 if active[k, 0] else 1
            r[:n] = inputs[code[k, 2], :n]
        elif op == OUTPUT:
            out[:] = 0.0
            out[:p_rows] = p[:p_rows]
        elif op == MUL:
            if p_rows == q_rows == 10:
                product(r, p, q)
            elif q_rows == 10:
                f[:] = p[0]
                scaled(r, q, f, 10)
            else:
                f[:] = q[0]
                scaled(r, p, f, p_rows)
        elif op == ADD or op == SUB:
            f[:] = 1.0
            g[:] = 1.0 if op == ADD else -1.0
            blended(r, p, p_rows, q, q_rows, f, g)
        elif op == NEG or op == TWICE or op == ASSIGN:
            f[:] = -1.0 if op == NEG else (2.0 if op == TWICE else 1.0)
            scaled(r, p, f, p_rows)
        elif op == DIV or op == INV:
            divisor, rows = (q, q_rows) if op == DIV else (p, p_rows)
            reciprocal(divisor, f, g, h)
            if rows == 10:
                chain(inverse if op == DIV else r, divisor, f, g, h)
            if op == INV and rows == 1:
                r[0] = f
            elif op == DIV and rows == 1:
                scaled(r, p, f, p_rows)
            elif op == DIV and p_rows == 10:
                product(r, p, inverse)
            elif op == DIV:
                f[:] = p[0]
                scaled(r, inverse, f, 10)
        elif op == POW or op == CONSTPOW:
            power(p, q, f, g, h)
            if p_rows == 10:
                chain(r, p, f, g, h)
            else:
                r[0] = f
        elif op == SQ or op == SQRT or op == EXP or op == LOG1P:
            smooth_unary(op, p, f, g, h)
            if p_rows == 10:
                chain(r, p, f, g, h)
            else:
                r[0] = f
        else:
            kinked(op, p, q, f, g)
            if op == FMIN or op == FMAX:
                blended(r, p, p_rows, q, q_rows, f, g)
            elif op == FABS:
                scaled(r, p, f, p_rows)
            elif op == IF_ELSE_ZERO:
                scaled(r, q, f, q_rows)
            else:
                r[0] = f
