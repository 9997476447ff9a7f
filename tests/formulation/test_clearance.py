"""What is left out as far apart is far apart: clearances against every pair measured."""

import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.engine.numpy_kernels import lower
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.clearance import Meeting, boxes
from nlpweld.formulation.stage import Shape, Stage

from .helpers import arm_outputs

LEVELS = [0.0, 0.01, 0.1, 0.5]


def all_gaps(stage: Stage, x: np.ndarray) -> float:
    """Return the least of all gaps at a placement, by CasADi, nothing left out [m]."""
    ends = [arm_outputs(stage, k, x)[4].reshape(72, -1, 3).transpose(0, 2, 1) for k in range(3)]
    points = Batch(stage.cell).points
    ends.append(np.array([np.array(stage.work(x, point)) for point in points.T]))
    low = [np.array(stage.meetings[a, b](p, q)).min() for a, b in stage.meetings for p, q in over_seam(ends, a, b)]
    return float(min(low + [np.array(stage.heights[k](p)).min() for k in range(4) for p in ends[k]]))


def over_seam(ends: list[np.ndarray], a: int, b: int) -> zip:
    return zip(ends[a], ends[b], strict=True)


@pytest.mark.parametrize("engine", ["numpy", "numba"])
@pytest.mark.parametrize("clearance_m", [0.03, 0.05])
def test_clearance_missed_is_that_of_the_nearest_pair_of_all(cell: Cell, engine: str, clearance_m: float) -> None:
    if engine == "numba":
        pytest.importorskip("numba")
    batch = Batch(cell.with_(constraints={"clearance_m": clearance_m, "singularity_floor_m3": 0.0}), engine)
    X = np.random.default_rng(21).normal([0.0, -0.2, 0.42], 0.04, (40, 3))
    found = batch.evaluate(X)
    looked = (found.violation[:, :3] == 0.0).all(axis=1)
    missed = [max(0.0, (clearance_m + 0.0005 - all_gaps(batch.stage, x)) / 0.1) for x in X[looked]]
    alone = found.violation[looked, 3]
    assert looked.sum() >= 15
    assert np.count_nonzero(missed) >= 15
    assert (alone <= np.array(missed) + 1e-12).all()  # robots that fail by themselves are not held against each other
    same = np.isclose(alone, missed, atol=1e-12)
    assert same.sum() >= 8
    assert (alone[~same] > 0.0).all()


def random_bodies(rng: np.random.Generator, count: int) -> tuple[np.ndarray, list[Shape]]:
    """Return bodies of random length and radius at random places: ends (6 b, 30, 20) and shapes."""
    lengths, radii = rng.uniform(0.0, 0.8, count), rng.uniform(0.01, 0.2, count)
    start, way = rng.uniform(-1, 1, (count, 3, 30, 20)), rng.normal(size=(count, 3, 30, 20))
    way *= lengths[:, None, None, None] / np.linalg.norm(way, axis=1, keepdims=True)
    ends = np.stack([start, start + way], axis=1).reshape(6 * count, 30, 20)
    return ends, [Shape(f"b{i}", r, length**2) for i, (r, length) in enumerate(zip(radii, lengths, strict=True))]


@pytest.mark.parametrize("level", LEVELS)
def test_meeting_of_random_bodies_leaves_out_nothing_that_counts(
    batch: Batch, rng: np.random.Generator, level: float
) -> None:
    (a, shapes_a), (b, shapes_b) = (random_bodies(rng, count) for count in (4, 3))
    pairs = tuple((i, j) for i in range(4) for j in range(3) if (i, j) != (0, 0))
    gap = lower(batch.stage.gap)
    meeting = Meeting.of(gap, pairs, shapes_a, shapes_b)
    got = meeting.lowest(a, boxes(a, shapes_a), b, boxes(b, shapes_b), level)
    low = np.full((30, 20), level)
    for i, j in pairs:
        p, q = shapes_a[i], shapes_b[j]
        numbers = [p.sq_length, q.sq_length, p.radius_m + q.radius_m]
        low = np.minimum(low, gap(list(a[6 * i : 6 * i + 6]), list(b[6 * j : 6 * j + 6]), numbers)[0][0])
    assert got == pytest.approx(low.min(axis=1), abs=1e-13)
    assert (got < level).any()
