"""FCL against NumPy, and the watchdog around it."""

import sys
import time

import numpy as np
import pytest

from nlpweld.errors import VerifierError
from nlpweld.verify.bodies import body_table, floor_distances
from nlpweld.verify.exact import Watched, pair_distances, segment_distances, settle, shared

PAIR = np.array([[0, 1]])


def two(p0, p1, q0, q1) -> np.ndarray:
    return np.array([[[p0, p1], [q0, q1]]], dtype=float)


DEGENERATE = {
    "coaxial, apart": (two((0, 0, 0), (0, 0, 1), (0, 0, 2), (0, 0, 3)), 1.0),
    "coaxial, overlapping": (two((0, 0, 0), (0, 0, 1), (0, 0, 0.5), (0, 0, 3)), 0.0),
    "coaxial, opposed": (two((1, 0, 0), (0, 0, 0), (2, 0, 0), (3, 0, 0)), 1.0),
    "the same": (two((0, 0, 0), (0, 0, 1), (0, 0, 0), (0, 0, 1)), 0.0),
    "parallel, side by side": (two((0, 0, 0), (0, 0, 1), (0.5, 0, 0.5), (0.5, 0, 3)), 0.5),
    "parallel, one behind the other": (two((0, 0, 0), (0, 0, 1), (3, 0, 5), (3, 0, 6)), 5.0),
    "anti-parallel": (two((0, 0, 0), (0, 0, 1), (0.5, 0, 3), (0.5, 0, -3)), 0.5),
    "crossing axes": (two((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0)), 0.0),
    "crossing at right angles": (two((-1, 0, 0), (1, 0, 0), (0, -1, 0.7), (0, 1, 0.7)), 0.7),
    "tip against the side": (two((-1, 0, 0), (1, 0, 0), (0, 0, 0.4), (0, 0, 2)), 0.4),
    "no length": (two((0, 0, 0), (0, 0, 0), (3, 0, 4), (3, 0, 9)), 5.0),
    "neither has length": (two((0, 0, 0), (0, 0, 0), (3, 4, 0), (3, 4, 0)), 5.0),
}


@pytest.mark.parametrize("case", DEGENERATE)
def test_fcl_and_numpy_know_degenerate_pairs(case):
    ends, expected = DEGENERATE[case]
    assert segment_distances(ends, PAIR)[0, 0] == pytest.approx(expected, abs=1e-12)
    radii = np.array([0.1, 0.15])
    said = shared().distances(ends, radii, PAIR)[0, 0]
    assert said == pytest.approx(expected - 0.25, abs=1e-12)  # python-fcl 0.7: capsules report depth, not -1


def test_fcl_and_numpy_agree_on_random_pairs(rng):
    ends = rng.uniform(-1, 1, size=(300, 6, 2, 3))
    radii = rng.uniform(0.01, 0.3, size=6)
    pairs = np.array([(i, j) for i in range(6) for j in range(i)])
    said, own = shared().distances(ends, radii, pairs), segment_distances(ends, pairs) - radii[pairs].sum(axis=1)
    assert (said < -0.01).sum() > 100
    assert (said > 0.01).sum() > 100
    np.testing.assert_allclose(said, own, atol=1e-9)


def test_fcl_and_numpy_agree_on_nearly_parallel_pairs(rng):
    m = 2000
    ends = np.zeros((m, 2, 2, 3))
    ends[:, 0, :, 2] = [0, 1]
    ends[:, 1, :, 2] = rng.uniform(-1, 2, size=(m, 2))
    ends[:, 1] += [0.5, 0, 0] + rng.normal(size=(m, 2, 3)) * 10.0 ** rng.uniform(-17, -3, size=(m, 1, 1))
    own = segment_distances(ends, PAIR) - 0.2
    np.testing.assert_allclose(shared().distances(ends, np.array([0.1, 0.1]), PAIR), own, atol=1e-6)


def test_numpy_distance_is_the_least_over_both_segments(rng):
    ends = rng.uniform(-1, 1, size=(20, 2, 2, 3))
    t = np.linspace(0, 1, 201)[:, None]
    for got, (p, q) in zip(segment_distances(ends, PAIR)[:, 0], ends, strict=True):
        x, y = p[0] + t * (p[1] - p[0]), q[0] + t * (q[1] - q[0])
        brute = np.linalg.norm(x[:, None] - y[None], axis=-1).min()
        assert got <= brute + 1e-12
        assert got == pytest.approx(brute, abs=0.02)


def test_disagreement_counts_against_the_plan():
    said = np.array([0.5, 0.5, -1.0, np.nan, 0.3, 0.2])
    own = np.array([0.5 + 1e-9, 0.4, -0.02, -0.03, 0.31, np.nan])
    np.testing.assert_array_equal(settle(said, own)[:5], [0.5, 0.4, -0.02, -0.03, 0.3])


def test_chunks_are_joined_in_order(monkeypatch, rng):
    ends, radii = rng.uniform(-1, 1, size=(25, 2, 2, 3)), np.array([0.1, 0.2])
    whole = pair_distances(shared(), ends, radii, PAIR)
    monkeypatch.setattr("nlpweld.verify.exact.CHUNK", 7)
    np.testing.assert_array_equal(pair_distances(shared(), ends, radii, PAIR), whole)
    assert len(np.unique(whole)) == 25


def test_body_of_changing_length_is_measured_at_each_sample():
    ends = np.array([[[(0, 0, 0), (0, 0, h)], [(0, 0, 3), (0, 0, 4)]] for h in (1, 2, 0.5)], dtype=float)
    got = shared().distances(ends, np.array([0.1, 0.1]), PAIR)[:, 0]
    np.testing.assert_allclose(got, [1.8, 0.8, 2.3], atol=1e-12)


SIMPLE = (two((0, 0, 0), (0, 0, 1), (2, 0, 0), (2, 0, 1)), np.array([0.1, 0.2]), PAIR)


def planted(text: str, limit_s: float = 20.0) -> Watched:
    return Watched((sys.executable, "-c", text), limit_s)


def test_hang_is_killed_twice_and_told():
    watched, begun = planted("import time; time.sleep(60)", limit_s=0.4), time.monotonic()
    with pytest.raises(VerifierError, match=r"over 0\.4 s"):
        watched.distances(*SIMPLE)
    assert watched.starts == 2
    assert time.monotonic() - begun < 5


def test_crash_is_told_with_its_last_words():
    watched = planted("import os, sys; print('no such library', file=sys.stderr, flush=True); os._exit(3)")
    with pytest.raises(VerifierError, match="no such library"):
        watched.distances(*SIMPLE)
    assert watched.starts == 2


def test_rubbish_is_not_believed():
    watched = planted("import sys; sys.stdout.buffer.write(b'x' * 100); sys.stdout.flush(); sys.stdin.buffer.read()")
    with pytest.raises(VerifierError):
        watched.distances(*SIMPLE)


@pytest.mark.parametrize("trouble", ["time.sleep(60)", "os.abort()"])
def test_one_hang_or_crash_is_survived(tmp_path, trouble):
    text = f"""
import os, pathlib, time
flag = pathlib.Path({str(tmp_path / "been_here")!r})
if not flag.exists():
    flag.touch()
    {trouble}
from nlpweld.verify.worker import main
main()
"""
    watched = planted(text, limit_s=3.0)
    try:
        assert watched.distances(*SIMPLE)[0, 0] == pytest.approx(1.7)
        assert watched.starts == 2
        assert watched.distances(*SIMPLE)[0, 0] == pytest.approx(1.7)
        assert watched.starts == 2  # the second process is kept
    finally:
        watched.close()


def test_worker_found_dead_is_started_again():
    watched = Watched()
    try:
        watched.distances(*SIMPLE)
        watched._process.kill()
        assert watched.distances(*SIMPLE)[0, 0] == pytest.approx(1.7)
        assert watched.starts == 2
    finally:
        watched.close()


def test_pairs_are_those_of_the_model(cell):
    table = body_table(cell)
    labels = set(table.pair_labels)
    assert len(table.pairs) == 5 * 5 + 2 * 5 * 6 + 2 * (5 * 2 - 2) + (6 * 2 - 2)
    assert len(table.above_floor) == 16 - 3 + 2
    assert len(labels) == len(table.pair_labels)
    assert "handler_1.base_column - handler_2.forearm" in labels
    assert "handler_1.gripper - workpiece.branch" in labels
    assert "welder.torch_body - workpiece.main_pipe" in labels
    assert "workpiece.branch - floor" in labels
    for body in ("wrist", "gripper"):
        assert f"handler_2.{body} - workpiece.main_pipe" not in labels
    assert not [x for x in labels if "nozzle - workpiece" in x or "base_column - floor" in x]
    assert not [x for x in labels if x.count("handler_1.") == 2 or x.count("workpiece.") == 2]


def test_floor_distance_is_that_of_the_lower_end(cell):
    table = body_table(cell)
    ends = np.zeros((1, len(table.label), 2, 3))
    ends[..., 2] = [0.5, 0.3]
    np.testing.assert_allclose(floor_distances(table, ends)[0], 0.3 - table.radius_m[table.above_floor])
