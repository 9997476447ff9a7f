"""Distances between capsules as CasADi graphs."""

import casadi as ca

TINY = 1e-12
ROUNDED_M = 1e-7  # how near to zero a distance is rounded


def segment_distance(
    start_a: ca.SX, end_a: ca.SX, start_b: ca.SX, end_b: ca.SX, sq_a: float | ca.SX, sq_b: float | ca.SX
) -> ca.SX:
    """Return the distance between two segments [m].

    The nearest points on the two infinite lines are clamped to the segments, first on a, then on b, then on a
    again, which is exact. Rounded near zero, so that crossing axes have a derivative, and never above the truth: what
    comes out is less than the distance by at most ``ROUNDED_M``.

    Args:
        start_a: one end of segment a, shape (3, 1) [m]; likewise end_a, start_b, end_b.
        end_a: the other end of segment a.
        start_b: one end of segment b.
        end_b: the other end of segment b.
        sq_a: squared length of segment a [m^2]: bodies are rigid, so this is no function of them.
        sq_b: squared length of segment b [m^2].
    """
    u, v, gap = end_a - start_a, end_b - start_b, start_a - start_b
    along, across, offset = ca.dot(u, v), ca.dot(u, gap), ca.dot(v, gap)
    a, b = ca.fmax(sq_a, TINY), ca.fmax(sq_b, TINY)
    free = _clamp((along * offset - across * b) / ca.fmax(a * b - along**2, TINY * a * b))
    t = _clamp((along * free + offset) / b)
    s = _clamp((along * t - across) / a)
    between = gap + s * u - t * v
    return ca.sqrt(ca.dot(between, between) + ROUNDED_M**2) - ROUNDED_M


def _clamp(x: ca.SX) -> ca.SX:
    return ca.fmin(ca.fmax(x, 0), 1)
