"""The graphs a bound looks at are the stage's numbers, and no feasible placement misses a level."""

import numpy as np
import pytest

from nlpweld.bench.answer import with_branches
from nlpweld.cell import Cell, load_cell
from nlpweld.engine.affine import AffineForms
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.nlp import sobol
from nlpweld.geometry.seam import seam_parameters
from nlpweld.kinematics.manipulability import magnitude
from nlpweld.reference.bound import CellBound
from nlpweld.reference.graphs import BoundGraphs

DUAL = "dual_welder_positioner"
CELLS = ("three_er16", DUAL, "robot_positioner")


def coarse(name: str, branches: str | None = None, points: int = 18) -> Cell:
    cell = load_cell(name)
    count = {"seam": {"points": points}} if not cell.other_seams else {}
    return with_branches(cell.with_(**count), branches)


def lopsided() -> Cell:
    """Return a cell whose joint 5 may be inside its limits on one wrist alone."""
    data = coarse("robot_positioner").model_dump(mode="python", exclude_unset=True)
    del data["timing"]  # the robot could not wait at its home
    joints = data["stations"][0]["robot"]["joints"]
    data["stations"][0]["robot"]["joints"] = [
        *joints[:4],
        {**joints[4], "lower_deg": -90.0, "upper_deg": 40.0},
        *joints[5:],
    ]
    return Cell.model_validate(data)


def at(forms: AffineForms, X: np.ndarray, given: np.ndarray) -> np.ndarray:
    """Return what forms of boxes without width enclose, (outputs, m, N)."""
    return forms(X, X, given).middle


@pytest.mark.parametrize(("name", "branches"), [("three_er16", None), (DUAL, None), ("robot_positioner", "any")])
def test_objective_and_levels_are_those_of_the_exact_model(name: str, branches: str | None) -> None:
    cell = coarse(name, branches)
    batch = Batch(cell, "numpy")
    X = sobol(*cell.box, 3, 1024)
    found = batch.evaluate(X)
    X, objective, mode = (each[found.feasible][:20] for each in (X, found.objective, found.mode))
    assert len(X) >= 5
    graphs, points, given = BoundGraphs(cell), point_data(cell, seam_parameters(cell)), CellBound(cell).modes[mode]
    ours = at(AffineForms(graphs.objective, points), X, given)[0].mean(axis=1)
    np.testing.assert_allclose(ours, objective, rtol=1e-12)
    assert at(AffineForms(graphs.levels, points), X, given).min() > 0.0


@pytest.mark.parametrize("name", [*CELLS, "lopsided"])
def test_levels_are_the_stage_s_reach_floor_and_joint_limits(name: str, rng: np.random.Generator) -> None:
    cell = lopsided() if name == "lopsided" else coarse(name)
    stage, graphs, points = Batch(cell).stage, BoundGraphs(cell), point_data(cell, seam_parameters(cell))
    lower, upper = cell.box
    X = lower + rng.random((30, len(lower))) * (upper - lower)
    given = np.ones((len(X), 3 * len(cell.stations)))
    levels = at(AffineForms(graphs.levels, points), X, given)
    row, compared = 0, 0
    for k, station in enumerate(cell.stations):
        limited = [i for i, (low, high) in enumerate(station.robot.limits_rad) if high - low < 2 * np.pi]
        grip = stage.grips[k].map(points.shape[1])
        rows = 2 + len([i for i in limited if i in (0, 1, 2, 4)])
        for i, x in enumerate(X):
            cos_sin, w, reach = (
                np.array(out) for out in grip(np.tile(x[:, None], points.shape[1]), points, np.ones((3, 1)))
            )
            cos_sin, near = cos_sin.reshape(6, -1, 2), reach.ravel() > 0.0
            assert levels[row, i] == pytest.approx(reach.ravel(), abs=1e-12)
            floor = cell.constraints.singularity_floor_m3
            assert levels[row + 1, i][near] == pytest.approx(w.ravel()[near] / floor - 1, abs=1e-9)
            kept = [j for j in limited if j in (0, 1, 2, 4)]
            for n, j in enumerate(kept):
                low, high = station.robot.limits_rad[j]
                q = np.arctan2(cos_sin[j, :, 1], cos_sin[j, :, 0]) - station.robot.dh[j, 3]
                off = np.abs((q - (low + high) / 2 + np.pi) % (2 * np.pi) - np.pi)
                other = np.abs((-q - 2 * station.robot.dh[4, 3] - (low + high) / 2 + np.pi) % (2 * np.pi) - np.pi)
                best = np.minimum(off, other) if j == 4 else off
                inside = np.cos(best) - np.cos((high - low) / 2)
                assert levels[row + 2 + n, i][near] == pytest.approx(inside[near], abs=1e-9)
            compared += near.sum()
        row += rows
    assert row == len(levels)
    assert compared > 200


@pytest.mark.parametrize("name", ["three_er16", "robot_positioner"])
def test_heights_are_the_stage_s_above_the_clearance(name: str, rng: np.random.Generator) -> None:
    cell = coarse(name, points=6)
    stage, points = Batch(cell).stage, point_data(cell, seam_parameters(cell))
    lower, upper = cell.box
    X = lower + rng.random((20, len(lower))) * (upper - lower)
    ours = AffineForms(BoundGraphs(cell).heights, points)(X, X, np.ones((20, 3 * len(cell.stations))))
    for i, x in enumerate(X):
        for j, point in enumerate(points.T):
            arms = [arm(x, point, np.ones(3)) for arm in stage.arms]
            theirs = [np.array(stage.heights[k](arm[4])).ravel() for k, arm in enumerate(arms)]
            exact = np.concatenate(theirs) - cell.constraints.clearance_m
            assert (ours.lower[:, i, j] <= exact).all()
            assert (exact <= ours.upper[:, i, j]).all()
            assert np.median(ours.radius[:, i, j]) < 1e-5  # a root at the edge of reach is known less well


@pytest.mark.parametrize("reading", ["equal", "harmonic", "sqrt_tight", "millimetres", "product", "mean"])
def test_every_reading_can_be_enclosed(reading: str) -> None:
    cell = coarse("three_er16", points=6).with_(objective={"reading": reading})
    X = np.array([[0.0, -0.17, 0.41], [0.05, -0.27, 0.42]])
    ours = at(AffineForms(BoundGraphs(cell).objective, point_data(cell, seam_parameters(cell))), X, np.ones((2, 9)))
    theirs = Batch(cell, "numpy").evaluate(X).objective / magnitude(reading, cell.tight)
    np.testing.assert_allclose(ours[0].mean(axis=1), theirs, rtol=1e-12)


def test_a_single_wrist_is_held_to_its_own_limits() -> None:
    cell = coarse("three_er16")
    loose = BoundGraphs(cell).levels.nnz_out(0)
    assert BoundGraphs(cell.with_(configuration={"wrist": "flip"})).levels.nnz_out(0) == loose
