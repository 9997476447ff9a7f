"""The formats there are, by name, and a plan written in one of them."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from nlpweld.errors import OptionError
from nlpweld.export.joint_csv import joint_csv
from nlpweld.export.krl import krl
from nlpweld.export.moves import Moves, moves_of
from nlpweld.export.rapid import rapid
from nlpweld.export.ros2 import ros2_json, ros2_yaml
from nlpweld.plan import Plan, refuse_existing, write_text

FORMATS: dict[str, Callable[[Moves], dict[str, str]]] = {
    "csv": joint_csv,
    "ros2": ros2_yaml,
    "ros2-json": ros2_json,
    "rapid": rapid,
    "krl": krl,
}


@dataclass(frozen=True)
class Export:
    """Text files of a plan, not yet written.

    Attributes:
        files: file name to text.
        points: how many instants they hold.
        duration_s: the cycle time [s].
        deviation_deg: how far any joint of the plan is from a straight line in joint space between two points [deg].
    """

    files: dict[str, str]
    points: int
    duration_s: float
    deviation_deg: float

    def save(self, folder: str | Path, force: bool = False) -> list[Path]:
        """Write the files into a folder and return their paths.

        Args:
            folder: made where it is missing.
            force: whether files of the same names are replaced.

        Raises:
            OutputError: one of them exists, and then none is written; or one cannot be written.
        """
        paths = [Path(folder) / name for name in self.files]
        refuse_existing(paths, force)
        return [write_text(path, text) for path, text in zip(paths, self.files.values(), strict=True)]


def export_plan(plan: Plan, format: str = "csv", every_s: float | None = None) -> Export:
    """Write a timed plan as text, joints in the direction in which each controller counts them.

    Args:
        plan: with a timeline.
        format: one of :data:`FORMATS`.
        every_s: the longest step between two points [s]; by default, points are as few as keep every joint within
            0.01 degrees of a straight line from one to the next.

    Raises:
        OptionError: no such format, a step that is not above 0 or makes too many points, or a robot that the format
            has no room for.
        PlanError: the plan is not timed.
    """
    if format not in FORMATS:
        raise OptionError(f"--format '{format}' is unknown. There are: {', '.join(FORMATS)}")
    moves = moves_of(plan, every_s)
    deviation_deg = math.degrees(moves.deviation_rad)
    return Export(FORMATS[format](moves), len(moves.t_s), float(moves.t_s[-1]), deviation_deg)
