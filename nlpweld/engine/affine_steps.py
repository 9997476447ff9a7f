"""The affine machine: instructions on affine forms, which enclose what a function may be over a box.

A form over a box encloses a number as ``c + sum_i a_i t_i + e`` for every t in [-1, 1]^d, one t_i for each side of the
box, with an unknown e in [-r, r] (affine arithmetic, de Figueiredo and Stolfi 2004, all other noise in one term). What
depends linearly on the place in the box stays exact and cancels as it should; e shrinks with the square of the box.
Rows of a form: c, r, the whole radius R >= sum |a_i| + r, then the a_i. A form that knows nothing has r infinite or
NaN; nothing here turns that into knowledge.

Rounding: every step computes its rows with fewer than 20 operations on numbers whose sizes add up to less than some S,
so it errs by less than 20 * 2**-53 * S. It adds EPS * S + TINY to r, which is six times that; TINY covers underflow.

Nothing here runs as it stands: :mod:`nlpweld.engine.affine` puts numbers of CasADi's operations, W (lanes) and its
multiples, ``each`` and ``pick`` before it. Compiled by Numba, ``each(W)`` counts lanes one by one; in NumPy it yields
one object, and ``p + j`` is the slice of all lanes, so that both engines run the same text.
"""
# ruff: noqa: F821
# mypy: ignore-errors

from numpy import cos, inf, maximum, nan, sin, sqrt

EPS, TINY = 2.0**-46, 1e-290


def closed(w, r, rows):
    """Write the whole radius of form r from its other rows."""
    for j in each(W):
        w[r + W2 + j] = w[r + W + j]
    for i in range(rows):
        for j in each(W):
            w[r + W2 + j] += abs(w[r + W3 + W * i + j])
    for j in each(W):
        w[r + W2 + j] *= 1.0 + EPS


def scaled(w, r, p, rows, u):
    """Write into the slopes of r those of p times the row u."""
    for i in range(rows):
        for j in each(W):
            w[r + W3 + W * i + j] = w[u + j] * w[p + W3 + W * i + j]


def increased(w, r, p, rows, u):
    """Add to the slopes of r those of p times the row u."""
    for i in range(rows):
        for j in each(W):
            w[r + W3 + W * i + j] += w[u + j] * w[p + W3 + W * i + j]


def product(w, r, p, p_rows, q, q_rows):
    """Write into r the product of forms p and q."""
    for j in each(W):
        u, v, radius_u, radius_v = w[p + j], w[q + j], w[p + W2 + j], w[q + W2 + j]
        size = (abs(u) + radius_u) * (abs(v) + radius_v)
        w[r + W + j] = abs(u) * w[q + W + j] + abs(v) * w[p + W + j] + radius_u * radius_v + (EPS * size + TINY)
        w[r + j] = u * v
    if p_rows > 0:
        scaled(w, r, p, p_rows, q)
        increased(w, r, q, q_rows, p)
    else:
        scaled(w, r, q, q_rows, p)
    closed(w, r, max(p_rows, q_rows))


def square(w, r, p, rows, spare):
    """Write into r the square of form p; the square of its deviation is between zero and that of its radius."""
    for j in each(W):
        u, radius = w[p + j], w[p + W2 + j]
        half = 0.5 * radius * radius
        size = abs(u) + radius
        w[r + j] = u * u + half
        w[r + W + j] = 2.0 * abs(u) * w[p + W + j] + half + (EPS * size * size + TINY)
        w[spare + j] = 2.0 * u
    scaled(w, r, p, rows, spare)
    closed(w, r, rows)


def added(w, r, p, p_rows, q, q_rows, sign, spare):
    """Write into r the form p plus sign times the form q."""
    for j in each(W):
        u, v = w[p + j], w[q + j]
        size = abs(u) + w[p + W2 + j] + (abs(v) + w[q + W2 + j])
        w[r + j] = u + sign * v
        w[r + W + j] = w[p + W + j] + w[q + W + j] + EPS * size
        w[spare + j] = 1.0
        w[spare + W + j] = sign
    if p_rows > 0:
        scaled(w, r, p, p_rows, spare)
        increased(w, r, q, q_rows, spare + W)
    else:
        scaled(w, r, q, q_rows, spare + W)
    closed(w, r, max(p_rows, q_rows))


def times(w, r, p, rows, factor):
    """Write into r the form p times a power of two or its negative, which is exact."""
    for i in range(THREE + rows):
        by = abs(factor) if i == 1 or i == 2 else factor
        for j in each(W):
            w[r + W * i + j] = by * w[p + W * i + j]


def bent(w, r, p, rows, spare):
    """Write into r a function of form p that lies within some distance of a line.

    Slope, offset and distance of the line, for all numbers p encloses, are the rows at spare.
    """
    for j in each(W):
        u, slope, offset, within = w[p + j], w[spare + j], w[spare + W + j], w[spare + W2 + j]
        size = abs(slope) * (abs(u) + w[p + W2 + j]) + abs(offset) + within
        w[r + j] = slope * u + offset
        w[r + W + j] = abs(slope) * w[p + W + j] + within + (EPS * size + TINY)
    scaled(w, r, p, rows, spare)
    closed(w, r, rows)


def ends(w, p, spare):
    """Write least and greatest number of form p, both moved outwards beyond rounding."""
    for j in each(W):
        u, radius = w[p + j], w[p + W2 + j]
        slack = EPS * (abs(u) + radius)
        w[spare + j] = u - radius - slack
        w[spare + W + j] = u + radius + slack


def rooted(w, r, p, rows, spare):
    """Write into r the square root of form p, whose numbers are not negative whatever the form says."""
    ends(w, p, spare + W3)
    for j in each(W):
        low, high = maximum(w[spare + W3 + j], 0.0), w[spare + W4 + j] + TINY
        slope = 1.0 / (sqrt(low) + sqrt(high))  # of the chord, below which the root never is
        chord = sqrt(low) - slope * low
        half = 0.5 * abs(0.25 / slope - chord)  # where the root is farthest above it
        w[spare + j] = slope
        w[spare + W + j] = chord + half
        w[spare + W2 + j] = half
    bent(w, r, p, rows, spare)


def inverted(w, r, p, rows, spare):
    """Write into r the reciprocal of form p, unknown where that encloses zero."""
    ends(w, p, spare + W3)
    for j in each(W):
        low, high = w[spare + W3 + j], w[spare + W4 + j]
        valid = (low > 0.0) | (high < 0.0)
        near, far = 1.0 / sqrt(abs(low)), 1.0 / sqrt(abs(high))
        half = 0.5 * (near - far) * (near - far)
        w[spare + j] = -(near * near) * (far * far)
        w[spare + W + j] = pick(low > 0.0, 1.0, -1.0) * (near * near + far * far - half)
        w[spare + W2 + j] = pick(valid, half, inf)
    bent(w, r, p, rows, spare)


def folded(w, r, p, rows, spare):
    """Write into r the absolute value of form p."""
    ends(w, p, spare + W3)
    for j in each(W):
        low, high = w[spare + W3 + j], w[spare + W4 + j]
        both = (low < 0.0) & (high > 0.0)
        width = pick(both, high - low, 1.0)
        half = pick(both, -high * low / width, 0.0)
        w[spare + j] = pick(both, (high + low) / width, pick(low >= 0.0, 1.0, pick(high <= 0.0, -1.0, nan)))
        w[spare + W + j] = half
        w[spare + W2 + j] = half
    bent(w, r, p, rows, spare)


def turned(w, r, p, rows, spare, shift):
    """Write into r the sine of form p, or with shift one its cosine: a line, and half the square of the radius."""
    for j in each(W):
        u, radius = w[p + j], w[p + W2 + j]
        value, slope = (sin(u), cos(u)) if shift == 0 else (cos(u), -sin(u))
        w[spare + j] = slope
        w[spare + W + j] = value - slope * u
        w[spare + W2 + j] = 0.5 * radius * radius + EPS * (1.0 + abs(u))
    bent(w, r, p, rows, spare)


def extreme(w, r, p, p_rows, q, q_rows, spare, sign):
    """Write into r the greater (sign one) or lesser (minus one) of forms p and q.

    That is q plus the ramp max(p - q, 0), or p minus it; the ramp lies between its chord and its corner.
    """
    ends(w, p, spare)
    ends(w, q, spare + W2)
    for j in each(W):
        low, high = w[spare + j] - w[spare + W3 + j], w[spare + W + j] - w[spare + W2 + j]
        both = (low < 0.0) & (high > 0.0)
        width = pick(both, high - low, 1.0)
        slope = pick(both, high / width, pick(low >= 0.0, 1.0, pick(high <= 0.0, 0.0, nan)))
        half = pick(both, -0.5 * low * high / width, 0.0)
        u, v = pick(sign > 0.0, slope, 1.0 - slope), pick(sign > 0.0, 1.0 - slope, slope)
        size = abs(w[p + j]) + w[p + W2 + j] + (abs(w[q + j]) + w[q + W2 + j])
        # a weight of zero leaves out what is not chosen, whatever is not known of it
        first, second = pick(u == 0.0, 0.0, u * w[p + W + j]), pick(v == 0.0, 0.0, v * w[q + W + j])
        w[r + j] = u * w[p + j] + v * w[q + j] + sign * half
        w[r + W + j] = first + second + half + (EPS * size + TINY)
        w[spare + j], w[spare + W + j] = u, v
    if p_rows > 0:
        scaled(w, r, p, p_rows, spare)
        increased(w, r, q, q_rows, spare + W)
    else:
        scaled(w, r, q, q_rows, spare + W)
    closed(w, r, max(p_rows, q_rows))


def told(w, r, yes, no):
    """Write into r one where the row yes is not zero, zero where the row no is not, else either."""
    for j in each(W):
        unknown = pick(w[yes + j] + w[no + j] == 0.0, 0.5, 0.0)
        w[r + j] = pick(w[yes + j] != 0.0, 1.0, unknown)
        w[r + W + j] = unknown
        w[r + W2 + j] = unknown


def compared(w, r, p, q, spare):
    """Write into r whether form p is less than form q; numbers that may be equal are told neither way."""
    ends(w, p, spare)
    ends(w, q, spare + W2)
    for j in each(W):
        yes = 1.0 * (w[spare + W + j] < w[spare + W2 + j])
        no = 1.0 * (w[spare + j] > w[spare + W3 + j])
        w[spare + j], w[spare + W + j] = yes, no
    told(w, r, spare, spare + W)


def negated(w, r, p, spare):
    """Write into r whether form p is zero."""
    ends(w, p, spare)
    for j in each(W):
        yes = 1.0 * ((w[p + j] == 0.0) & (w[p + W2 + j] == 0.0))
        no = 1.0 * ((w[spare + j] > 0.0) | (w[spare + W + j] < 0.0))
        w[spare + j], w[spare + W + j] = yes, no
    told(w, r, spare, spare + W)


def granted(w, r, p, q, q_rows, spare):
    """Write into r the form q where form p is not zero, zero where it is, else what holds both."""
    negated(w, spare + W3, p, spare)
    for j in each(W):
        size = abs(w[q + j]) + w[q + W2 + j]
        no, unknown = w[spare + W3 + j], w[spare + W4 + j]
        factor = 1.0 - no
        w[r + j] = pick(factor == 0.0, 0.0, factor * w[q + j])
        left = factor * w[q + W + j] + unknown * size + (EPS * size + TINY)
        w[r + W + j] = pick(factor == 0.0, 0.0, left)
        w[spare + j] = factor
    scaled(w, r, q, q_rows, spare)
    closed(w, r, q_rows)


def step(w, op, r, p, p_rows, q, q_rows, spare, inverse):
    """Run one instruction: result r, operands p and q with some slopes each; scratch rows lie at spare."""
    if op == MUL:
        product(w, r, p, p_rows, q, q_rows)
    elif op == ADD or op == SUB:
        added(w, r, p, p_rows, q, q_rows, 1.0 if op == ADD else -1.0, spare)
    elif op == NEG or op == TWICE or op == ASSIGN:
        times(w, r, p, p_rows, -1.0 if op == NEG else (2.0 if op == TWICE else 1.0))
    elif op == SQ:
        square(w, r, p, p_rows, spare)
    elif op == DIV:
        inverted(w, inverse, q, q_rows, spare)
        product(w, r, p, p_rows, inverse, q_rows)
    elif op == INV:
        inverted(w, r, p, p_rows, spare)
    elif op == SQRT:
        rooted(w, r, p, p_rows, spare)
    elif op == FABS:
        folded(w, r, p, p_rows, spare)
    elif op == SIN or op == COS:
        turned(w, r, p, p_rows, spare, 0 if op == SIN else 1)
    elif op == FMIN or op == FMAX:
        extreme(w, r, p, p_rows, q, q_rows, spare, 1.0 if op == FMAX else -1.0)
    elif op == LT or op == LE:
        compared(w, r, p, q, spare)
    elif op == NOT:
        negated(w, r, p, spare)
    else:
        granted(w, r, p, q, q_rows, spare)


def run(code, slopes, inputs, w, spare, inverse, out):
    """Run a tape once over all lanes.

    Args:
        code: operation, and where result, first and second operand begin in w, (n, 4).
        slopes: how many slopes result, first and second operand have, (n, 3).
        inputs: forms of inputs and constants, one below the other, flat.
        w: room for all registers, scratch rows and one form more.
        spare: where the scratch rows begin in w.
        inverse: where that form does.
        out: forms of the outputs, flat.
    """
    for n in range(code.shape[0]):
        op, r, p, q = code[n, 0], code[n, 1], code[n, 2], code[n, 3]
        rows = slopes[n, 0]
        if op == INPUT:
            for i in range(THREE + rows):
                for j in each(W):
                    w[r + W * i + j] = inputs[p + W * i + j]
        elif op == OUTPUT:
            rows = slopes[n, 1]
            for i in range(THREE + rows):
                for j in each(W):
                    out[r + W * i + j] = w[p + W * i + j]
        else:
            step(w, op, r, p, slopes[n, 1], q, slopes[n, 2], spare, inverse)
