"""What a recording comes to: peaks, least distances, and the levels that were not kept."""

import math

import numpy as np
import pandas as pd

from nlpweld.cell import Grasp
from nlpweld.plan import Plan, joint_counts
from nlpweld.sim.model import handlers
from nlpweld.sim.options import Levels, SimOptions
from nlpweld.sim.planned import planned
from nlpweld.sim.recording import Recording
from nlpweld.sim.report import Complaint, GraspResult, Peak, SimReport, TorchResult, deepest
from nlpweld.verify.scene import limits_rad

ROUNDING_RAD = 1e-9


def summarise(plan: Plan, kept: Recording, table: pd.DataFrame, options: SimOptions, wall_s: float) -> SimReport:
    """Return the report of a simulation.

    Args:
        plan: the timed plan.
        kept: what its simulation kept.
        table: of :func:`~nlpweld.sim.measure.series`.
        options: what was taken for granted.
        wall_s: what stepping took.
    """
    welders = [station.name for station in plan.cell.stations if not isinstance(station.coupling, Grasp)]
    torches = {name: _torch(table, name) for name in welders}
    kinds = ("drift_m", "drift_rad", "gap_m", "gap_rad", "force_n", "torque_nm")
    grasps = {s.name: GraspResult(*(_peak(table, f"{k}.{s.name}") for k in kinds)) for s in handlers(plan.cell)}
    least = _lowest(kept)
    step = options.numerics.step_s
    return SimReport(
        cell=plan.cell.name,
        from_s=float(kept.t_s[0]),
        until_s=float(kept.t_s[-1]),
        torches=torches,
        grasps=grasps,
        squeeze_n=_peak(table, "squeeze_n") if "squeeze_n" in table else None,
        servo_nm=_by_mover(plan, table, "servo_nm"),
        servo_error_rad=_by_mover(plan, table, "servo_error_rad"),
        clearance_m=math.nan if least is None else float(kept.clearance_m[least]),
        clearance_s=math.nan if least is None else float(kept.t_s[least]),
        clearance_pair=None if least is None else kept.pairs[kept.clearance_pair[least]],
        contacts=tuple(kept.contacts),
        wall_s=wall_s,
        steps=round((kept.t_s[-1] - kept.t_s[0]) / step) + 1,
        options=options,
        complaints=tuple(_complaints(torches, grasps, kept, options.levels) + _stops(plan, kept)),
    )


def _complaints(
    torches: dict[str, TorchResult], grasps: dict[str, GraspResult], kept: Recording, levels: Levels
) -> list[Complaint]:
    """Return the levels that were not kept: contacts, grasps, torches; only the divergence, where numbers ended."""
    if kept.diverged_s is not None:
        return [Complaint("diverged", "", kept.diverged_s, math.nan, math.nan, "")]
    found = [Complaint("contact", c.pair, c.deepest_s, c.depth_m, 0.0, "m") for c in deepest(kept.contacts)]
    limits = (
        ("gap", "gap_m", levels.grasp_m, "m"),
        ("gap", "gap_rad", levels.grasp_rad, "rad"),
        ("drift", "drift_m", levels.grasp_m, "m"),
        ("drift", "drift_rad", levels.grasp_rad, "rad"),
        ("force", "force_n", levels.grasp_n, "N"),
        ("torque", "torque_nm", levels.grasp_nm, "N m"),
    )
    for what, field, limit, unit in limits:
        peaks = {name: getattr(grasp, field) for name, grasp in grasps.items()}
        found += [Complaint(what, n, p.at_s, p.value, limit, unit) for n, p in peaks.items() if p.value > limit]
    seams = {name: torch.seam_m for name, torch in torches.items()}
    over = levels.torch_m
    return found + [Complaint("torch", n, p.at_s, p.value, over, "m") for n, p in seams.items() if p.value > over]


def _stops(plan: Plan, kept: Recording) -> list[Complaint]:
    """Return the joints whose planned angles leave their limits, each at the worst instant."""
    low, high = np.vstack(list(limits_rad(plan.cell).values())).T
    meant = planned(plan.cell, plan.needed_timeline, kept.t_s)
    beyond = np.maximum(low - meant, meant - high)
    names = [f"{name}.J{k + 1}" for name, n in joint_counts(plan.cell).items() for k in range(n)]
    worst = beyond.argmax(axis=0)
    return [
        Complaint("stop", name, float(kept.t_s[worst[i]]), float(beyond[worst[i], i]), 0.0, "rad")
        for i, name in enumerate(names)
        if beyond[worst[i], i] > ROUNDING_RAD
    ]


def _torch(table: pd.DataFrame, name: str) -> TorchResult:
    seam = table[f"seam_error_m.{name}"].to_numpy()
    rms = float(np.sqrt(np.nanmean(seam**2))) if np.isfinite(seam).any() else math.nan
    peaks = (_peak(table, f"{kind}.{name}") for kind in ("plan_error_m", "plan_error_rad"))
    return TorchResult(_peak(table, f"seam_error_m.{name}"), rms, *peaks)


def _peak(table: pd.DataFrame, column: str) -> Peak:
    """Return the value of largest size in a column, and when."""
    values = table[column].to_numpy()
    if not np.isfinite(values).any():
        return Peak(math.nan, math.nan)
    i = int(np.nanargmax(np.abs(values)))
    return Peak(float(values[i]), float(table["t_s"].iloc[i]))


def _lowest(kept: Recording) -> int | None:
    """Return at which instant clearance is least."""
    return int(np.nanargmin(kept.clearance_m)) if np.isfinite(kept.clearance_m).any() else None


def _by_mover(plan: Plan, table: pd.DataFrame, kind: str) -> dict[str, tuple[float, ...]]:
    counts = joint_counts(plan.cell)
    return {
        name: tuple(float(table[f"{kind}.{name}.J{k + 1}"].abs().max()) for k in range(n)) for name, n in counts.items()
    }
