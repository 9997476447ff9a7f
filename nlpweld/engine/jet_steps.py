"""The machine that runs an instruction list on second-order jets, as plain loops over one flat array.

Nothing here runs as it stands: :mod:`nlpweld.engine.jets` compiles it with the number of variables ``D``, the lanes
taken at once ``W`` and CasADi's operations by name. A jet takes ``JET`` rows of ``W`` lanes: value, gradient, and the
upper triangle of the Hessian row by row. Operands are offsets into the array, unsigned because a signed one could
count from the end, and never the result's own, so that LLVM can vectorise over the lanes.
"""
# ruff: noqa: F821
# mypy: ignore-errors

from math import cos, exp, log1p, sin, sqrt

import numpy as np


def product(w, r, p, q):
    """Write into r the product of jets p and q."""
    for j in range(W):
        w[r + j] = w[p + j] * w[q + j]
    at = W + W * D
    for i in range(D):
        ri, pi, qi = r + W + W * i, p + W + W * i, q + W + W * i
        for j in range(W):
            w[ri + j] = w[p + j] * w[qi + j] + w[q + j] * w[pi + j]
        for k in range(i, D):
            rk, pk, qk, pik, qik = r + at, p + W + W * k, q + W + W * k, p + at, q + at
            for j in range(W):
                cross = w[pi + j] * w[qk + j] + w[pk + j] * w[qi + j]
                w[rk + j] = w[p + j] * w[qik + j] + w[q + j] * w[pik + j] + cross
            at += W


def chain(w, r, p, f, g, h):
    """Write into r the jet of a function of jet p, given its value f, slope g and curvature h at each lane."""
    for j in range(W):
        w[r + j] = w[f + j]
    at = W + W * D
    for i in range(D):
        ri, pi = r + W + W * i, p + W + W * i
        for j in range(W):
            w[ri + j] = w[g + j] * w[pi + j]
        for k in range(i, D):
            rk, pk, pik = r + at, p + W + W * k, p + at
            for j in range(W):
                w[rk + j] = w[g + j] * w[pik + j] + w[h + j] * w[pi + j] * w[pk + j]
            at += W


def scaled(w, r, p, f, rows):
    """Write into r the first rows of jet p, each lane times a number f."""
    for i in range(rows):
        for j in range(W):
            w[r + W * i + j] = w[p + W * i + j] * w[f + j]


def times(w, r, p, factor, rows):
    """Write into r the first rows of jet p times one factor."""
    for i in range(rows):
        for j in range(W):
            w[r + W * i + j] = factor * w[p + W * i + j]


def added(w, r, p, p_rows, q, q_rows, sign):
    """Write into r the jet p plus sign times the jet q, each known to some rows and zero beyond."""
    both = min(p_rows, q_rows)
    for i in range(both):
        for j in range(W):
            w[r + W * i + j] = w[p + W * i + j] + sign * w[q + W * i + j]
    if p_rows > both:
        times(w, r + W * both, p + W * both, 1.0, p_rows - both)
    elif q_rows > both:
        times(w, r + W * both, q + W * both, sign, q_rows - both)


def blended(w, r, p, p_rows, q, q_rows, u, v):
    """Write into r the sum of jets p times u and q times v, each known to some rows and zero beyond."""
    both = min(p_rows, q_rows)
    for i in range(both):
        for j in range(W):
            w[r + W * i + j] = w[u + j] * w[p + W * i + j] + w[v + j] * w[q + W * i + j]
    if p_rows > both:
        scaled(w, r + W * both, p + W * both, u, p_rows - both)
    elif q_rows > both:
        scaled(w, r + W * both, q + W * both, v, q_rows - both)


def reciprocal(w, p, f, g, h):
    """Write value, slope and curvature of 1/p."""
    for j in range(W):
        inverse = 1.0 / w[p + j]
        w[f + j], w[g + j], w[h + j] = inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse


def power(w, p, q, f, g, h):
    """Write value, slope and curvature of p to a power q that does not depend on the variables."""
    for j in range(W):
        e, x = w[q + j], w[p + j]
        value = x**e
        w[f + j], w[g + j], w[h + j] = value, e * value / x, (e - 1.0) * e * value / (x * x)


def smooth_unary(w, op, p, f, g, h):
    """Write value, slope and curvature of a smooth function of one number."""
    if op == SQ:
        for j in range(W):
            x = w[p + j]
            w[f + j], w[g + j], w[h + j] = x * x, 2.0 * x, 2.0
    elif op == SQRT:
        for j in range(W):
            root = sqrt(w[p + j])
            w[f + j], w[g + j], w[h + j] = root, 0.5 / root, -0.25 / (root * w[p + j])
    elif op == EXP:
        for j in range(W):
            value = exp(w[p + j])
            w[f + j], w[g + j], w[h + j] = value, value, value
    elif op == SIN or op == COS:
        for j in range(W):
            s, c = sin(w[p + j]), cos(w[p + j])
            w[f + j], w[g + j], w[h + j] = (s, c, -s) if op == SIN else (c, -s, -c)
    else:
        for j in range(W):
            slope = 1.0 / (1.0 + w[p + j])
            w[f + j], w[g + j], w[h + j] = log1p(w[p + j]), slope, -slope * slope


def kinked(w, op, p, q, u, v):
    """Write by which factors two operands enter a minimum, maximum, absolute value, comparison or choice."""
    for j in range(W):
        a, b = w[p + j], w[q + j]
        if op == FMIN:
            yes = a <= b
        elif op == FMAX:
            yes = a >= b
        elif op == FABS:
            yes = a >= 0.0
        elif op == IF_ELSE_ZERO:
            yes = a != 0.0
        elif op == LT:
            yes = a < b
        elif op == LE:
            yes = a <= b
        else:
            yes = a == 0.0
        w[u + j] = 1.0 if yes else (-1.0 if op == FABS else 0.0)
        w[v + j] = 0.0 if yes else 1.0


def outer(w, r, p, rows, f, g, h):
    """Write into r a function of jet p from its value f, slope g and curvature h."""
    if rows == JET:
        chain(w, r, p, f, g, h)
    else:
        times(w, r, f, 1.0, np.uint64(1))


def divided(w, r, p, p_rows, q, q_rows, f, g, h, inverse):
    """Write into r the quotient of jets p and q."""
    reciprocal(w, q, f, g, h)
    if q_rows != JET:
        scaled(w, r, p, f, p_rows)
        return
    chain(w, inverse, q, f, g, h)
    if p_rows == JET:
        product(w, r, p, inverse)
    else:
        scaled(w, r, inverse, p, q_rows)


def step(w, op, r, p, p_rows, q, q_rows, spare):
    """Run one instruction: result r, operands p and q, each known to some rows; spare rows lie at spare."""
    f, g, h, inverse = spare, spare + W, spare + W + W, spare + W + W + W
    if op == MUL:
        if p_rows == q_rows == JET:
            product(w, r, p, q)
        elif q_rows == JET:
            scaled(w, r, q, p, q_rows)
        else:
            scaled(w, r, p, q, p_rows)
    elif op == ADD or op == SUB:
        added(w, r, p, p_rows, q, q_rows, 1.0 if op == ADD else -1.0)
    elif op == NEG or op == TWICE or op == ASSIGN:
        times(w, r, p, -1.0 if op == NEG else (2.0 if op == TWICE else 1.0), p_rows)
    elif op == DIV:
        divided(w, r, p, p_rows, q, q_rows, f, g, h, inverse)
    elif op == INV:
        reciprocal(w, p, f, g, h)
        outer(w, r, p, p_rows, f, g, h)
    elif op == POW or op == CONSTPOW:
        power(w, p, q, f, g, h)
        outer(w, r, p, p_rows, f, g, h)
    elif op == SQ or op == SQRT or op == EXP or op == LOG1P or op == SIN or op == COS:
        smooth_unary(w, op, p, f, g, h)
        outer(w, r, p, p_rows, f, g, h)
    else:
        kinked(w, op, p, q, f, g)
        if op == FMIN or op == FMAX:
            blended(w, r, p, p_rows, q, q_rows, f, g)
        elif op == FABS:
            scaled(w, r, p, f, p_rows)
        elif op == IF_ELSE_ZERO:
            scaled(w, r, q, f, q_rows)
        else:
            times(w, r, f, 1.0, np.uint64(1))


def run(code, active, constants, inputs, w, total):
    """Run a tape over blocks of lanes.

    Args:
        code: operation, result, first and second operand, (n, 4).
        active: whether result, first and second operand depend on the variables, (n, 3).
        constants: the number of each CONST instruction, (n,).
        inputs: jets of the inputs, block by block, (blocks, n_in, JET * W).
        w: room for all registers and 3 + JET spare rows, flat.
        total: what comes out of every block, (blocks, JET * W).
    """
    spare = np.uint64(w.shape[0]) - W * (JET + np.uint64(3))
    total[:] = 0.0
    for block in range(inputs.shape[0]):
        for n in range(code.shape[0]):
            op, r = code[n, 0], W * JET * np.uint64(code[n, 1])
            p_rows = JET if active[n, 1] else np.uint64(1)
            if op == CONST:
                w[r : r + W] = constants[n]
            elif op == INPUT:
                rows = W * (JET if active[n, 0] else np.uint64(1))
                w[r : r + rows] = inputs[block, code[n, 2], :rows]
            elif op == OUTPUT:
                p = W * JET * np.uint64(code[n, 2])
                total[block, : W * p_rows] = w[p : p + W * p_rows]
            else:
                q_rows = JET if active[n, 2] else np.uint64(1)
                p, q = W * JET * np.uint64(code[n, 2]), W * JET * np.uint64(code[n, 3])
                step(w, op, r, p, p_rows, q, q_rows, spare)
