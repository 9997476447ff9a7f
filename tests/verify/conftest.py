"""A feasible plan at the paper's placement, made by marching along the seam: no solver and no closed form."""

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.geometry.seam import seam_parameters
from nlpweld.plan import Plan
from nlpweld.verify import reference as ref
from nlpweld.verify.between import close_chain
from nlpweld.verify.check import verify
from nlpweld.verify.report import Report

from .helpers import cell_with, changed
from .welders import PLACES
from .welders import plan as plan_of_welders

AT = np.array([0.023, -0.266, 0.404])
# The model's joint angles at the paper's placement and point 0, one wrist, in degrees.
START_DEG = {
    "handler_1": (137.690, 26.848, 6.920, -1.237, 79.488, -66.037),
    "handler_2": (49.560, 45.061, 24.204, -107.459, 64.536, -178.979),
    "welder": (-90.655, 14.161, 3.397, 0.318, 50.443, 179.190),
}


def march(cell: Cell, at: np.ndarray) -> Plan:
    """Close every chain at every point, each started from the point before."""
    s = seam_parameters(cell)
    paths = {}
    for station in cell.stations:
        q, rows = np.radians(START_DEG[station.name]), []
        for pose in ref.required_pose(cell, station, at, s):
            found, error = close_chain(station, pose[None], q[None])
            assert np.abs(error).max() < 1e-9
            q = found[0]
            rows.append(q)
        paths[station.name] = within_limits(np.array(rows), station.robot.limits_rad)
    return Plan(cell, at, s, paths)


def within_limits(path: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Shift every joint by the whole turns that bring the middle of its path, closing step included, nearest theirs."""
    whole = np.vstack([path, path[0] + 2 * np.pi * np.round((path[-1] - path[0]) / (2 * np.pi))])
    middle = (whole.min(axis=0) + whole.max(axis=0)) / 2
    return path - 2 * np.pi * np.round((middle - limits.mean(axis=1)) / (2 * np.pi))


@pytest.fixture(scope="session")
def cell() -> Cell:
    return load_cell("three_er16")


@pytest.fixture(scope="session")
def plan(cell: Cell) -> Plan:
    return march(cell, AT)


@pytest.fixture(scope="session")
def report(plan: Plan) -> Report:
    return verify(plan)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240607)


@pytest.fixture(scope="session")
def coarse(plan: Plan) -> Plan:
    cell = cell_with(plan.cell, seam={"points": 6})
    return changed(plan, cell=cell, s=np.arange(6) / 6, paths={name: q[::12] for name, q in plan.paths.items()})


@pytest.fixture(scope="session")
def dual() -> Cell:
    return load_cell("dual_welder_positioner")


@pytest.fixture(scope="session")
def dual_plan(dual: Cell) -> Plan:
    return plan_of_welders(dual, PLACES["A"])


@pytest.fixture(scope="session")
def dual_report(dual_plan: Plan) -> Report:
    return verify(dual_plan)


@pytest.fixture(scope="session")
def single() -> Cell:
    return load_cell("robot_positioner")


@pytest.fixture(scope="session")
def single_plan(single: Cell) -> Plan:
    return plan_of_welders(single, (0.0, -1.0))
