"""All bodies of a cell in one table, and the pairs that must keep their distance."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from nlpweld.cell import Body, Cell
from nlpweld.verify import reference as ref

WORKPIECE = "workpiece"
FLOOR = "floor"


@dataclass(frozen=True, eq=False)
class BodyTable:
    """Capsules of every robot, of the workpiece and of the positioner, in this order.

    Attributes:
        owner: name of each body's station or positioner, or ``workpiece``.
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
        """Who a pair is charged to: the robot of its first body, else workpiece or positioner."""
        return [self.owner[i] for i in [*self.pairs[:, 0], *self.above_floor]]


def body_table(cell: Cell) -> BodyTable:
    """Return the bodies and pairs of a cell.

    Pairs are every two bodies of different owners, robots, workpiece and positioner, but for those with the workpiece
    that coupling or positioner lets touch; and the floor with everything, but for bodies fixed to a robot's or the
    positioner's base.
    """
    rows = [(st.name, b.name, b.radius_m, _fixed(b), st.coupling.may_touch) for st in cell.stations for b in st.bodies]
    rows += [(WORKPIECE, b.name, b.radius_m, False, ()) for b in cell.workpiece.bodies]
    if cell.positioner is not None:
        name, touch = cell.positioner.name, cell.positioner.may_touch
        rows += [(name, b.name, b.radius_m, _fixed(b), touch) for b in cell.positioner.robot.bodies]
    owner, names, radius, fixed, touching = zip(*rows, strict=True)
    excused = [
        {work for own, work in (pair.split("/") for pair in pairs) if own == name}
        for name, pairs in zip(names, touching, strict=True)
    ]

    def may_touch(i: int, j: int) -> bool:
        return (owner[j] == WORKPIECE and names[j] in excused[i]) or (owner[i] == WORKPIECE and names[i] in excused[j])

    pairs = [(i, j) for i, j in combinations(range(len(rows)), 2) if owner[i] != owner[j] and not may_touch(i, j)]
    label = tuple(f"{o}.{n}" for o, n in zip(owner, names, strict=True))
    above = np.flatnonzero(~np.array(fixed))
    return BodyTable(tuple(owner), label, np.array(radius), np.array(pairs, dtype=int).reshape(-1, 2), above)


def all_ends(cell: Cell, T_W_C: np.ndarray, links: dict[str, np.ndarray], tcps: dict[str, np.ndarray]) -> np.ndarray:
    """Return axis ends of every body in the order of the table, shape (M, B, 2, 3) [m], in W.

    Args:
        cell: the cell.
        T_W_C: workpiece poses, shape (M, 4, 4).
        links: T_W_L by name of station or positioner, each of shape (M, n + 1, 4, 4).
        tcps: T_W_E by station name, each of shape (M, 4, 4).
    """
    ends = [ref.body_ends(station, links[station.name], tcps[station.name]) for station in cell.stations]
    ends.append(ref.workpiece_ends(cell, T_W_C))
    if cell.positioner is not None:
        ends.append(ref.positioner_ends(cell, links[cell.positioner.name]))
    return np.concatenate(ends, axis=1)


def floor_distances(table: BodyTable, ends: np.ndarray) -> np.ndarray:
    """Return the height of the lowest point of every body above the floor, shape (M, F) [m]."""
    return ends[..., 2].min(axis=-1)[:, table.above_floor] - table.radius_m[table.above_floor]


def _fixed(body: Body) -> bool:
    """Tell whether a body is fixed to the base."""
    return body.start.frame == body.end.frame == "link0"
