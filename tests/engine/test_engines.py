"""Every engine gives the exact model's answers: NumPy, and Numba where it is installed."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.engine import choice, numba_kernels
from nlpweld.engine.choice import chosen_engine
from nlpweld.engine.numpy_kernels import numpy_kernel
from nlpweld.errors import OptionError, OutputError
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.seam import seam_parameters

NAMES = ("numpy", "numba")
RANDOM = 10_000
CHUNK = 250


def placements(cell: Cell) -> np.ndarray:
    """Return placements in S, some out of it and out of reach, and the edge cases of the inverse (m, 3) [m]."""
    rng = np.random.default_rng(11)
    X = rng.uniform(*cell.box, (RANDOM // 72, 3))
    X[::5] += rng.choice([-3.0, 3.0], X[::5].shape)
    bases = np.array([station.base_position_m for station in cell.stations])
    edges = [
        base + np.array([0, 0, dz]) for base in bases for dz in (0.0, 0.412, 0.9)
    ]  # on axis 1, at the shoulder, above
    stretched = [bases[2] - [0, 2.02, -1.0], bases[2] - [0, 2.0201, -1.0]]
    return np.vstack([X, edges, stretched])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("part", ["grips", "limbs", "meetings"])
def test_engine_agrees_with_the_casadi_machine_on_ten_thousand_poses(cell: Cell, name: str, part: str) -> None:
    stage, points = Stage(cell), point_data(cell, seam_parameters(cell))
    X = placements(cell)
    m, n = len(X), points.shape[1]
    wide, tiled = np.repeat(X, n, axis=0).T, np.tile(points, m)
    signs = np.array([1.0, 1.0, 1.0])
    grips = [grip.map(m * n)(wide, tiled, ca.repmat(ca.DM(signs), 1, m * n)) for grip in stage.grips]
    lanes = [_lanes(np.array(grip[0]), 6, 2, (m, n)) for grip in grips]
    kernel = {"numpy": numpy_kernel, "numba": numba_kernels.numba_kernel}[name]
    if part == "grips":
        got = kernel(stage.grips[2], ("candidate", "point", "number"))(X, points, signs)
        want = grips[2]
    elif part == "limbs":
        got = kernel(stage.limbs[0], ("candidate", "lane"))(X, lanes[0])
        want = stage.limbs[0].map(m * n)(wide, grips[0][0])
    else:
        ends = [stage.limbs[k].map(m * n)(wide, grips[k][0])[1] for k in (0, 2)]
        shapes = [stage.limbs[k].size_out("ends") for k in (0, 2)]
        given = [_lanes(np.array(e), *shape, (m, n)) for e, shape in zip(ends, shapes, strict=True)]
        got = kernel(stage.meetings[0, 2], ("lane", "lane"))(*given)
        want = [stage.meetings[0, 2].map(m * n)(*ends)]
    assert m * n >= RANDOM
    _assert_same(got, want, (m, n))


def _lanes(columns: np.ndarray, rows: int, width: int, shape: tuple[int, int]) -> np.ndarray:
    """Return CasADi's mapped output (rows, width * m * n) as lanes (rows * width, m, n), column by column."""
    return columns.reshape(rows, *shape, width).transpose(3, 0, 1, 2).reshape(rows * width, *shape)


def _assert_same(got: tuple, want: tuple, shape: tuple[int, int]) -> None:
    for mine, theirs in zip(got, want, strict=True):
        theirs = np.array(theirs)
        width = theirs.shape[1] // (shape[0] * shape[1])
        expected = _lanes(theirs, theirs.shape[0], width, shape)
        assert np.isfinite(expected).all()
        assert np.abs(np.stack(list(mine)) - expected).max() <= 1e-12 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("branches", ["front", "any"])
def test_engines_judge_candidates_alike(cell: Cell, branches: str) -> None:
    own = cell if branches == "front" else cell.with_(configuration={"shoulder": "any", "elbow": "any"})
    rng = np.random.default_rng(12)
    X = np.vstack([rng.uniform(*cell.box, (150, 3)), rng.normal([0.0, -0.17, 0.4], 0.02, (50, 3))])
    ours, theirs = (Batch(own, name).evaluate(X) for name in NAMES)
    assert ours.violation == pytest.approx(theirs.violation, abs=1e-12)
    assert ours.objective == pytest.approx(theirs.objective, rel=1e-12)
    assert ours.feasible.sum() > 5


def test_unknown_engine_lists_those_there_are() -> None:
    with pytest.raises(OptionError, match="auto, numpy, numba, c"):
        chosen_engine("fortran")


def test_numba_that_is_not_installed_is_told_with_the_command_that_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "find_spec", lambda name: None)
    assert chosen_engine("auto") == "numpy"
    with pytest.raises(OptionError, match=r"pip install 'nlpweld\[fast\]'"):
        chosen_engine("numba")


def test_kernels_are_written_once_and_an_unwritable_cache_names_the_way_out(tmp_path, monkeypatch) -> None:
    x = ca.SX.sym("x", 2)
    f = ca.Function("f", [x], [x[0] * 3.25 + x[1]])
    monkeypatch.setenv("NLPWELD_CACHE", str(tmp_path / "cache"))
    X = np.arange(12.0).reshape(2, 2, 3)
    ((got,),) = numba_kernels.numba_kernel(f, ("lane",))(X)
    assert (got == 3.25 * X[0] + X[1]).all()
    assert len(list((tmp_path / "cache").glob("*.py"))) == 1
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("NLPWELD_CACHE", str(tmp_path / "file" / "cache"))
    kernel = numba_kernels.numba_kernel(ca.Function("g", [x], [x[0] * 4.25 + x[1]]), ("lane",))
    with pytest.raises(OutputError, match="NLPWELD_CACHE"):
        kernel(X)
