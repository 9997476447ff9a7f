"""What the text of all formats shares: numbers, names a controller takes, the head of a file, templates."""

import math
import re
from collections.abc import Callable, Iterator
from importlib.metadata import version
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from nlpweld.errors import OptionError
from nlpweld.export.moves import Mover, Moves

Target = Callable[[np.ndarray, np.ndarray], str]
DIGITS = 6  # after the point: more than the seven significant ones of a controller's 32-bit number can hold


def number(value: float, digits: int = DIGITS) -> str:
    """Return a number without exponent, and a zero without sign."""
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def degrees(angle_rad: float) -> str:
    """Return an angle [rad] as text in degrees."""
    return number(math.degrees(angle_rad))


def rendered(template: str, **values: Any) -> str:
    """Return a template of this package with its values filled in."""
    environment = Environment(
        loader=PackageLoader("nlpweld.export"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # no markup: programs of controllers, with names that the cell's schema has checked
    )
    environment.filters |= {"number": number, "degrees": degrees}
    return environment.get_template(template).render(**values)


def programs(moves: Moves, language: str, longest_name: int, target: Target) -> Iterator[dict[str, Any]]:
    """Yield for every robot what the template of its program takes; the positioner's axes go with the first robot.

    Args:
        moves: what is written.
        language: its name as a format.
        longest_name: how many characters the name of a program may have.
        target: joints (6,) and external axes (e,) [rad] to the text of a target.

    Raises:
        OptionError: a robot does not have six joints.
    """
    refuse_other_arms(moves, language)
    names = module_names(moves, longest_name)
    for k, (name, mover) in enumerate(zip(names, moves.robots, strict=True)):
        outer = moves.positioner.q if moves.positioner and k == 0 else np.empty((len(moves.t_s), 0))
        targets = [target(q, e) for q, e in zip(mover.q, outer, strict=True)]
        yield {"name": name, "head": head(moves, mover), "robots": len(names), "targets": targets, "moves": moves}


def module_names(moves: Moves, longest: int) -> list[str]:
    """Return for every robot a name of letters, digits and underscores, in which no two agree: ``w1_``, ``w2_``."""
    return [f"w{k}_{re.sub(r'[^A-Za-z0-9_]', '_', m.name)}"[:longest] for k, m in enumerate(moves.robots, start=1)]


def head(moves: Moves, mover: Mover) -> list[str]:
    """Return the lines that lead a program of one robot: what it is, its units, and what is assumed."""
    title = " ".join(mover.robot.title.split()).encode("ascii", "replace").decode()  # free text, within a comment
    told = [
        f"nlpweld {version('nlpweld')}, cell {moves.cell}: {mover.name} ({title})",
        f"{len(moves.t_s)} points in {number(moves.t_s[-1], 3)} s; a straight line in joint space from point to point",
        f"stays within {math.degrees(moves.deviation_rad):.2g} deg of the plan in every joint.",
        "Angles in degrees, times in seconds, as the controller counts and shows its axes: the sign of each joint in",
        "the robot's file is applied. Not known there, and to be converted first: an axis that the controller counts",
        "against its neighbour, as with parallel rods or coupled wrists, and offsets of its zero.",
    ]
    if moves.positioner is not None:
        told.append(f"The positioner's joints are external axes of {moves.robots[0].name}, the first robot.")
    return told


def refuse_other_arms(moves: Moves, language: str) -> None:
    """Refuse a robot whose joints a program has no room for.

    Raises:
        OptionError: a robot has more or fewer than six joints.
    """
    for mover in moves.robots:
        if len(mover.robot.joints) != 6:
            count = len(mover.robot.joints)
            raise OptionError(
                f"--format {language}: '{mover.name}' has {count} joints, its targets six; take csv or ros2"
            )
