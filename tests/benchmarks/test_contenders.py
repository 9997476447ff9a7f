"""All contenders give nlpweld's verdicts, so that their times can be compared at all."""

import numpy as np
import pytest

from benchmarks.candidates import SETS, candidates, copies
from benchmarks.contenders import NEEDS, WHAT, contender, missing
from benchmarks.naive import Naive
from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.verify.bodies import body_table

COUNT = {"random": 30, "near": 5, "full": 2}


@pytest.fixture(scope="module")
def truth(cell: Cell) -> dict[str, tuple]:
    batch = Batch(cell, engine="numpy")
    sets = {kind: candidates(cell, kind, COUNT[kind], seed=7) for kind in SETS}
    return {kind: (X, batch.evaluate(X)) for kind, X in sets.items()}


@pytest.mark.parametrize("kind", SETS)
@pytest.mark.parametrize("name", WHAT)
def test_contender_agrees_with_the_population_evaluator(cell: Cell, truth: dict, name: str, kind: str) -> None:
    for package in NEEDS.get(name, ()):
        pytest.importorskip(package)
    X, expected = truth[kind]
    mmr, feasible = contender(name, cell)(X)
    assert feasible.tolist() == expected.feasible.tolist()
    both = np.isfinite(mmr) & np.isfinite(expected.objective)
    assert both[expected.feasible].all()
    assert mmr[both] == pytest.approx(expected.objective[both], abs=1e-6)


def test_sets_hold_feasible_and_infeasible_candidates(truth: dict) -> None:
    shares = {kind: found.feasible.mean() for kind, (_, found) in truth.items()}
    assert shares["full"] == 1.0
    assert 0.0 < shares["near"] <= 1.0
    assert shares["random"] < 0.2
    assert all(len(X) == COUNT[kind] for kind, (X, _) in truth.items())


def test_naive_clearance_is_the_models_at_the_papers_placement(cell: Cell) -> None:
    said = Naive(cell).verdict(np.array(cell.placements["paper"]))
    assert said.clearance_m == pytest.approx(0.0244, abs=5e-5)
    assert said.mmr == pytest.approx(0.284151, abs=1e-6)
    assert said.feasible


@pytest.mark.parametrize("name", ["naive", "naive_early", "peers", "casadi_vm"])
def test_a_clearance_that_is_asked_for_in_vain_makes_everything_infeasible(cell: Cell, truth: dict, name: str) -> None:
    if missing(name):
        pytest.skip(missing(name))
    strict = cell.with_(constraints={"clearance_m": 0.2})
    assert not contender(name, strict)(truth["full"][0][:1])[1].any()


def test_early_naive_leaves_out_only_infeasible_candidates(cell: Cell, truth: dict) -> None:
    mmr, _ = contender("naive_early", cell)(truth["random"][0])
    assert np.isfinite(mmr[truth["random"][1].feasible]).all()
    assert np.isneginf(mmr).any()


def test_naive_and_nlpweld_look_at_the_same_111_pairs_and_15_heights(cell: Cell) -> None:
    table = body_table(cell)
    assert (len(table.pairs), len(table.above_floor)) == (111, 15)


def test_naive_refuses_branches_it_does_not_know(cell: Cell) -> None:
    with pytest.raises(ValueError, match="front"):
        Naive(cell.with_(configuration={"shoulder": "any"}))


def test_copies_keep_the_mix() -> None:
    X = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    many = copies(X, 5)
    assert many.shape == (10, 3)
    assert (np.abs(many - np.round(many)) <= 1e-6).all()
    assert np.round(many).sum() == 15
    assert len(np.unique(many, axis=0)) == 10
