"""Where a timed plan means everything to be, from NumPy kinematics: what a simulation is measured against."""

import numpy as np

from nlpweld.cell import Cell, Grasp, Station
from nlpweld.plan import Plan, joint_counts
from nlpweld.sim.model import handlers
from nlpweld.timeline import Timeline
from nlpweld.verify import reference as ref
from nlpweld.verify.freedom import Offsets


def planned(cell: Cell, timeline: Timeline, t_s: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Return all joints' planned angles at instants (K,), or a derivative of them, shape (K, n) [rad; s].

    The order is that of a model's first coordinates.
    """
    at = timeline.at(t_s, derivative)
    return np.hstack([at[name] for name in joint_counts(cell)])


def planned_tcps(plan: Plan, t_s: np.ndarray) -> np.ndarray:
    """Return T_W_E of every station in order as planned, shape (K, S, 4, 4)."""
    at = plan.needed_timeline.at(t_s)
    tcps = [ref.tcp_pose(station, ref.link_poses(station, at[station.name])) for station in plan.cell.stations]
    return np.stack(tcps, axis=1)


def welding(plan: Plan, t_s: np.ndarray) -> np.ndarray:
    """Tell at which instants the plan welds, shape (K,)."""
    begin, end = plan.needed_timeline.span_s("weld")
    return (begin <= t_s) & (t_s <= end) & (begin < end)


def carried_by(plan: Plan) -> Station:
    """Return the carrier whose planned path is nearest to where the placement puts the workpiece while welding.

    The others are measured against it where their paths do not fit together; the first, of equals within a micrometre.
    """
    carriers, line = handlers(plan.cell), plan.needed_timeline
    begin, end = line.span_s("weld")
    t_s = np.linspace(begin, end, 50)
    at, s = line.at(t_s), line.s_at(t_s)
    off_m = []
    for station in carriers:
        wanted = ref.required_pose(plan.cell, station, plan.placement, s, free=_free(plan))
        tcp = ref.tcp_pose(station, ref.link_poses(station, at[station.name]))
        off_m.append(ref.error_size(ref.pose_error(wanted, tcp))[0].max())
    return carriers[int(np.round(off_m, 6).argmin())]


def carried_work(plan: Plan, t_s: np.ndarray) -> np.ndarray:
    """Return T_W_C as :func:`carried_by` holds it on its planned path, shape (K, 4, 4)."""
    station = carried_by(plan)
    assert isinstance(station.coupling, Grasp)
    tcp = ref.tcp_pose(station, ref.link_poses(station, plan.needed_timeline.at(t_s)[station.name]))
    return tcp @ np.linalg.inv(station.coupling.T_C_E)


def weld_points(plan: Plan, station: Station, t_s: np.ndarray) -> np.ndarray:
    """Return where on the workpiece a torch's TCP belongs while welding, in C, shape (K, 3) [m]."""
    coupling, cell = station.coupling, plan.cell
    assert not isinstance(coupling, Grasp)
    s = plan.needed_timeline.s_at(t_s)
    weld = ref.weld_pose(cell, s, coupling.seam)
    if coupling.angles is None:
        return weld[:, :3, 3]
    free = _free(plan)
    u = free.at(s) if free else {}
    held = ref.torch_pose(coupling.angles, *(u.get(f"{kind}.{station.name}", 0.0) for kind in ("travel", "work")))
    return (weld @ held)[:, :3, 3]


def _free(plan: Plan) -> Offsets | None:
    return None if plan.freedom is None else Offsets(plan.s, plan.cell.seam.closed, plan.freedom)
