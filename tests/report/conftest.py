import json
from functools import partial

import numpy as np
import pandas as pd
import pytest

from nlpweld.cell import load_cell
from nlpweld.plan import Plan
from tests.records.made import ROBOTS, report, store

PAPER = (0.023, -0.266, 0.404)


def store_baseline(folder, cell="three_er16", at=PAPER, mmr=0.2841, feasible=True):
    data = {"name": "Pan et al. C", "cell": cell, "placement": list(at), "report": report(mmr, feasible)}
    (folder / "baselines").mkdir(parents=True, exist_ok=True)
    (folder / "baselines" / f"paper-{cell}.json").write_text(json.dumps(data))


@pytest.fixture
def folder(tmp_path):
    """A study's folder, not there yet."""
    return tmp_path / "study"


@pytest.fixture
def asked():
    """Return a report of a run that maximises something else than the mean MMR."""
    return lambda mmr, **objective: {**report(mmr), **objective}


@pytest.fixture
def add(folder):
    """Store a record in the folder and return its path."""
    return partial(store, folder)


@pytest.fixture
def add_baseline(folder):
    """Store a baseline in the folder."""
    return partial(store_baseline, folder)


@pytest.fixture(scope="module")
def whole_study(tmp_path_factory):
    """A folder with invented data for every figure."""
    folder = tmp_path_factory.mktemp("whole") / "study"
    for solver in ("ga", "ipopt"):
        for seed in range(3):
            store(folder, solver=solver, seed=seed, verified=seed < 2, mmr=0.29 + 0.001 * seed)
    store_baseline(folder)
    cell, rng = load_cell("three_er16"), np.random.default_rng(0)
    s = np.arange(cell.seam.points) / cell.seam.points
    wave = np.cos(2 * np.pi * s)
    paths = {name: np.outer(wave, np.linspace(0.5, 2.2, 6)) for name in ROBOTS}
    data = folder / "data"
    data.mkdir()
    for i, name in enumerate(("optimum", "paper", "near_singular", "unsteady")):
        Plan(cell, np.array(PAPER) + 0.05 * i, s, paths).save(folder / "plans" / f"{name}.json")
        columns = {f"w_{robot}_m3": 0.4 + 0.1 * wave for robot in ROBOTS}
        numbers = {"s": s, "mmr": 0.3 + 0.05 * wave, "m_tight": 0.2 + 0.1 * wave, "m_loose": 0.4 + 0.1 * wave}
        pd.DataFrame({**numbers, "clearance_m": 0.02, **columns}).to_csv(data / f"profile_{name}.csv", index=False)
    tables = _seam(s) | _ellipsoids() | _maps() | _paths(rng)
    poor = {
        "name": ["near_singular", "unsteady"],
        "breaks": ["clearance, singularity", "singularity, continuity, closure"],
    }
    for name, table in (tables | {"poor_placements": poor}).items():
        pd.DataFrame(table).to_csv(data / f"{name}.csv", index=False)
    return folder


def _seam(s):
    angle = 2 * np.pi * np.append(s, 1.0)
    p = {"x": 0.05 * np.cos(angle), "y": 0.05 * np.sin(angle), "z": np.sqrt(0.01 - 0.0025 * np.sin(angle) ** 2)}
    frames = {f"{axis}_{frame}_m": values for frame in ("C", "flat", "B") for axis, values in p.items()}
    return {"seam": {"s": np.append(s, 1.0), **frames}}


def _ellipsoids():
    places = {"x_m": [0.4, -0.4, 0.0], "y_m": [0.0, 0.0, 0.4], "z_m": [0.4, 0.4, 0.6]}
    spread = {f"core_{i}{j}": [1.0 + k if i == j else 0.1 for k in range(3)] for i in (1, 2, 3) for j in (1, 2, 3)}
    ellipsoids = {"robot": list(ROBOTS), "s": 0.0, **places, **spread, "ratio": [0.4, 0.5, 0.25]}
    names = np.repeat([*ROBOTS, "main_pipe"], 4)
    arms = {"robot": names, "link": np.tile(range(4), 4)}
    return {"ellipsoids": ellipsoids, "arms": arms | {a: np.linspace(0.1 * i, 1, 16) for i, a in enumerate(places)}}


def _maps():
    maps = {}
    box = {"x_m": (-0.6, 0.6), "y_m": (-1.0, 0.6), "z_m": (0.1, 1.2)}
    kinds = np.array(["reach", "joint_limit", "singularity", "clearance", "feasible"])
    for held in box:
        one, two = (np.linspace(*box[name], 10) for name in box if name != held)
        a, b = (m.ravel() for m in np.meshgrid(one, two))
        names = [name for name in box if name != held]
        failing = kinds[np.arange(100) // 20]
        table = {names[0]: a, names[1]: b, held: 0.1, "mmr": np.linspace(0.1, 0.3, 100), "first_failing": failing}
        maps |= {f"map_{kind}{held[0]}": table for kind in ("", "near_")}
    return maps


def _paths(rng):
    swarm = dict(zip(("x_m", "y_m", "z_m"), rng.normal(PAPER, 0.1, (60, 3)).T, strict=True))
    path = dict(zip(("x_m", "y_m", "z_m"), np.linspace((0.3, 0.3, 0.9), PAPER, 9).T, strict=True))
    ga = {"generation": np.repeat(range(6), 10), **swarm, "mmr": 0.2, "feasible": True, "seed": 1}
    return {"ga_individuals": ga, "ipopt_path": {**path, "seed": 0, "iteration": range(9)}}
