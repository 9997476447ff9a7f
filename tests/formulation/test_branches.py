"""What a sample says of branches, and what the exact model says of the same placements."""

import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.branches import Screening
from nlpweld.formulation.redundant import redundant


@pytest.fixture(scope="module")
def coarse(cell: Cell) -> Cell:
    return cell.with_(seam={"points": 18}, configuration={"shoulder": "any", "elbow": "any"})


def screening() -> Screening:
    kept = np.zeros((4, 2, 2), dtype=bool)
    kept[0, :, 0] = True  # both on branch 0
    kept[1, 0, 1] = True  # the first alone on branch 1
    return Screening(np.arange(4.0)[:, None], kept)


def test_doubt_tells_what_was_met_together_what_apart_and_what_never() -> None:
    assert screening().doubt.tolist() == [0, 2, 1, 2]
    assert screening().at(0).tolist() == [[0.0]]
    assert len(screening().at(2)) == 0
    assert str(screening()) == ("of 4 branch combinations 2 are of branches met, 1 were met together, in 4 samples")


def test_modes_are_counted_as_the_exact_model_counts_them(coarse: Cell) -> None:
    batch = Batch(coarse)
    found = batch.evaluate(batch.screening.X)
    seen = np.isfinite(found.objective)
    together = batch.screening.together
    assert 10 < seen.sum() < 200
    assert together[seen, found.mode[seen]].all()
    assert (seen <= together.any(axis=1)).all()
    assert {batch.modes[mode][2] for mode in np.flatnonzero(batch.screening.doubt == 0)} >= {("back", "down")}


def test_of_three_arms_64_combinations_few_remain(coarse: Cell) -> None:
    doubt = Batch(coarse).screening.doubt
    assert len(doubt) == 64
    assert 2 <= (doubt == 0).sum() < (doubt <= 1).sum() < 16


def test_what_nearly_keeps_the_floor_counts_and_what_does_not_is_in_doubt(coarse: Cell) -> None:
    levels = {"singularity_floor_m3": 10.0}  # no arm has that much
    assert not Batch(coarse.with_(constraints=levels)).screening.kept.any()


def test_free_angles_are_screened_with_the_placements(coarse: Cell) -> None:
    nlp = redundant(coarse, engine="numpy", level="spin_yaw_tilt", controls=6)
    assert nlp.screen is not None
    told = nlp.screen()
    for mode in np.flatnonzero(told.doubt == 0):
        plan = nlp.unpack(told.at(mode)[0], int(mode))
        for station in coarse.stations:
            assert (
                np.abs(plan.paths[station.name] - station.robot.limits_rad.mean(axis=1)).T.max(axis=1)
                < np.ptp(station.robot.limits_rad, axis=1) / 2
            ).all()
    assert np.array_equal(np.clip(told.X, nlp.lower, nlp.upper), told.X)
    assert len(np.unique(told.X[:, 3:], axis=0)) == 32


def test_one_mode_needs_no_screening(cell: Cell) -> None:
    assert redundant(cell, engine="numpy").screen is None
