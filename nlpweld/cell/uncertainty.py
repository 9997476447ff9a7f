"""By how much a cell may be set up otherwise than its file says, and the scenarios that stand for it."""

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from nlpweld.cell.checked import NonNegative, Sourced
from nlpweld.errors import OptionError

if TYPE_CHECKING:
    from nlpweld.cell.cell import Cell

DRAWN = 8  # vertices drawn at random where the bases of several robots may be off
SEED = 0  # of those
NOMINAL = "as stated"


class Uncertainty(Sourced):
    """Half-widths of the box in which the errors of a cell's set-up lie; what is not stated is exact.

    ``placement_m``, ``placement_deg``: origin of the placement frame {P}, along the axes of W, and its turn about z_W.
    ``base_m``, ``base_deg``: likewise every robot's base, each by itself, about its own origin.
    """

    placement_m: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    placement_deg: NonNegative = 0.0
    base_m: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    base_deg: NonNegative = 0.0

    @property
    def placement(self) -> np.ndarray:
        """Half-widths of {P}'s x, y, z [m] and yaw [rad], shape (4,)."""
        return np.array([*self.placement_m, np.radians(self.placement_deg)])

    @property
    def base(self) -> np.ndarray:
        """Half-widths of a base's x, y, z [m] and yaw [rad], shape (4,)."""
        return np.array([*self.base_m, np.radians(self.base_deg)])


@dataclass(frozen=True, eq=False)
class Scenario:
    """One way in which a cell may be set up.

    Attributes:
        placement: error of {P}: x, y, z [m] in W and yaw about z_W [rad], shape (4,).
        bases: likewise of every station's base, in the order of the stations, shape (stations, 4).
        label: what is off, for people.
    """

    placement: np.ndarray
    bases: np.ndarray
    label: str


def vertices(cell: "Cell") -> tuple[Scenario, ...]:
    """Return the scenarios of a worst case: the cell as stated, then vertices of the box of its errors.

    What concerns one robot and the work alone (reach, joint limits, singularity floor, clearance from the work) depends
    on where {P} is as the robot sees it, up to the heights of the floor and the heading of a torch. So the vertices are
    those where {P} is off one way along x, y and z and all bases the other way, with either sense of {P}'s yaw and of
    the bases': at most 32, which to such constraints are as bad as all. What concerns robots among themselves is looked
    at in ``DRAWN`` more vertices, drawn at random with the same seed always. Equal scenarios are told once.

    Raises:
        OptionError: the cell states no errors.
    """
    box, count = _stated(cell), len(cell.stations)
    wide = [bool(w) for w in (*(box.placement + box.base)[:3], box.placement[3], box.base[3])]
    errors = []
    for *away, turned, turned_bases in product(*((1.0, -1.0) if free else (0.0,) for free in wide)):
        placement = np.array([*away, turned]) * box.placement
        base = np.array([*(-sign for sign in away), turned_bases]) * box.base
        errors.append(np.vstack([placement, *[base] * count]))
    if box.base.any() and count > 1:
        signs = np.random.default_rng(SEED).choice([-1.0, 1.0], size=(DRAWN, 1 + count, 4))
        errors += list(signs * _half_widths(box, count))
    return _told(cell, [np.zeros((1 + count, 4)), *errors])


def as_stated(cell: "Cell") -> Scenario:
    """Return the scenario in which nothing is off."""
    return _told(cell, [np.zeros((1 + len(cell.stations), 4))])[0]


def samples(cell: "Cell", count: int, seed: int) -> tuple[Scenario, ...]:
    """Return scenarios drawn evenly from the whole box of errors.

    Raises:
        OptionError: the cell states no errors.
    """
    box, stations = _stated(cell), len(cell.stations)
    share = np.random.default_rng(seed).uniform(-1.0, 1.0, size=(count, 1 + stations, 4))
    return _told(cell, list(share * _half_widths(box, stations)))


def _stated(cell: "Cell") -> Uncertainty:
    if cell.uncertainty is None:
        raise OptionError(
            f"{cell.name}: no [uncertainty] table says by how much placement and bases may be off; add one to the cell"
        )
    return cell.uncertainty


def _half_widths(box: Uncertainty, stations: int) -> np.ndarray:
    """Return the half-widths of {P}'s error, then of every base's, shape (1 + stations, 4)."""
    return np.vstack([box.placement, *[box.base] * stations])


def _told(cell: "Cell", errors: list[np.ndarray]) -> tuple[Scenario, ...]:
    """Return scenarios of errors (1 + stations, 4), each once."""
    once = {(e + 0.0).tobytes(): e for e in errors}  # adding zero leaves no negative zeros
    return tuple(Scenario(e[0], e[1:], _label(cell, e)) for e in once.values())


def _label(cell: "Cell", errors: np.ndarray) -> str:
    placement, bases = errors[0], errors[1:]
    owners = [("placement", placement)]
    if len(bases) > 1 and (bases == bases[0]).all():
        owners.append(("every base", bases[0]))
    else:
        owners += [(f"base of {s.name}", base) for s, base in zip(cell.stations, bases, strict=True)]
    return "; ".join(f"{name} {_said(error)}" for name, error in owners if error.any()) or NOMINAL


def _said(error: np.ndarray) -> str:
    """Return an error in words, e.g. ``+1 mm in y`` or ``(+1, -1, +0) mm, -0.5 deg``."""
    shift = 1e3 * error[:3] + 0.0
    parts = []
    if np.count_nonzero(shift) == 1:
        parts = [f"{e:+.3g} mm in {axis}" for axis, e in zip("xyz", shift, strict=True) if e]
    elif shift.any():
        parts = [f"({', '.join(f'{e:+.3g}' for e in shift)}) mm"]
    return ", ".join([*parts, f"{np.degrees(error[3]):+.3g} deg"] if error[3] else parts)
