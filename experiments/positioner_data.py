"""Data behind the figures of Zhang et al.: weld frames, weld positions, and speeds along densely sampled seams."""

import numpy as np
import pandas as pd

from nlpweld.cell import Cell
from nlpweld.errors import NlpweldError
from nlpweld.formulation.reduced import reduced
from nlpweld.geometry.composite import seam_length_m
from nlpweld.geometry.seam import breaks
from nlpweld.geometry.weld_angles import iso_position, weld_angles
from nlpweld.plan import Plan
from nlpweld.verify import reference

ROUND_OFF_DEG = 6  # decimals kept of angles and speeds; what lies beyond is round-off
WELDING_MM_S = 5.0  # Zhang et al. print no speed: chosen


def frame_table(cell: Cell, s: np.ndarray) -> pd.DataFrame:
    """Return the weld frames {p} of every seam in C: seam, s, x_m .. z_m, and the axes as x_1 .. z_3."""
    tables = []
    for name in cell.seams:
        T = reference.weld_pose(cell, s, name)
        axes = T[:, :3, :3].transpose(0, 2, 1).reshape(len(s), 9)
        columns = ["x_m", "y_m", "z_m", *(f"{axis}_{i}" for axis in "xyz" for i in (1, 2, 3))]
        table = pd.DataFrame(np.column_stack([T[:, :3, 3], axes]), columns=columns).round(12) + 0.0
        tables.append(table.assign(seam=name, s=s))
    return pd.concat(tables, ignore_index=True)[["seam", "s", *columns]]


def weld_position_table(plan: Plan, placement: str) -> pd.DataFrame:
    """Return how every seam of a plan lies at each point while it is welded (ISO 6947; Zhang et al., Fig. 1).

    Columns: cell, placement, seam, point, s, iso, slope_deg, rotation_deg, deviation_deg, and how far slope and
    rotation are off the main position, slope_off_deg and rotation_off_deg.
    """
    cell, tables = plan.cell, []
    table_q = plan.paths[cell.positioner.name] if cell.positioner else None
    R_W_C = reference.workpiece_pose(cell, plan.placement, plan.s, table_q)[:, :3, :3]
    for name in cell.seams:
        slope, rotation, deviation = weld_angles(R_W_C @ reference.weld_pose(cell, plan.s, name)[:, :3, :3])
        iso = iso_position(slope, rotation)
        angles = {"slope": slope, "rotation": rotation, "deviation": deviation}
        angles |= {"slope_off": iso.slope_off, "rotation_off": iso.rotation_off}
        columns = {f"{key}_deg": np.degrees(v).round(ROUND_OFF_DEG) + 0.0 for key, v in angles.items()}
        head = {"cell": cell.name, "placement": placement, "seam": name, "point": range(len(plan.s)), "s": plan.s}
        tables.append(pd.DataFrame({**head, "iso": iso.name, **columns}))
    return pd.concat(tables, ignore_index=True)


def dense(cell: Cell, points: int) -> Cell:
    """Return the cell with so many points on each of its seams."""
    others = {
        name: {**seam.model_dump(exclude_unset=True), "points": points} for name, seam in cell.other_seams.items()
    }
    return cell.with_(seam={"points": points}, **({"other_seams": others} if others else {}))


def dense_plan(cell: Cell, placement: tuple[float, ...]) -> Plan:
    """Return the joint paths at a placement, on the branches the exact model takes there.

    Raises:
        NlpweldError: a robot cannot reach a point.
    """
    nlp, x = reduced(cell, engine="numpy"), cell.coordinates(np.array(placement))
    plan = nlp.unpack(x, int(nlp.evaluate(x[None]).mode[0]))
    if not isinstance(plan, Plan):
        raise NlpweldError(f"{cell.name}: {plan.station} cannot reach point {plan.point} from {list(placement)}")
    return plan


def inner_breaks(cell: Cell) -> np.ndarray:
    """Return the seam parameters strictly inside the seam where its pieces join."""
    joints = breaks(cell)
    return joints[joints > 0.0]


def along(plan: Plan, name: str, label: str) -> pd.DataFrame:
    """Return joint angles and speeds of a robot or positioner along the seam, welded at ``WELDING_MM_S``.

    Differences are taken within each piece of the seam, never across a break. Directions are those of the DH frames.
    Columns: piece, s, arc_mm, time_s, then for each joint ``<label>1_deg`` .. and ``<label>1_deg_s`` ...
    """
    piece = np.searchsorted(inner_breaks(plan.cell), plan.s, side="right")
    length_mm, q = 1e3 * seam_length_m(plan.cell.seam), np.degrees(plan.paths[name])
    arc_mm, speed = plan.s * length_mm, np.empty_like(q)
    for k in np.unique(piece):
        own = piece == k
        speed[own] = WELDING_MM_S * np.gradient(q[own], arc_mm[own], axis=0, edge_order=2)
    head = {"piece": piece, "s": plan.s, "arc_mm": arc_mm, "time_s": arc_mm / WELDING_MM_S}
    angles = {f"{label}{i}_deg": column.round(ROUND_OFF_DEG) + 0.0 for i, column in enumerate(q.T, start=1)}
    speeds = {f"{label}{i}_deg_s": column.round(ROUND_OFF_DEG) + 0.0 for i, column in enumerate(speed.T, start=1)}
    return pd.DataFrame({**head, **angles, **speeds})


def at_breaks(table: pd.DataFrame, cell: Cell) -> pd.DataFrame:
    """Return the speeds on both sides of each break, each side's last two samples carried on to it.

    Columns: s, arc_mm, time_s, side (``before`` or ``after``), and the speeds of the table.
    """
    speeds = [name for name in table.columns if name.endswith("_deg_s")]
    length_mm, rows = 1e3 * seam_length_m(cell.seam), []
    for k, s in enumerate(inner_breaks(cell)):
        for side, piece, two in (("before", k, slice(-2, None)), ("after", k + 1, slice(0, 2))):
            near = table[table["piece"] == piece].iloc[two]
            share = (s - near["s"].iloc[0]) / (near["s"].iloc[1] - near["s"].iloc[0])
            values = near[speeds].iloc[0] + share * (near[speeds].iloc[1] - near[speeds].iloc[0])
            arc_mm = s * length_mm
            rows.append({"s": s, "arc_mm": arc_mm, "time_s": arc_mm / WELDING_MM_S, "side": side, **values})
    table = pd.DataFrame(rows, columns=["s", "arc_mm", "time_s", "side", *speeds])
    table[speeds] = table[speeds].round(ROUND_OFF_DEG) + 0.0
    return table
