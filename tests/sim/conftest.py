"""Small timed plans: a piece of each kind of cell."""

import numpy as np
import pytest

from nlpweld.bench.answer import coordinates, evaluate_plan, formulate
from nlpweld.cell import load_cell
from nlpweld.plan import Plan
from nlpweld.sim.options import Numerics, SimOptions
from nlpweld.sim.simulate import Simulation, simulate

from .timed import timed

QUICK = SimOptions(numerics=Numerics(hz=100.0))


def small_plan(name: str, placement: str, until: float, duration_s: float) -> Plan:
    """Return a timed plan of the first part of a cell's seam on few points."""
    cell = load_cell(name).with_(seam={"points": 18})
    at = np.array(cell.placements[placement])
    plan, _ = evaluate_plan(formulate(cell, "reduced", engine="numpy"), coordinates(cell, at))
    assert plan is not None
    return timed(plan, duration_s, 21, until)


@pytest.fixture(scope="session")
def carried() -> Plan:
    """Two carriers and a welder, 4 s at 20 mm/s and less."""
    return small_plan("three_er16", "paper", 0.1, 4.0)


@pytest.fixture(scope="session")
def turned() -> Plan:
    """A positioner and a welder."""
    return small_plan("robot_positioner", "nominal", 0.1, 4.0)


@pytest.fixture(scope="session")
def carried_run(carried: Plan) -> Simulation:
    """The first as it is."""
    pytest.importorskip("mujoco", reason="the extra 'sim' is not installed")
    return simulate(carried, QUICK, (0.0, 2.0))
