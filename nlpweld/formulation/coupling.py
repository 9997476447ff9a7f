"""How each chain hangs on the workpiece frame: tight and loose coordination, master and slaves.

Pan et al., eq. 1 to 8; Zhang et al., eq. 5 to 15.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.cell import VARIABLES, Cell
from nlpweld.cell.layout import BASE_AXES
from nlpweld.cell.station import Station
from nlpweld.cell.task import Grasp, Torch, TorchAngles
from nlpweld.formulation.freedom import TILTS, turn, turned_work
from nlpweld.formulation.holder import held, posture_frames
from nlpweld.formulation.set_up import SetUp, set_up
from nlpweld.formulation.tilting import TiltedTable, table_data, tilted_table
from nlpweld.geometry.seam import weld_frames
from nlpweld.geometry.torch_angles import torch_pose
from nlpweld.geometry.weld_angles import weld_rotations
from nlpweld.kinematics.chain import Frame, constant, rpy_pose
from nlpweld.kinematics.torch import torch_frame

Names = tuple[str, ...]  # of free angles

FACING = np.diag([1.0, -1.0, -1.0, 1.0])  # T_H_E: the torch's TCP looks at the weld, {H} away from it


@dataclass(frozen=True)
class WeldPoint:
    """Symbols of one seam point.

    Attributes:
        T_P_C: workpiece in the placement frame {P} while the point is welded, turned as its free angles say.
        targets: for each station where its TCP is to be in C; the origin alone counts for a torch with a heading,
            and nothing for a handler.
        spins: for each station by how much its torch is spun, or None [rad].
        ends_P: ends of the positioner's moving bodies in {P}, side by side, shape (3, 2b) [m].
        data: what is known of the point, shape (k, 1), in the order of :func:`point_data`.
        free: its free angles, shape (f, 1) [rad].
        table: the positioner, where it tilts the weld by free angles.
        set_up: by how much {P} and bases are off, or None where they are as stated.
    """

    T_P_C: Frame
    targets: tuple[Frame | None, ...]
    spins: tuple[ca.SX | None, ...]
    ends_P: ca.SX
    data: ca.SX
    free: ca.SX
    table: TiltedTable | None = None
    set_up: SetUp | None = None

    @property
    def vector(self) -> ca.SX:
        """Data, then free angles, shape (k + f, 1)."""
        return ca.vertcat(self.data, self.free)


def weld_point(cell: Cell, free: Names = (), errors: bool = False) -> WeldPoint:
    """Return fresh symbols for a seam point at which some angles are free, perhaps in a cell whose set-up is off."""
    u = ca.SX.sym("free", len(free))
    angles = dict(zip(free, ca.vertsplit(u), strict=True)) if free else {}
    table = tilted_table(cell.positioner, *(angles[t] for t in TILTS)) if cell.positioner and tilts(free) else None
    T_P_C, blocks = (table.T_P_C, [*table.symbols]) if table else _work(cell, angles)
    targets: list[Frame | None] = []
    for station in cell.stations:
        target, symbols = _target(station, angles)
        targets.append(target)
        blocks += symbols
    ends_P = _table_ends(cell, table.links) if table else ca.SX.sym("ends_P", 3, 2 * len(moving_bodies(cell)))
    off, symbols = set_up(len(cell.stations)) if errors else (None, [])
    data = ca.vertcat(*[ca.vec(block) for block in [*blocks, *([] if table else [ends_P]), *symbols]])
    spins = tuple(None if s.coupling.kind == "tight" else angles.get(f"spin.{s.name}") for s in cell.stations)
    return WeldPoint(T_P_C, tuple(targets), spins, ends_P, data, u, table, off)


def _work(cell: Cell, angles: dict[str, ca.SX]) -> tuple[Frame, list[ca.SX]]:
    """Return the workpiece in {P} where no positioner tilts it, and the symbols it takes from the point's data."""
    blocks = [ca.SX.sym("R_P_C", 3, 3)]
    if cell.positioner:
        blocks.append(ca.SX.sym("p_P_C", 3))
    nominal = Frame(blocks[0], blocks[1] if cell.positioner else ca.SX(3, 1))
    R_P_p = ca.SX.sym("R_P_p", 3, 3) if tilts(tuple(angles)) else None
    return turned_work(nominal, R_P_p, angles), blocks + ([] if R_P_p is None else [R_P_p])


def _table_ends(cell: Cell, links: list[Frame]) -> ca.SX:
    """Return the ends of the positioner's moving bodies, side by side, shape (3, 2b) [m], in the links' frame."""
    assert cell.positioner is not None
    bodies = [cell.positioner.robot.bodies[i] for i in moving_bodies(cell)]
    ends = [links[int(end.frame[4:])].point(end.at_m) for body in bodies for end in (body.start, body.end)]
    return ca.horzcat(*ends) if ends else ca.SX(3, 0)


def tilts(free: Names) -> bool:
    """Tell whether the workpiece may be tilted."""
    return "slope" in free


def _target(station: Station, angles: dict[str, ca.SX]) -> tuple[Frame | None, list[ca.SX]]:
    """Return a station's target in C and the symbols it takes from the point's data."""
    if isinstance(station.coupling, Grasp):
        return None, []
    p = ca.SX.sym(f"p_C_{station.name}", 3)
    held_at = station.coupling.angles
    if held_at is None:
        return Frame(ca.SX(3, 3), p), [p]
    R = ca.SX.sym(f"R_C_{station.name}", 3, 3)
    if f"travel.{station.name}" not in angles:
        return Frame(R, p), [R, p]
    travel, work = (
        np.radians(nominal) + angles[f"{name}.{station.name}"]
        for name, nominal in (("travel", held_at.travel_deg), ("work", held_at.work_deg))
    )
    T_p_H = torch_frame(travel, work, ca.SX(np.radians(held_at.spin_deg)), held_at.stand_off_m)
    return Frame(R, p) @ T_p_H @ constant(FACING), [R, p]


def point_data(cell: Cell, s: np.ndarray, free: Names = ()) -> np.ndarray:
    """Return the numbers behind :attr:`WeldPoint.data` at seam parameters s (N,), shape (k, N)."""
    tilting = cell.positioner if tilts(free) else None
    rows, ends = (table_data(cell, tilting, s), []) if tilting else _work_data(cell, s, tilts(free))
    for station in cell.stations:
        if isinstance(station.coupling, Torch):
            rows += _target_data(cell, station.coupling, s, f"travel.{station.name}" in free)
    return np.concatenate([*rows, *ends], axis=1).T


def _work_data(cell: Cell, s: np.ndarray, tilted: bool) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the numbers of :func:`_work`, and those of the ends of the positioner's moving bodies."""
    work = held(cell, s)
    rows = [_columns(work.T_P_C[:, :3, :3])]
    if cell.positioner:
        rows.append(work.T_P_C[:, :3, 3])
    if tilted:
        rows.append(_columns(work.T_P_C[:, :3, :3] @ posture_frames(cell, s)))
    return rows, [work.ends_P[:, moving_bodies(cell)].reshape(len(s), -1)]


def _target_data(cell: Cell, torch: Torch, s: np.ndarray, tilted: bool) -> list[np.ndarray]:
    frames = weld_frames(cell, s, torch.seam)
    if torch.angles is None:
        return [frames.p_C]
    if tilted:
        return [_columns(weld_rotations(frames)), frames.p_C]
    T_C_E = torch_target(cell, torch.seam, torch.angles, s)
    return [_columns(T_C_E[:, :3, :3]), T_C_E[:, :3, 3]]


def torch_target(cell: Cell, seam: str, angles: TorchAngles, s: np.ndarray) -> np.ndarray:
    """Return T_C_E, where a torch held against a seam's weld frames has its TCP, shape (N, 4, 4)."""
    frames = weld_frames(cell, s, seam)
    T_C_p = np.tile(np.eye(4), (len(s), 1, 1))
    T_C_p[:, :3, :3], T_C_p[:, :3, 3] = weld_rotations(frames), frames.p_C
    travel, work, spin = np.radians([angles.travel_deg, angles.work_deg, angles.spin_deg])
    return T_C_p @ torch_pose(travel, work, spin, angles.stand_off_m) @ FACING


def _columns(R: np.ndarray) -> np.ndarray:
    """Return rotations (N, 3, 3) as CasADi orders them, column by column, shape (N, 9)."""
    return R.transpose(0, 2, 1).reshape(len(R), 9)


def moving_bodies(cell: Cell) -> list[int]:
    """Return which of the positioner's bodies move with its joints."""
    bodies = cell.positioner.robot.bodies if cell.positioner else ()
    return [i for i, body in enumerate(bodies) if {body.start.frame, body.end.frame} != {"link0"}]


def placement_frame(cell: Cell, x: ca.SX) -> Frame:
    """Return T_W_P of free coordinates x (d, 1); those that are held are numbers."""
    whole = ca.SX(ca.DM(cell.search.bounds[0]))
    free = _fill(whole, cell, VARIABLES, x)
    if 3 not in free and cell.search.bounds[0, 3] == 0.0:
        return Frame(constant(np.eye(4)).R, whole[:3])
    c, s = ca.cos(whole[3]), ca.sin(whole[3])
    rows = [ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1)]
    return Frame(ca.sparsify(ca.vertcat(*rows)), whole[:3])


def base_frame(cell: Cell, k: int, x: ca.SX) -> Frame:
    """Return T_W_B of station k for free coordinates x (d, 1); what its layout holds is a number."""
    station, whole = cell.stations[k], ca.SX(ca.DM(cell.stations[k].base))
    free = _fill(whole, cell, [f"{station.name}.{axis}" for axis in BASE_AXES], x)
    p = ca.vertcat(whole[:2], station.base_position_m[2])
    if 2 not in free:
        return Frame(base_pose(station).R, p)
    level = constant(rpy_pose(station.base_position_m, (*station.base_rpy_deg[:2], 0.0)))
    return Frame(turn("z", whole[2]) @ level.R, p)


def _fill(whole: ca.SX, cell: Cell, names: Sequence[str], x: ca.SX) -> list[int]:
    """Write those of named coordinates that are free into a vector of all, and return which they are."""
    free = [i for i, name in enumerate(names) if name in cell.variables]
    for i in free:
        whole[i] = x[cell.variables.index(names[i])]
    return free


def tcp_pose(coupling: Grasp | Torch, T_W_C: Frame, target: Frame | None, spin: ca.SX | None = None) -> Frame:
    """Return T_W_E, where a coupling wants the tool while the workpiece is at T_W_C and the target in C is welded.

    Args:
        coupling: of the station.
        T_W_C: pose of the workpiece.
        target: see :class:`WeldPoint`.
        spin: turn of a torch about its own axis [rad]; none by default.
    """
    if isinstance(coupling, Grasp):
        return T_W_C @ constant(coupling.T_C_E)
    assert target is not None
    heading = coupling.heading_deg
    T_W_E = T_W_C @ target if heading is None else Frame(torch_rotation(heading), T_W_C.point(target.p))
    return T_W_E if spin is None else Frame(T_W_E.R @ turn("z", spin), T_W_E.p)


def torch_rotation(heading_deg: float) -> ca.SX:
    """Return R_W_E of a torch that points straight down, its x axis along a heading from +x_W."""
    heading = np.radians(heading_deg)
    x = np.array([np.cos(heading), np.sin(heading), 0.0])
    z = np.array([0.0, 0.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return constant(pose).R


def flange_pose(
    station: Station, T_W_C: Frame, target: Frame | None, spin: ca.SX | None = None, base: Frame | None = None
) -> Frame:
    """Return T_B_F, the flange pose in the station's base frame that its coupling asks for.

    The loop is closed here (Pan et al., eq. 7, 8; Zhang et al., eq. 15). The base T_W_B is as stated by default.
    """
    T_W_E = tcp_pose(station.coupling, T_W_C, target, spin)
    T_F_E = constant(rpy_pose(station.tool.translation_m, station.tool.rpy_deg))
    return (base or base_pose(station)).inverse() @ T_W_E @ T_F_E.inverse()


def base_pose(station: Station) -> Frame:
    """Return T_W_B of a station whose base stands where it is stated."""
    return constant(rpy_pose(station.base_position_m, station.base_rpy_deg))
