"""A reference from nothing: verified, bounded, and the same whether or not it was interrupted."""

from pathlib import Path

import numpy as np
import pytest

from nlpweld.bench.answer import evaluate
from nlpweld.cell import Cell, load_cell
from nlpweld.errors import OptionError
from nlpweld.formulation.reduced import reduced
from nlpweld.reference.best import best_candidates
from nlpweld.reference.find import SAVED_EVERY, Effort, Progress, bounded, find_reference
from nlpweld.reference.tree import BATCH

EFFORT = Effort(gap=0.02, candidates=512, polished=1, engine="numpy")


@pytest.fixture(scope="module")
def coarse() -> Cell:
    return load_cell("robot_positioner").with_(seam={"points": 12})


def quiet(_: object) -> None:
    pass


def test_the_reference_is_verified_and_bounded(coarse: Cell, tmp_path: Path) -> None:
    steps, checkpoint = set(), tmp_path / "search.npz"
    found = find_reference(coarse, EFFORT, checkpoint, lambda progress: steps.add(progress.step))
    assert steps == {"candidates", "polishing", "margins", "bounding"}
    assert found.content_hash == coarse.content_hash
    report = evaluate(coarse, found.placement)
    assert report.feasible
    assert report.mmr_mean == pytest.approx(found.objective, rel=1e-9)
    assert found.objective_with_margins <= found.objective <= found.upper_bound <= 1.02 * found.objective + 1e-12
    assert found.open_boxes == 0
    assert not checkpoint.exists()


def test_interrupted_and_taken_up_it_bounds_alike(
    coarse: Cell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nlpweld.reference.tree.BATCH", 16)
    path, rounds = tmp_path / "search.npz", 0

    def interrupt(_: Progress) -> None:
        nonlocal rounds
        rounds += 1
        if rounds == 6:
            raise KeyboardInterrupt

    undisturbed = bounded(coarse, 0.58, 1, EFFORT, tmp_path / "other.npz", quiet)
    with pytest.raises(KeyboardInterrupt):
        bounded(coarse, 0.58, 1, EFFORT, path, interrupt)
    seen = []
    resumed = bounded(coarse, 0.58, 1, EFFORT, path, lambda progress: seen.append(progress.done))
    assert (resumed.upper_bound, resumed.boxes) == (undisturbed.upper_bound, undisturbed.boxes)
    assert seen[0] > 6 * 2  # not from the start
    # another target is another search
    fresh, again = (bounded(coarse, 0.7, 1, EFFORT, file, quiet) for file in (tmp_path / "third.npz", path))
    assert again.boxes == fresh.boxes != undisturbed.boxes


def test_out_of_boxes_is_said(coarse: Cell, tmp_path: Path) -> None:
    few = Effort(gap=1e-6, boxes=300, engine="numpy")
    tree = bounded(coarse, 0.58, 1, few, tmp_path / "search.npz", quiet)
    assert len(tree.bound) > 0
    assert 300 <= tree.boxes < 300 + 2 * BATCH
    assert SAVED_EVERY > 0
    assert (tmp_path / "search.npz").exists()  # for whoever goes on with more boxes


def test_the_best_candidates_lie_apart(coarse: Cell) -> None:
    nlp = reduced(coarse, "numpy")
    X = np.array(best_candidates(nlp, 0, 256, 3, lambda *_: None))
    gaps = np.linalg.norm(X[:, None] - X[None], axis=2)[np.triu_indices(3, 1)]
    assert (gaps > 0.05 * np.linalg.norm(nlp.upper - nlp.lower)).all()
    assert nlp.evaluate(X[:1]).feasible[0]


def test_where_nothing_is_feasible_there_is_no_reference(coarse: Cell, tmp_path: Path) -> None:
    nowhere = coarse.with_(constraints={"singularity_floor_m3": 5.0})
    with pytest.raises(OptionError, match="none of 64 candidates leads to a verified answer"):
        find_reference(nowhere, Effort(candidates=64, polished=1, engine="numpy"), tmp_path / "search.npz")


def test_what_has_no_bound_yet_is_declined(tmp_path):
    cell = load_cell("robot_positioner")
    with pytest.raises(OptionError, match="mean over the seam, not of its minimum"):
        find_reference(cell.with_(objective={"over_seam": "minimum"}), Effort(), tmp_path / "search.npz")
    data = cell.model_dump(mode="python", exclude_unset=True)
    x = data["stations"][0]["base_position_m"][0]
    data["stations"][0]["layout"] = {"x_m": (x - 0.1, x + 0.1), "source": "test"}
    with pytest.raises(OptionError, match="bases are free; hold them"):
        find_reference(Cell.model_validate(data), Effort(), tmp_path / "search.npz")
