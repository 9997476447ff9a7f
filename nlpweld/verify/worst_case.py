"""What the checker found over all the ways in which a cell may be set up: the worst of each number, and where."""

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

WIDTH = 79


@dataclass(frozen=True)
class Worst:
    """The least value over the scenarios, and the scenario that has it."""

    value: float
    scenario: str

    @staticmethod
    def of(values: Sequence[float], labels: Sequence[str]) -> "Worst":
        """Return the least of values, NaN before all, with its label."""
        k = int(np.argmin(np.where(np.isnan(values), -np.inf, values)))
        return Worst(float(values[k]), labels[k])


@dataclass(frozen=True)
class WorstCase:
    """A plan under errors of the cell's set-up; every scenario has joint paths of its own.

    Attributes:
        scenarios: how many were looked at: the cell as stated, vertices of the box of errors, and random samples.
        vertices: how many of them are the cell as stated and vertices, those a robust form looks at.
        samples: how many were drawn at random from the whole box.
        feasible: in how many of them every level holds.
        mmr_mean: least mean objective.
        singularity: least manipulability of any robot along the seam [m^3].
        clearance_m: least distance of any pair along the seam.
        joint_margin_rad: least distance of any joint from a limit.
    """

    scenarios: int
    vertices: int
    samples: int
    feasible: int
    mmr_mean: Worst
    singularity: Worst
    clearance_m: Worst
    joint_margin_rad: Worst

    def lines(self) -> list[str]:
        """Return what a report says of it, at most 80 columns wide."""
        looked = f"{self.scenarios} scenarios ({self.vertices} stated or vertices, {self.samples} random)"
        rows: list[tuple[str, Worst, Callable[[float], str]]] = [
            ("objective", self.mmr_mean, lambda v: f"{v:.6g}"),
            ("least w", self.singularity, lambda v: f"{v:.6f} m^3"),
            ("clearance", self.clearance_m, lambda v: f"{1e3 * v:.3f} mm"),
            ("joint margin", self.joint_margin_rad, lambda v: f"{math.degrees(v):.3f} deg"),
        ]
        texts = [f"  set-up errors     feasible in {self.feasible} of {looked}; the worst:"]
        texts += [f"    {name:<15} {told(worst.value)}, {worst.scenario}" for name, worst, told in rows]
        return [line for text in texts for line in textwrap.wrap(text, WIDTH, subsequent_indent=" " * 20)]
