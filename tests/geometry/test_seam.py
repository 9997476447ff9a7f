"""The saddle seam: where it lies and which way it runs and faces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlpweld.cell import load_cell
from nlpweld.cell.task import Tee
from nlpweld.geometry.saddle import saddle
from nlpweld.geometry.seam import seam_parameters, weld_frames
from nlpweld.geometry.weld_frames import WeldFrames

THETA = np.linspace(0, 2 * np.pi, 361)


@st.composite
def tees(draw: st.DrawFn) -> Tee:
    """Draw pipes whose branch is between a twentieth and 98 % as thick as the main pipe."""
    main = draw(st.floats(0.01, 0.5))
    branch = main * draw(st.floats(0.05, 0.98))
    return Tee(shape="tee", main_radius_m=main, branch_radius_m=branch, main_length_m=3 * main, branch_top_m=2 * main,
               source="drawn")  # fmt: skip


def pipe_normals(frames: WeldFrames) -> tuple[np.ndarray, np.ndarray]:
    """Return the outward unit normals of main pipe and branch at the weld points, read off the points alone."""
    main, branch = frames.p_C * [0, 1, 1], frames.p_C * [1, 1, 0]
    return tuple(n / np.linalg.norm(n, axis=1, keepdims=True) for n in (main, branch))


@given(tees())
def test_weld_points_lie_on_both_pipes(tee: Tee) -> None:
    x, y, z = saddle(tee, THETA).p_C.T
    assert np.hypot(y, z) == pytest.approx(np.full(361, tee.main_radius_m), rel=1e-13)
    assert np.hypot(x, y) == pytest.approx(np.full(361, tee.branch_radius_m), rel=1e-13)


@given(tees())
def test_seam_runs_on_the_side_the_branch_leaves_the_main_pipe(tee: Tee) -> None:
    assert saddle(tee, THETA).p_C[:, 2].min() > 0.0


@given(tees())
def test_tangent_is_the_direction_of_the_seams_derivative(tee: Tee) -> None:
    step = 1e-5
    rate = (saddle(tee, THETA + step).p_C - saddle(tee, THETA - step).p_C) / (2 * step)
    expected = rate / np.linalg.norm(rate, axis=1, keepdims=True)
    assert saddle(tee, THETA).tangent_C == pytest.approx(expected, abs=1e-6)


@given(tees())
def test_tangent_and_normal_are_orthogonal_unit_vectors(tee: Tee) -> None:
    frames = saddle(tee, THETA)
    n, t = frames.normal_C, frames.tangent_C
    assert np.sum(n * t, axis=1) == pytest.approx(np.zeros(361), abs=1e-13)
    assert np.sum(n * n, axis=1) == pytest.approx(np.ones(361), abs=1e-13)
    assert np.sum(t * t, axis=1) == pytest.approx(np.ones(361), abs=1e-13)


@given(tees())
def test_weld_normal_bisects_the_outward_normals_of_both_pipes(tee: Tee) -> None:
    frames = saddle(tee, THETA)
    to_main, to_branch = (np.sum(n * frames.normal_C, axis=1) for n in pipe_normals(frames))
    assert to_main == pytest.approx(to_branch, abs=1e-13)
    assert to_main.min() > 0.5  # an angle of at most 60 degrees: the pipes' normals are 90 degrees apart or less


def test_seam_of_the_papers_cell_starts_on_plus_x_and_turns_towards_plus_y() -> None:
    frames = weld_frames(load_cell("three_er16"), np.array([0.0, 0.25]))
    assert frames.p_C == pytest.approx(np.array([[0.05, 0.0, 0.1], [0.0, 0.05, 0.0075**0.5]]), abs=1e-15)
    assert frames.tangent_C == pytest.approx(np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]), abs=1e-15)


def test_tilt_of_the_papers_normals_is_45_to_60_degrees() -> None:
    normals = weld_frames(load_cell("three_er16"), np.linspace(0, 1, 721)).normal_C
    tilt = np.degrees(np.arccos(normals[:, 2]))
    assert tilt.min() == pytest.approx(45.0, abs=1e-9)
    assert tilt.max() == pytest.approx(60.0, abs=1e-9)


@given(st.floats(0, 1), st.integers(-3, 3))
def test_seam_closes_after_one_unit_of_its_parameter(s: float, turns: int) -> None:
    cell = load_cell("three_er16")
    here, there = (weld_frames(cell, np.array([x])).p_C for x in (s, s + turns))
    assert here == pytest.approx(there, abs=1e-14)


@pytest.mark.parametrize("points", [3, 72, 720])
def test_points_are_equal_steps_of_the_parameter_without_the_repeated_end(points: int) -> None:
    s = seam_parameters(load_cell("three_er16").with_(seam={"points": points}))
    assert s.shape == (points,)
    assert s[0] == 0.0
    assert np.diff([*s, 1.0]) == pytest.approx(np.full(points, 1 / points), rel=1e-10)
