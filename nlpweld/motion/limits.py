"""What bounds a motion along one axis: its speed, acceleration and jerk."""

from dataclasses import dataclass

import numpy as np

from nlpweld.errors import MotionError

NAMES = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class Limits:
    """Greatest velocity, acceleration and jerk of an axis, in one unit of length or angle per s, s^2 and s^3.

    Numbers, or arrays that broadcast against each other and against displacements.

    Raises:
        MotionError: a limit is zero, negative, NaN or infinite.
    """

    velocity: np.ndarray
    acceleration: np.ndarray
    jerk: np.ndarray

    def __post_init__(self) -> None:
        """Make arrays of the limits and refuse what bounds nothing."""
        for name in NAMES:
            value = finite(getattr(self, name), name)
            if not (value > 0).all():
                wrong = value[~(value > 0)].flat[0]
                raise MotionError(
                    f"{name} limit {wrong:g} is not above 0; give the greatest {name} as a positive number"
                )
            object.__setattr__(self, name, value)


def finite(value: object, name: str) -> np.ndarray:
    """Return numbers as an array.

    Raises:
        MotionError: they are not numbers, or one is NaN or infinite; the message names them by ``name``.
    """
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise MotionError(f"{name}: not a number; give one in SI units or degrees") from None
    if not np.isfinite(array).all():
        raise MotionError(f"{name}: holds NaN or infinity; give finite numbers")
    return array
