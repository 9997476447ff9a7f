"""Plans to look at: coarse, closed by hand at a placement the verifier accepts, with and without a timeline."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from nlpweld.cell import load_cell
from nlpweld.plan import Plan
from nlpweld.timeline import Timeline, Track
from tests.verify.conftest import AT, march
from tests.verify.welders import PLACES
from tests.verify.welders import plan as plan_of_welders

COARSE = {"verify_step_m": 0.02}  # fewer samples to look at
APPROACH_S, WELD_S, RETREAT_S = 1.0, 4.0, 1.5


def timed(plan: Plan, approach_s: float = APPROACH_S) -> Plan:
    """Return the plan with torches that come from 0.3 rad off, weld along a spline through the points, and go back."""
    turns = np.append(plan.s, 1.0)
    begin, end = approach_s, approach_s + WELD_S
    t = np.unique(np.concatenate([[0.0], begin + WELD_S * turns, [end + RETREAT_S]]))
    s = np.clip((t - begin) / WELD_S, 0.0, 1.0)
    tracks = {}
    for name, path in plan.paths.items():
        back = path[0] + 2 * np.pi * np.round((path[-1] - path[0]) / (2 * np.pi))
        welds = np.vstack([path, back])
        off = np.array([0.3 * (name == "welder"), *np.zeros(path.shape[1] - 1)])
        curve = CubicSpline(t, np.vstack([welds[0] + off, welds, welds[-1] + off]), bc_type="clamped")
        tracks[name] = Track(curve(t), curve(t, 1), curve(t, 2))
    phases = (("approach", begin), ("weld", end), ("retreat", float(t[-1])))
    return plan.timed(Timeline(t, s, phases, tracks))


@pytest.fixture(autouse=True, scope="session")
def fewer_instants():
    """Look at fewer instants of a timed plan than a page of use would."""
    patch = pytest.MonkeyPatch()
    patch.setattr("nlpweld.view.film.INSTANTS", 240)
    yield
    patch.undo()


@pytest.fixture(scope="session")
def plan() -> Plan:
    """Two handlers and a welder at the paper's placement, 24 points."""
    return march(load_cell("three_er16").with_(seam={"points": 24}, constraints=COARSE), AT)


@pytest.fixture(scope="session")
def turned_plan() -> Plan:
    """A positioner and two welders on two seams."""
    return plan_of_welders(load_cell("dual_welder_positioner").with_(constraints=COARSE), PLACES["A"])
