"""Errors of a cell's set-up as data of its seam points: one compiled graph serves every scenario."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlpweld.cell.uncertainty import Scenario
from nlpweld.kinematics.chain import Frame


@dataclass(frozen=True)
class SetUp:
    """Symbols of errors: shifts along the axes of W and turns about z_W, as frames.

    Attributes:
        placement: of the placement frame {P}.
        bases: of every station's base.
    """

    placement: Frame
    bases: tuple[Frame, ...]


def set_up(stations: int) -> tuple[SetUp, list[ca.SX]]:
    """Return fresh symbols of the errors of {P} and of so many bases, and the same in the order of their data."""
    symbols = [ca.SX.sym(f"error_{i}", 5) for i in range(1 + stations)]
    placement, *bases = (Frame(_turn(symbol[3], symbol[4]), symbol[:3]) for symbol in symbols)
    return SetUp(placement, tuple(bases)), symbols


def moved(T_W_A: Frame, error: Frame) -> Frame:
    """Return a frame shifted in W and turned about the vertical through its own origin."""
    return Frame(error.R @ T_W_A.R, T_W_A.p + error.p)


def with_errors(points: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Return the data of seam points (k, N) with a scenario's errors below, the numbers behind :func:`set_up`.

    They are shift [m], cosine and sine of {P} and of every base, the same at all points.
    """
    errors = np.vstack([scenario.placement, scenario.bases])
    rows = np.column_stack([errors[:, :3], np.cos(errors[:, 3]), np.sin(errors[:, 3])]).reshape(-1, 1)
    return np.vstack([points, np.tile(rows, points.shape[1])])


def _turn(c: ca.SX, s: ca.SX) -> ca.SX:
    rows = [ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1)]
    return ca.sparsify(ca.vertcat(*rows))
