"""Drives so slow that a weld would take hours."""

import numpy as np
import pytest

from nlpweld.errors import MotionError
from nlpweld.motion import Limits
from nlpweld.timing.curve import straight
from nlpweld.timing.law import slowed

PACE = Limits(np.array(0.1), np.array(1.0), np.array(10.0))


def test_a_run_that_its_drives_stretch_over_hours_is_refused_before_any_clock_is_tried() -> None:
    path, step_s = straight(np.zeros(1), np.ones(1)), 0.05
    for rate in (1e-2, 1e-6):
        limits = np.array([[rate], [1.0], [10.0]])
        if rate == 1e-2:
            assert slowed(path, PACE, limits, 0.0, 1.0, step_s).duration_s >= 1 / rate
        else:
            with pytest.raises(MotionError, match="a phase would take 1e\\+06 s, over the 5000 s"):
                slowed(path, PACE, limits, 0.0, 1.0, step_s)
