"""Timed plans made cheaply: a spline through configurations that the verifier's own loop has closed."""

import dataclasses
import functools

import numpy as np
from scipy.interpolate import CubicSpline

from nlpweld.cell import load_cell
from nlpweld.plan import Plan
from nlpweld.timeline import Timeline, Track
from nlpweld.verify.between import closed_near
from tests.verify.conftest import AT, march
from tests.verify.welders import plan as plan_of_welders

APPROACH_S, WELD_S = 1.5, 20.0
POINTS = 36
PER_POINT = 8  # instants from one seam point to the next


@functools.cache
def carried() -> Plan:
    """Three robots, no positioner; the seam is closed."""
    return timed(march(load_cell("three_er16").with_(seam={"points": POINTS}), AT))


@functools.cache
def turned() -> Plan:
    """One robot and a positioner of two axes; the seam is closed."""
    return timed(plan_of_welders(load_cell("robot_positioner").with_(seam={"points": POINTS}), (0.0, -1.0)))


def timed(plan: Plan) -> Plan:
    """Return a plan with a timeline: everything comes from a little aside, welds once round and rests."""
    s = np.arange(PER_POINT * POINTS + 1) / (PER_POINT * POINTS)
    t_s = APPROACH_S + WELD_S * np.arccos(1 - 2 * s) / np.pi  # from rest to rest
    tracks = {}
    for name, q in _closed_at(plan, s).items():
        curve = CubicSpline(t_s, q, bc_type="clamped")
        rows = curve(t_s), curve(t_s, 1), curve(t_s, 2)
        aside = q[0] + np.radians(10) * np.cos(np.arange(q.shape[1]))
        starts = aside, np.zeros_like(aside), np.zeros_like(aside)
        tracks[name] = Track(*(np.vstack([a, b]) for a, b in zip(starts, rows, strict=True)))
    ends = (("approach", APPROACH_S), ("weld", float(t_s[-1])))
    return plan.timed(Timeline(np.append(0.0, t_s), np.append(0.0, s), ends, tracks))


def _closed_at(plan: Plan, s: np.ndarray) -> dict[str, np.ndarray]:
    """Return joints at seam parameters up to 1, closed from a spline through the plan's points."""
    knots = np.append(plan.s, 1.0)
    start = {}
    for name, q in plan.paths.items():
        back = q[0] + 2 * np.pi * np.round((q[-1] - q[0]) / (2 * np.pi))
        start[name] = CubicSpline(knots, np.vstack([q, back]))(s)
    found, unclosed = closed_near(plan.cell, plan.placement, s, start, None)
    assert not unclosed
    return found


def read_back(plan: Plan, t_s: np.ndarray, tracks: dict[str, Track]) -> Plan:
    """Return a plan of what was read, in DH direction; its points are where the original passes them."""
    s = plan.timeline.s_at(t_s)
    begin, end = plan.timeline.span_s("weld")
    welding = np.flatnonzero((t_s > begin - 1e-6) & (t_s < end + 1e-6))
    near = welding[[np.abs(s[welding] - point).argmin() for point in plan.s]]
    assert np.abs(s[near] - plan.s).max() < 1e-6, "the plan's points are not all among the instants"
    bare = dataclasses.replace(plan, paths={name: track.q[near] for name, track in tracks.items()})
    return bare.timed(Timeline(t_s, s, plan.timeline.phases, tracks))


def splined(t_s: np.ndarray, q: np.ndarray) -> Track:
    """Return a track through angles alone, from rest to rest."""
    curve = CubicSpline(t_s, q, bc_type="clamped")
    return Track(q, curve(t_s, 1), curve(t_s, 2))
