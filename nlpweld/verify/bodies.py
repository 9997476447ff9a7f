"""All bodies of a cell in one table, and the pairs that must keep their distance."""

from dataclasses import dataclass

import numpy as np

from nlpweld.cell import Cell
from nlpweld.verify import reference as ref

WORKPIECE = "workpiece"
FLOOR = "floor"


@dataclass(frozen=True, eq=False)
class BodyTable:
    """Capsules of every robot and of the workpiece, in a fixed order.

    Attributes:
        owner: station name of each body, or ``workpiece``.
        label: ``owner.body`` of each body.
        radius_m: shape (B,).
        pairs: indices of the bodies of every pair looked at, shape (P, 2).
        above_floor: indices of the bodies that must stay above z_W = 0, shape (F,).
    """

    owner: tuple[str, ...]
    label: tuple[str, ...]
    radius_m: np.ndarray
    pairs: np.ndarray
    above_floor: np.ndarray

    @property
    def pair_labels(self) -> list[str]:
        """Text for every pair, then for every body above the floor; the columns of a clearance array."""
        between = [f"{self.label[i]} - {self.label[j]}" for i, j in self.pairs]
        return between + [f"{self.label[i]} - {FLOOR}" for i in self.above_floor]

    @property
    def pair_owners(self) -> list[str]:
        """The robot a pair is charged to: that of its first body, or the workpiece on its own."""
        return [self.owner[i] for i in [*self.pairs[:, 0], *self.above_floor]]


def body_table(cell: Cell) -> BodyTable:
    """Return the bodies and pairs of a cell.

    Pairs are every two bodies of different robots; every robot body with every workpiece body, but for those the
    coupling lets touch; and the floor with everything, but for bodies fixed to a robot's base.
    """
    owner, names, radius, fixed, excused = [], [], [], [], []
    for station in cell.stations:
        for body in station.bodies:
            owner.append(station.name)
            names.append(body.name)
            radius.append(body.radius_m)
            fixed.append(body.start.frame == body.end.frame == "link0")
            touching = (pair.split("/") for pair in station.coupling.may_touch)
            excused.append({work for own, work in touching if own == body.name})
    for capsule in cell.workpiece.bodies:
        owner.append(WORKPIECE)
        names.append(capsule.name)
        radius.append(capsule.radius_m)
        fixed.append(False)
        excused.append(set())
    count = len(owner)
    pairs = [
        (i, j)
        for i in range(count)
        for j in range(i + 1, count)
        if owner[i] != owner[j] and not (owner[j] == WORKPIECE and names[j] in excused[i])
    ]
    label = tuple(f"{o}.{n}" for o, n in zip(owner, names, strict=True))
    above = np.flatnonzero(~np.array(fixed))
    return BodyTable(tuple(owner), label, np.array(radius), np.array(pairs, dtype=int).reshape(-1, 2), above)


def all_ends(cell: Cell, T_W_C: np.ndarray, links: dict[str, np.ndarray], tcps: dict[str, np.ndarray]) -> np.ndarray:
    """Return axis ends of every body in the order of the table, shape (M, B, 2, 3) [m], in W.

    Args:
        cell: the cell.
        T_W_C: workpiece poses, shape (M, 4, 4).
        links: T_W_L by station name, each of shape (M, n + 1, 4, 4).
        tcps: T_W_E by station name, each of shape (M, 4, 4).
    """
    robots = [ref.body_ends(station, links[station.name], tcps[station.name]) for station in cell.stations]
    return np.concatenate([*robots, ref.workpiece_ends(cell, T_W_C)], axis=1)


def floor_distances(table: BodyTable, ends: np.ndarray) -> np.ndarray:
    """Return the height of the lowest point of every body above the floor, shape (M, F) [m]."""
    return ends[..., 2].min(axis=-1)[:, table.above_floor] - table.radius_m[table.above_floor]
