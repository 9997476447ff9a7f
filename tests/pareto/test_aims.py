"""Aims measured on candidates against the verifier's own numbers, and joint travel with derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from nlpweld.bench.answer import evaluate_plan
from nlpweld.cell import Cell, load_cell
from nlpweld.errors import OptionError
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.nlp import sobol
from nlpweld.formulation.paths import turns
from nlpweld.formulation.reduced import reduced
from nlpweld.pareto.aims import AIMS, Meter, speeds_rad_s, verified_value
from nlpweld.pareto.limited import at_least, less

LESS = ("travel_rad", "quickest_s")  # of which less is better, and for which a cell has no level


def coarse(name: str) -> Cell:
    cell, fewer = load_cell(name), {"points": 12}
    others = {name: {**seam.model_dump(exclude_unset=True), **fewer} for name, seam in cell.other_seams.items()}
    return cell.with_(seam=fewer, other_seams=others)


def some_feasible(batch: Batch, count: int = 2) -> tuple[np.ndarray, np.ndarray]:
    X = sobol(*batch.cell.box, 5, 1024)
    found = batch.evaluate(X)
    return X[found.feasible][:count], found.mode[found.feasible][:count]


@pytest.mark.parametrize("name", ["three_er16", "dual_welder_positioner"])  # a closed seam and an open one
def test_candidates_measure_what_the_verifier_finds_at_the_points(name: str) -> None:
    batch = Batch(coarse(name), "numpy")
    X, mode = some_feasible(batch)
    measured = {aim.name: Meter(batch, aim)(X, mode) for aim in AIMS.values()}
    assert len(X) == 2
    for i, x in enumerate(X):
        plan, report = evaluate_plan(reduced(batch.cell, "numpy"), x, int(mode[i]))
        assert measured["clearance_m"][i] == pytest.approx(report.clearance_m, abs=1e-6)
        assert measured["manipulability_m3"][i] == pytest.approx(min(report.manipulability_min.values()), abs=1e-9)
        for name in LESS:
            assert measured[name][i] == pytest.approx(verified_value(AIMS[name], plan, report), abs=1e-9)
        assert verified_value(AIMS["clearance_m"], plan, report) <= report.clearance_m
        assert verified_value(AIMS["manipulability_m3"], plan, report) <= min(report.manipulability_min.values())


def test_candidates_are_measured_on_their_own_modes() -> None:
    batch = Batch(coarse("robot_positioner").with_(configuration={"shoulder": "any", "elbow": "any"}), "numpy")
    X = np.array([[0.0, -1.0]] * 2)
    meter = Meter(batch, AIMS["travel_rad"])
    both = meter(X, np.array([0, 1]))
    assert both[0] != both[1]
    assert (meter(X, np.array([1, 0])) == both[::-1]).all()


def test_quickest_pass_is_what_the_slowest_joint_takes() -> None:
    """The table where it turns, along the arc, and a robot's joint along the lines."""
    cell = coarse("dual_welder_positioner")
    plan, report = evaluate_plan(reduced(cell, "numpy"), np.array([0.0, -1.4]))
    drives = [*((st.name, st.robot.drives) for st in cell.stations), ("positioner", cell.positioner.robot.drives)]
    taken = [np.abs(np.diff(plan.paths[name], axis=0)) / np.radians(drive.speed_deg_s) for name, drive in drives]
    slowest = np.argmax([one.max(axis=1) for one in taken], axis=0)
    assert set(slowest) >= {1, 2}
    expected = np.max([one.max(axis=1) for one in taken], axis=0).sum()
    assert verified_value(AIMS["quickest_s"], plan, report) == pytest.approx(expected, rel=1e-12)


def test_robot_without_speeds_is_named() -> None:
    robot = load_cell("three_er16").stations[0].robot.model_copy(update={"drives": None})
    with pytest.raises(OptionError, match=r"robot 'er16_1600' states no speeds; add drives\.speed_deg_s"):
        speeds_rad_s(robot)


def test_turns_are_within_half_a_turn_and_go_back_along_a_closed_seam() -> None:
    phase = np.exp(1j * np.array([3.0, -3.0, -2.5]))
    assert turns(phase, True) == pytest.approx([2 * np.pi - 6.0, 0.5, 5.5 - 2 * np.pi])
    assert turns(phase, False) == pytest.approx([2 * np.pi - 6.0, 0.5])


@pytest.mark.parametrize(
    ("name", "aim"),
    [
        ("robot_positioner", "travel_rad"),
        ("dual_welder_positioner", "travel_rad"),
        ("dual_welder_positioner", "quickest_s"),
    ],
)
def test_smooth_travel_and_time_tend_to_the_exact_ones_from_above(name: str, aim: str) -> None:
    batch = Batch(coarse(name), "numpy")
    X, mode = some_feasible(batch, 1)
    side = less(batch, AIMS[aim])
    smooth, exact = side.smooth(int(mode[0])), -side.exact(X, mode)[0]
    over = [float(smooth.value(X[0], sharpness)) - exact for sharpness in (30.0, 900.0, 27000.0)]
    assert over[0] > over[1] > over[2] > -1e-9
    assert over[2] < 1e-3 * exact


@pytest.mark.parametrize("aim", LESS)
@pytest.mark.parametrize("over", [0.02, -0.02])  # missed and kept, both near the level, where the penalty bends
def test_derivatives_of_a_limited_problem_are_those_of_its_value(over: float, aim: str) -> None:
    batch = Batch(coarse("robot_positioner"), "numpy")
    side, x, step, sharpness = less(batch, AIMS[aim]), np.array([0.1, -1.0]), 1e-5, 30.0
    level = over - float(side.smooth(0).value(x, sharpness))
    relax = at_least(reduced(batch.cell, "numpy"), side, level, 0.2).relax(0, True)
    shifts = step * np.eye(2)
    slope = [float(relax.value(x + d, sharpness) - relax.value(x - d, sharpness)) / (2 * step) for d in shifts]
    assert np.array(relax.gradient(x, sharpness)).ravel() == pytest.approx(slope, rel=1e-4, abs=1e-6)
    bend = [np.array(relax.gradient(x + d, sharpness) - relax.gradient(x - d, sharpness)).ravel() for d in shifts]
    assert np.array(relax.hessian(x, sharpness)) == pytest.approx(np.array(bend) / (2 * step), rel=1e-4, abs=1e-4)


def test_limited_problem_tells_by_how_much_its_level_is_missed() -> None:
    batch = Batch(coarse("robot_positioner"), "numpy")
    nlp, side = reduced(batch.cell, "numpy"), less(batch, AIMS["travel_rad"])
    x = np.array([[0.1, -1.0], [1.2, -1.6]])
    travel = -side.exact(x[:1], np.array([0]))[0]
    found = at_least(nlp, side, 0.5 - travel, 0.25).evaluate(x)
    assert found.violation[0] == pytest.approx([0.0, 0.0, 0.0, 0.0, 2.0])
    assert found.violation[1, 4] == 0.0  # what is infeasible anyway is not measured
    assert at_least(nlp, side, -0.5 - travel, 0.25).evaluate(x[:1]).feasible.all()
    grown = at_least(nlp, side, 0.5 - travel, 0.25).widened({"singularity": 0.1, "clearance": 0.0, "joint_limit": 0.0})
    assert grown.constraints[-1] == "travel_rad"


def test_quickest_pass_of_a_tilted_weld_counts_the_positioners_own_way() -> None:
    cell = coarse("dual_welder_positioner")
    plan, report = evaluate_plan(reduced(cell, "numpy"), np.array([0.0, -1.4]))
    still = verified_value(AIMS["quickest_s"], plan, report)
    q = plan.paths["positioner"].copy()
    q[6] += np.array([0.0, 3.0])  # there and back: six radians more of its second axis
    other = replace(plan, paths={**plan.paths, "positioner": q})
    flat = {name: np.zeros(len(plan.s)) for name in ("slope", "rotation")}
    assert verified_value(AIMS["quickest_s"], other, report) == still  # not tilted: the table goes the cell's way
    assert verified_value(AIMS["quickest_s"], other.with_freedom(flat), report) > still + 1.0
