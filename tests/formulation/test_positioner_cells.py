"""Cells with a positioner (Zhang et al.): held upright first, loops closed on it, and evaluated like any other cell.

The numbers are those of a prototype written apart, in plain NumPy; it printed six digits.
"""

import numpy as np
import pytest

from nlpweld.cell import Cell, load_cell
from nlpweld.errors import KinematicsError, OptionError
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.coupling import torch_target
from nlpweld.formulation.holder import held
from nlpweld.formulation.smooth import relaxation
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.geometry.weld_angles import iso_position, weld_angles, weld_rotations

MEANS = {"A": 0.226960, "B": 0.212600, "C": 0.243867, "D": 0.290770}
LEAST = {"A": (0.516773, 0.290926), "B": (0.360662, 0.360662), "C": (0.308062, 0.579656), "D": (0.415394, 0.552803)}
CELLS = ("dual_welder_positioner", "robot_positioner")
ENGINES = ("numpy", "numba")


@pytest.fixture(scope="module")
def dual() -> Cell:
    return load_cell("dual_welder_positioner")


@pytest.fixture(scope="module")
def single() -> Cell:
    return load_cell("robot_positioner")


def named(cell: Cell) -> np.ndarray:
    return np.array([cell.coordinates(np.array(at)) for at in cell.placements.values()])


@pytest.mark.parametrize("engine", ENGINES)
def test_published_positions_are_feasible_with_the_prototypes_means(dual: Cell, engine: str) -> None:
    if engine == "numba":
        pytest.importorskip("numba")
    found = Batch(dual, engine).evaluate(named(dual))
    assert found.feasible.all()
    assert found.objective == pytest.approx(list(MEANS.values()), abs=6e-7)


def test_nominal_place_of_the_single_robot_has_the_prototypes_mean(single: Cell) -> None:
    found = Batch(single).evaluate(named(single))
    assert found.feasible.all()
    assert found.objective == pytest.approx([0.489716], abs=6e-7)


@pytest.mark.parametrize("at", MEANS)
def test_least_manipulability_of_either_robot_is_the_prototypes(dual: Cell, at: str) -> None:
    batch, x = Batch(dual), dual.coordinates(np.array(dual.placements[at]))
    n = batch.points.shape[1]
    w = [np.array(g.map(n)(np.tile(x[:, None], n), batch.points, np.ones((3, n)))[1]) for g in batch.stage.grips]
    assert [k.min() for k in w] == pytest.approx(LEAST[at], abs=6e-7)


def test_the_better_of_mirrored_places_is_neither(dual: Cell) -> None:
    X = np.random.default_rng(3).uniform(*dual.box, (60, 2))
    batch = Batch(dual)
    here, there = batch.evaluate(X), batch.evaluate(X * [-1, 1])
    seen = np.isfinite(here.objective)
    assert seen.sum() > 20
    assert here.objective[seen] == pytest.approx(there.objective[seen], rel=1e-9)


@pytest.mark.parametrize("name", CELLS)
def test_engines_agree_where_a_positioner_holds_the_work(name: str) -> None:
    pytest.importorskip("numba")
    cell = load_cell(name)
    X = np.random.default_rng(4).uniform(*cell.box, (80, 2))
    ours, theirs = (Batch(cell, engine).evaluate(X) for engine in ENGINES)
    assert ours.violation == pytest.approx(theirs.violation, abs=1e-12)
    assert ours.objective == pytest.approx(theirs.objective, rel=1e-12)
    assert 10 < ours.feasible.sum() < 70


@pytest.mark.parametrize("name", CELLS)
def test_derivatives_by_jets_are_casadis_in_two_variables(name: str) -> None:
    pytest.importorskip("numba")
    stage = Batch(load_cell(name)).stage
    mode = (("front", "up"),) * len(stage.cell.stations)
    ours, theirs = (relaxation(stage, mode, engine=engine) for engine in ("numba", "numpy"))
    at = np.array([0.1, -1.2])
    for part in ("value", "gradient", "hessian"):
        a, b = (np.array(getattr(way, part)(at, 50.0)).ravel() for way in (ours, theirs))
        assert a == pytest.approx(b, rel=1e-9, abs=1e-9)
    assert np.array(ours.hessian(at, 50.0)).shape == (2, 2)


def test_main_seam_lies_as_a_horizontal_fillet_and_so_does_the_second(dual: Cell) -> None:
    s = seam_parameters(dual)
    R_P_C = held(dual, s).T_P_C[:, :3, :3]
    for seam, rotation in (("main", 135.0), ("second", 45.0)):
        slope, turned, _ = weld_angles(R_P_C @ weld_rotations(weld_frames(dual, s, seam)))
        assert np.degrees(slope) == pytest.approx(np.zeros(72), abs=1e-10)
        assert np.degrees(turned) == pytest.approx(np.full(72, rotation), abs=1e-10)
        assert set(iso_position(slope, turned).name) == {"PB"}


def test_single_seam_lies_flat(single: Cell) -> None:
    s = seam_parameters(single)
    slope, turned, _ = weld_angles(held(single, s).T_P_C[:, :3, :3] @ weld_rotations(weld_frames(single, s)))
    assert set(iso_position(slope, turned).name) == {"PA"}
    assert np.abs(slope).max() < 1e-12


def test_table_turns_on_the_arc_alone_and_the_tilt_stays(dual: Cell) -> None:
    s = np.linspace(0, 1, 1001)
    q = np.degrees(held(dual, s).q)
    line = (s < 0.28) | (s > 0.7201)
    assert q[:, 0] == pytest.approx(np.full(1001, -90.0), abs=1e-9)
    assert np.abs(np.diff(q[:, 1])[line[:-1] & line[1:]]).max() < 1e-9
    assert q[[0, -1], 1] == pytest.approx([90.0, -90.0], abs=1e-9)


def test_golden_pose_of_work_and_torches_at_a_is_the_prototypes(dual: Cell) -> None:
    s = seam_parameters(dual)
    T_W_C = held(dual, s).T_P_C[0].copy()
    T_W_C[:3, 3] += dual.placements["A"]
    assert T_W_C[:3] == pytest.approx(np.array([[0, 0, 1, 0.3], [1, 0, 0, -1.45], [0, 1, 0, 0.5]]), abs=1e-12)
    expected = {"main": (0.797887, -1.150261, 0.652113), "second": (-0.197887, -1.150261, 0.652113)}
    for station in dual.stations:
        T_W_E = T_W_C @ torch_target(dual, station.coupling.seam, station.coupling.angles, s)[0]
        assert T_W_E[:3, 3] == pytest.approx(expected[station.coupling.seam], abs=6e-7)
        assert T_W_E[2, 2] == pytest.approx(-0.704416, abs=6e-7)


def test_a_turned_placement_is_a_turned_base(single: Cell) -> None:
    free = single.with_(search={"yaw_deg": (-90.0, 90.0)})
    assert free.variables == ("x_m", "y_m", "yaw_rad")
    turned = single.with_(positioner={"base_rpy_deg": (-90.0, 0.0, 20.0)})
    ours, theirs = Batch(free).evaluate([0.1, -1.1, np.radians(20.0)]), Batch(turned).evaluate([0.1, -1.1])
    assert ours.objective == pytest.approx(theirs.objective, rel=1e-12)
    assert ours.violation == pytest.approx(theirs.violation, abs=1e-12)
    assert Batch(single).evaluate([0.1, -1.1]).objective != pytest.approx(theirs.objective, rel=1e-3)


def test_a_held_coordinate_cannot_be_asked_for_elsewhere(dual: Cell) -> None:
    with pytest.raises(OptionError, match=r"z_m is held at 0\.5 and cannot be 0\.6"):
        dual.coordinates(np.array([0.0, -1.2, 0.6]))


def test_a_positioner_that_cannot_turn_the_seam_upright_names_point_and_angle(dual: Cell) -> None:
    lying = dual.with_(positioner={"mount_rpy_deg": (0.0, 90.0, 0.0)})
    with pytest.raises(KinematicsError, match=r"point \d+.*deg"):
        held(lying, seam_parameters(lying))
