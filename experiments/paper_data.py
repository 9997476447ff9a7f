"""Data behind the figures of Pan et al.: seam, profiles, arms and ellipsoids, and the solvers' paths, as tables."""

from dataclasses import replace

import numpy as np
import pandas as pd

from nlpweld.cell import Cell, Station
from nlpweld.formulation.nlp import Evaluation, Nlp
from nlpweld.geometry.seam import weld_frames
from nlpweld.plan import Plan
from nlpweld.records.frames import AXES
from nlpweld.records.model import Record
from nlpweld.solvers import Budget, make_solver
from nlpweld.verify import Report, reference

FAR_M = 0.4  # a path that starts this far from the optimum shows the way


def welder(cell: Cell) -> Station:
    """Return the first loosely coupled station."""
    return next(s for s in cell.stations if s.coupling.kind == "loose")


def seam_table(plan: Plan) -> pd.DataFrame:
    """Return the weld points in C, turned flat about the origin of C, and in the welder's base frame (eq. 17, 6-8).

    Columns: s; x_C_m .. z_C_m; x_flat_m .. z_flat_m; x_B_m .. z_B_m.
    """
    s = np.append(plan.s, 1.0)
    p_C = weld_frames(plan.cell, s).p_C
    T_W_C = reference.workpiece_pose(plan.cell, plan.placement_m, s)
    flat = np.einsum("mij,mj->mi", T_W_C[:, :3, :3], p_C)
    T_W_B = reference.base_pose(welder(plan.cell))
    p_B = (flat + plan.placement_m - T_W_B[:3, 3]) @ T_W_B[:3, :3]
    columns = [f"{axis}_{frame}_m" for frame in ("C", "flat", "B") for axis in "xyz"]
    return pd.DataFrame(np.column_stack([s, p_C, flat, p_B]), columns=["s", *columns])


def profile_table(report: Report) -> pd.DataFrame:
    """Return the measures along the seam: s, mmr, m_tight, m_loose, clearance_m and w of each robot [m^3]."""
    profile = report.profile
    table = pd.DataFrame({name: profile[name] for name in ("s", "mmr", "m_tight", "m_loose", "clearance_m")})
    for robot in report.manipulability_mean:
        table[f"w_{robot}_m3"] = profile[f"manipulability.{robot}"]
    return table


def arm_table(plan: Plan, point: int) -> pd.DataFrame:
    """Return the links of every robot at one seam point: robot, link, x_m, y_m, z_m; the last link is the TCP.

    The workpiece's bodies follow under their own names, each with the two ends of its axis.
    """
    T_W_C = reference.workpiece_pose(plan.cell, plan.placement_m, plan.s[[point]])
    works = zip(plan.cell.workpiece.bodies, reference.workpiece_ends(plan.cell, T_W_C)[0], strict=True)
    rows = [
        {"robot": b.name, "link": i, **dict(zip(AXES, p, strict=True))} for b, ends in works for i, p in enumerate(ends)
    ]
    for station in plan.cell.stations:
        T_W_L, T_W_E, _ = _kinematics(plan, station, point)
        for i, p in enumerate([*T_W_L[0, :, :3, 3], T_W_E[0, :3, 3]]):
            rows.append({"robot": station.name, "link": i, **dict(zip(AXES, p, strict=True))})
    return pd.DataFrame(rows)


def ellipsoid_table(plan: Plan, report: Report, point: int) -> pd.DataFrame:
    """Return J_v J_v^T of every robot at one seam point as core_11 .. core_33 [m^2/rad^2], TCP, s and r_k."""
    rows = []
    for station in plan.cell.stations:
        _, T_W_E, J = _kinematics(plan, station, point)
        core = J[0, :3] @ J[0, :3].T
        names = {f"core_{i + 1}{j + 1}": core[i, j] for i in range(3) for j in range(3)}
        at = dict(zip(AXES, T_W_E[0, :3, 3], strict=True))
        ratio = report.profile[f"ratio.{station.name}"][point]
        rows.append({"robot": station.name, "s": plan.s[point], **at, **names, "ratio": ratio})
    return pd.DataFrame(rows)


def _kinematics(plan: Plan, station: Station, point: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    T_W_L = reference.link_poses(station, plan.paths[station.name][[point]])
    T_W_E = reference.tcp_pose(station, T_W_L)
    return T_W_L, T_W_E, reference.jacobian(T_W_L, T_W_E)


def ga_individuals(nlp: Nlp, seed: int, budget: Budget) -> pd.DataFrame:
    """Return every individual the GA evaluates: generation, x_m, y_m, z_m, mmr, feasible."""
    broods: list[tuple[np.ndarray, Evaluation]] = []

    def watched(X: np.ndarray) -> Evaluation:
        found = nlp.evaluate(X)
        broods.append((np.array(X), found))
        return found

    make_solver("ga").solve(replace(nlp, evaluate=watched), seed=seed, budget=budget)
    tables = [
        pd.DataFrame(X, columns=list(AXES)).assign(generation=g, mmr=found.objective, feasible=found.feasible)
        for g, (X, found) in enumerate(broods, start=1)
    ]
    table = pd.concat(tables, ignore_index=True)
    table["mmr"] = table["mmr"].where(np.isfinite(table["mmr"]))
    return table[["generation", *AXES, "mmr", "feasible"]]


def ipopt_path(records: list[Record], optimum: np.ndarray) -> pd.DataFrame:
    """Return Ipopt's iterates in the verified run with the shortest trace among those that start far away.

    Columns: seed, iteration, x_m, y_m, z_m; empty without a verified run.
    """
    good = [r for r in records if r.verified and r.trace.time_s]
    paths = [(r.seed, np.array([r.trace.placement[a] for a in AXES]).T) for r in good]
    far = [p for p in paths if np.linalg.norm(p[1][0] - optimum) > FAR_M] or paths
    if not far:
        return pd.DataFrame(columns=["seed", "iteration", *AXES])
    seed, path = min(far, key=lambda p: len(p[1]))
    return pd.DataFrame(path, columns=list(AXES)).assign(seed=seed, iteration=range(len(path)))
