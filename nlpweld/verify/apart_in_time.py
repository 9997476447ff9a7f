"""How near bodies come along a timeline: looked at so often that none of them moves far in between."""

from dataclasses import dataclass

import numpy as np

from nlpweld.plan import Plan
from nlpweld.timeline import Timeline
from nlpweld.verify.bodies import BodyTable, all_ends, body_table, floor_distances
from nlpweld.verify.exact import pair_distances, shared
from nlpweld.verify.in_time import Moving, between_instants, moving

LOOKS = 4  # parts of an interval between which the way of bodies is measured


@dataclass(frozen=True, eq=False)
class Apart:
    """Distances along a timeline.

    Attributes:
        t_s: instants looked at, shape (K,).
        distance_m: of every pair, then of every body above the floor, shape (K, P + F).
        table: bodies and pairs.
    """

    t_s: np.ndarray
    distance_m: np.ndarray
    table: BodyTable

    def nearest(self, begin_s: float, end_s: float) -> tuple[float, str, float]:
        """Return least distance [m], its pair and when, between two instants; the nearest look where there is none."""
        inside = np.flatnonzero((self.t_s >= begin_s) & (self.t_s <= end_s))
        if len(inside) == 0:
            inside = np.array([np.abs(self.t_s - begin_s).argmin()])
        k, pair = np.unravel_index(self.distance_m[inside].argmin(), self.distance_m[inside].shape)
        return float(self.distance_m[inside[k], pair]), self.table.pair_labels[pair], float(self.t_s[inside[k]])


def apart(plan: Plan, timeline: Timeline) -> Apart:
    """Return the distances of all pairs along a whole timeline.

    Between two looks no body end moves more than the cell's ``verify_step_m``, as measured in quarters of the
    timeline's intervals.

    Raises:
        VerifierError: the geometry process hung or died twice.
    """
    t = between_instants(timeline.t_s, LOOKS)
    ends = _ends(moving(plan, timeline, t))
    way = np.linalg.norm(np.diff(ends, axis=0), axis=-1).max(axis=(1, 2))
    parts = np.maximum(1, np.ceil(way / plan.cell.constraints.verify_step_m)).astype(int)
    # looks that are not needed are left out: bodies then move no farther in between than a step
    gone = np.concatenate([[0.0], np.cumsum(way)])
    slot = np.floor(gone / plan.cell.constraints.verify_step_m).astype(int)
    keep = np.concatenate([[True], (np.diff(slot) > 0) | (parts > 1)])
    keep[-1] = True
    keep[:-1] |= parts > 1
    dense = [np.linspace(a, b, n + 1)[1:-1] for a, b, n in zip(t, t[1:], parts, strict=False) if n > 1]
    looks = np.unique(np.concatenate([t[keep], *dense]))
    ends = _ends(moving(plan, timeline, looks))
    table = body_table(plan.cell)
    pairs = pair_distances(shared(), ends, table.radius_m, table.pairs)
    return Apart(looks, np.concatenate([pairs, floor_distances(table, ends)], axis=1), table)


def _ends(seen: Moving) -> np.ndarray:
    return all_ends(seen.cell, seen.T_W_C, seen.links, seen.tcps)
