"""Plans at few points, and what they are timed to."""

import numpy as np
import pytest

from nlpweld.bench.answer import evaluate_plan
from nlpweld.cell import Cell, load_cell
from nlpweld.formulation.reduced import reduced
from nlpweld.plan import Plan
from nlpweld.timing import time_plan

C = (0.023, -0.266, 0.404)


LOOKS = {"verify_step_m": 0.02}  # fewer looks at distances, for speed


def at(cell: Cell, place: tuple[float, float, float]) -> Plan:
    plan, _ = evaluate_plan(reduced(cell, engine="numpy"), cell.coordinates(np.array(place)))
    assert plan is not None
    return plan


@pytest.fixture(scope="session")
def tee() -> Plan:
    return at(load_cell("three_er16").with_(seam={"points": 18}, constraints=LOOKS), C)


@pytest.fixture(scope="session")
def flange() -> Plan:
    return at(load_cell("robot_positioner").with_(seam={"points": 18}, constraints=LOOKS), (0.0, -1.0, 0.5))


@pytest.fixture(scope="session")
def trough() -> Plan:
    return at(load_cell("dual_welder_positioner").with_(constraints=LOOKS), (0.0, -1.2, 0.5))


@pytest.fixture(scope="session")
def timed_tee(tee: Plan) -> Plan:
    return time_plan(tee, 0.05)


@pytest.fixture(scope="session")
def timed_flange(flange: Plan) -> Plan:
    return time_plan(flange, 0.04)


@pytest.fixture(scope="session")
def timed_trough(trough: Plan) -> Plan:
    return time_plan(trough, 0.04)
