"""The scaling study: slopes of known curves, and a figure of them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.scaling import draw, slopes


@pytest.fixture
def table() -> pd.DataFrame:
    rows = [
        {
            "engine": engine,
            "axis": axis,
            "size": size,
            "time_s": k * 1e-4 * size**power,
            "peak_mb": 100.0 + k,
            "grown_mb": k,
        }
        for k, (engine, power) in enumerate({"numba": 1.0, "numpy": 2.0}.items(), start=1)
        for axis in ("points", "candidates")
        for size in (10, 100, 1000)
    ]
    return pd.DataFrame(rows)


def test_slopes_are_the_powers_the_times_grow_with(table: pd.DataFrame) -> None:
    found = slopes(table).set_index(["engine", "axis"])
    assert found.loc["numba", "slope"].tolist() == pytest.approx([1.0, 1.0])
    assert found.loc["numpy", "slope_upper"].tolist() == pytest.approx([2.0, 2.0])
    assert found.loc[("numpy", "points"), "peak_mb"] == 102.0


def test_figure_shows_both_engines_over_both_axes(table: pd.DataFrame, tmp_path: Path) -> None:
    draw(table, tmp_path / "figures" / "scaling.png")
    from matplotlib import image

    pixels = image.imread(tmp_path / "figures" / "scaling.png")
    assert np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0).shape[0] > 50
