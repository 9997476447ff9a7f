"""Timed plans for tests: cheap, and without the timing package."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from nlpweld.plan import Plan
from nlpweld.timeline import Timeline, Track
from nlpweld.verify.between import closed_near
from nlpweld.verify.freedom import Offsets


def timed(plan: Plan, duration_s: float, instants: int, until: float = 1.0) -> Plan:
    """Return a plan welded from s = 0 to a share of its seam, at a speed that begins and ends at rest.

    Chains are closed at every instant; between them the timeline's quintics leave them open by little.
    """
    t = np.linspace(0.0, duration_s, instants)
    x = t / duration_s
    s = until * np.minimum(x**3 * (10 - 15 * x + 6 * x**2), 1.0)
    own, paths = plan.s, plan.paths
    if plan.cell.seam.closed:
        own = np.append(plan.s, 1.0)
        turns = {n: 2 * np.pi * np.round((q[-1] - q[0]) / (2 * np.pi)) for n, q in paths.items()}
        paths = {name: np.vstack([q, q[0] + turns[name]]) for name, q in paths.items()}
    start = {name: np.column_stack([np.interp(s, own, joint) for joint in q.T]) for name, q in paths.items()}
    free = None if plan.freedom is None else Offsets(plan.s, plan.cell.seam.closed, plan.freedom)
    q, unclosed = closed_near(plan.cell, plan.placement, s, start, free)
    assert not unclosed
    tracks = {name: track(t, path) for name, path in q.items()}
    return plan.timed(Timeline(t, s, (("weld", duration_s),), tracks))


def track(t: np.ndarray, q: np.ndarray) -> Track:
    """Return a joint path that begins and ends at rest."""
    curve = CubicSpline(t, q, bc_type="clamped")
    return Track(q, curve(t, 1), curve(t, 2))


def offset(plan: Plan, name: str, by_rad: np.ndarray) -> Plan:
    """Return a timed plan with one robot's whole track shifted."""
    assert plan.timeline is not None
    tracks = dict(plan.timeline.tracks)
    tracks[name] = replace(tracks[name], q=tracks[name].q + by_rad)
    return plan.timed(replace(plan.timeline, tracks=tracks))
