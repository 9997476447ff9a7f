"""What a recording says of its plan: errors, drifts and forces at every kept instant, as one table."""

import numpy as np
import pandas as pd

from nlpweld.cell import Grasp
from nlpweld.plan import Plan, joint_counts
from nlpweld.sim.model import handlers
from nlpweld.sim.planned import (
    carried_by,
    carried_work,
    planned,
    planned_tcps,
    weld_points,
    welding,
)
from nlpweld.sim.recording import Recording
from nlpweld.verify import reference as ref


def series(plan: Plan, kept: Recording) -> pd.DataFrame:
    """Return one row for each kept instant; columns end in their unit, and in the station's name where there is one.

    ``t_s``, ``s``, ``welding``; of every welder ``seam_error_m``, its TCP against the weld point on the workpiece as
    simulated, NaN where the plan does not weld; of every station ``plan_error_m`` and ``plan_error_rad``, its TCP
    against the planned one. Of every carrier ``drift_m`` and ``drift_rad``, its TCP against its grasp on the workpiece
    as simulated; ``gap_m`` and ``gap_rad``, the same on the planned paths with the workpiece as :func:`carried_by`
    holds it; ``force_n`` and ``torque_nm`` at the grasp; and of two or more ``squeeze_n``, half of what the first and
    the last press towards each other, negative where they pull. Of every joint ``servo_nm`` and ``servo_error_rad``;
    ``clearance_m``, NaN where it was not measured.

    Args:
        plan: the timed plan.
        kept: what its simulation kept.
    """
    columns: dict[str, np.ndarray] = {
        "t_s": kept.t_s,
        "s": plan.needed_timeline.s_at(kept.t_s),
        "welding": welding(plan, kept.t_s),
    }
    meant = planned_tcps(plan, kept.t_s)
    columns |= _torches(plan, kept, meant) | _grasps(plan, kept, meant) | _servos(plan, kept)
    return pd.DataFrame(columns | {"clearance_m": kept.clearance_m})


def _torches(plan: Plan, kept: Recording, meant: np.ndarray) -> dict[str, np.ndarray]:
    """Return errors of torches against the seam, and of all TCPs against the planned ones (K, S, 4, 4)."""
    columns, on = {}, welding(plan, kept.t_s)
    for k, station in enumerate(plan.cell.stations):
        if not isinstance(station.coupling, Grasp):
            p_C = weld_points(plan, station, kept.t_s)
            p_W = np.einsum("kij,kj->ki", kept.work[:, :3, :3], p_C) + kept.work[:, :3, 3]
            off = np.linalg.norm(kept.tcp[:, k, :3, 3] - p_W, axis=-1)
            columns[f"seam_error_m.{station.name}"] = np.where(on, off, np.nan)
        off_m, off_rad = ref.error_size(ref.pose_error(meant[:, k], kept.tcp[:, k]))
        columns |= {f"plan_error_m.{station.name}": off_m, f"plan_error_rad.{station.name}": off_rad}
    return columns


def _grasps(plan: Plan, kept: Recording, meant: np.ndarray) -> dict[str, np.ndarray]:
    """Return drifts, gaps and forces at the grasps; ``meant`` as in :func:`_torches`."""
    carriers = handlers(plan.cell)
    if not carriers:
        return {}
    columns: dict[str, np.ndarray] = {}
    work = carried_work(plan, kept.t_s)
    order = [station.name for station in plan.cell.stations]
    for g, station in enumerate(carriers):
        assert isinstance(station.coupling, Grasp)
        name, k, T_C_E = station.name, order.index(station.name), station.coupling.T_C_E
        drift = ref.error_size(ref.pose_error(kept.work @ T_C_E, kept.tcp[:, k]))
        gap = ref.error_size(ref.pose_error(work @ T_C_E, meant[:, k]))
        if station is carried_by(plan):
            gap = (np.zeros(len(work)), np.zeros(len(work)))
        sizes = np.linalg.norm(kept.wrench[:, g].reshape(-1, 2, 3), axis=-1).T
        kinds = ("drift_m", "drift_rad", "gap_m", "gap_rad", "force_n", "torque_nm")
        columns |= {f"{kind}.{name}": x for kind, x in zip(kinds, (*drift, *gap, *sizes), strict=True)}
    if len(carriers) > 1:
        columns["squeeze_n"] = _squeeze(kept.wrench[:, 0, :3], kept.wrench[:, -1, :3], kept, plan)
    return columns


def _squeeze(first: np.ndarray, last: np.ndarray, kept: Recording, plan: Plan) -> np.ndarray:
    """Return half of what two forces (K, 3) press towards each other along the line between their grasps, (K,) [N]."""
    ends = [kept.work @ station.coupling.T_C_E for station in handlers(plan.cell)]  # type: ignore[union-attr]
    way = ends[-1][:, :3, 3] - ends[0][:, :3, 3]
    along = way / np.linalg.norm(way, axis=-1, keepdims=True)
    return ((first - last) * along).sum(axis=-1) / 2


def _servos(plan: Plan, kept: Recording) -> dict[str, np.ndarray]:
    """Return torque and error of every joint."""
    off = kept.q - planned(plan.cell, plan.needed_timeline, kept.t_s)
    names = [f"{name}.J{k + 1}" for name, n in joint_counts(plan.cell).items() for k in range(n)]
    columns = {f"servo_nm.{name}": kept.torque_nm[:, i] for i, name in enumerate(names)}
    return columns | {f"servo_error_rad.{name}": off[:, i] for i, name in enumerate(names)}
