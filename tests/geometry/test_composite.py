"""Composite and polyline seams: where they lie, how long they are, which way they run and face."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from nlpweld.cell.seams import Composite, Polyline
from nlpweld.errors import CellError
from nlpweld.geometry.composite import composite_frames, equal_steps, seam_breaks, seam_length_m

LEG, RADIUS = 0.3, 0.1
U = Composite.model_validate(
    {
        "curve": "composite",
        "points": 101,
        "start_m": (-RADIUS, 0.05, LEG),
        "pieces": (
            {"kind": "line", "to_m": (-RADIUS, 0.05, 0.0)},
            {"kind": "arc", "centre_m": (0.0, 0.05, 0.0), "axis": (0.0, -2.0, 0.0), "angle_deg": 180.0},
            {"kind": "line", "to_m": (RADIUS, 0.05, LEG)},
        ),
        "side": (0.0, -3.0, 0.0),
        "source": "two lines and half a circle, as Zhang et al., Fig. 7",
    }
)
SPATIAL = Composite.model_validate(
    {
        "curve": "composite",
        "points": 50,
        "start_m": (0.2, 0.0, 0.1),
        "pieces": (
            {"kind": "arc", "centre_m": (0.0, 0.0, 0.1), "axis": (0.0, 0.0, 1.0), "angle_deg": 130.0},
            {"kind": "line", "to_m": (-0.4, 0.1, 0.3)},
            {"kind": "arc", "centre_m": (-0.4, 0.1, 0.0), "axis": (-1.0, 0.0, 0.0), "angle_deg": -75.0},
        ),
        "side": (0.1, 0.2, 1.0),
        "lean_deg": 20.0,
        "source": "made up",
    }
)
RING = Composite.model_validate(
    {
        "curve": "composite",
        "points": 12,
        "start_m": (0.1, 0.0, 0.0),
        "pieces": (
            {"kind": "arc", "centre_m": (0.0, 0.0, 0.0), "axis": (0.0, 0.0, 1.0), "angle_deg": 90.0},
            {"kind": "arc", "centre_m": (0.0, 0.0, 0.0), "axis": (0.0, 0.0, 1.0), "angle_deg": 270.0},
        ),
        "side": (0.0, 0.0, 1.0),
        "closed": True,
        "source": "made up",
    }
)
SQUARE = Polyline.model_validate(
    {
        "curve": "polyline",
        "points": 8,
        "vertices_m": ((0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.2, 0.1, 0.0), (0.0, 0.1, 0.0)),
        "normals": ((0.0, 0.0, 2.0), (0.0, -1.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
        "closed": True,
        "source": "made up",
    }
)
SEAMS = [U, SPATIAL, RING, SQUARE]
EACH = pytest.mark.parametrize("seam", SEAMS, ids=["u", "spatial", "ring", "square"])


def off_breaks(seam: Composite | Polyline, m: int = 400) -> np.ndarray:
    """Return parameters at least 1e-4 away from where pieces join and from the ends."""
    s = (np.arange(m) + 0.5) / m
    joints = np.concatenate([[0.0, 1.0], seam_breaks(seam)])
    return s[np.abs(s[:, None] - joints).min(axis=1) > 1e-4]


@EACH
def test_length_is_the_integral_of_the_speed(seam: Composite | Polyline) -> None:
    h, weights = 3e-4, np.array([1.0, -8.0, 8.0, -1.0]) / 12  # differences of fourth order, inside a piece

    def speed(s: float) -> float:
        return float(np.linalg.norm(weights @ composite_frames(seam, s + h * np.array([-2, -1, 1, 2])).p_C)) / h

    length = 0.0
    for a, b in pairwise(np.unique([0.0, *seam_breaks(seam), 1.0])):
        inside = quad(speed, a + 2 * h, b - 2 * h, epsabs=1e-12)[0]
        length += inside * (b - a) / (b - a - 4 * h)
    assert length == pytest.approx(seam_length_m(seam), abs=1e-9)


def test_length_of_the_u_seam_is_that_of_its_formula_by_quadrature() -> None:
    half = quad(lambda a: np.hypot(RADIUS * np.sin(a), RADIUS * np.cos(a)), 0, np.pi, epsabs=1e-13)[0]
    assert seam_length_m(U) == pytest.approx(2 * LEG + half, abs=1e-12)


def test_length_of_a_seam_in_space_is_its_formulas_by_quadrature() -> None:
    end = 0.2 * np.array([np.cos(np.radians(130)), np.sin(np.radians(130)), 0.5])
    straight = quad(lambda u: np.linalg.norm(np.array([-0.4, 0.1, 0.3]) - end), 0, 1, epsabs=1e-13)[0]
    arcs = quad(lambda u: 0.2 * np.radians(130) + 0.3 * np.radians(75), 0, 1, epsabs=1e-13)[0]
    assert seam_length_m(SPATIAL) == pytest.approx(straight + arcs, abs=1e-9)


@EACH
def test_tangent_is_the_derivative_by_arc_length(seam: Composite | Polyline) -> None:
    s, step = off_breaks(seam), 1e-5
    ahead, behind = (composite_frames(seam, s + sign * step).p_C for sign in (1, -1))
    rate = (ahead - behind) / (2 * step * seam_length_m(seam))
    assert np.abs(rate - composite_frames(seam, s).tangent_C).max() < 1e-8


@EACH
def test_tangents_and_normals_are_orthogonal_unit_vectors(seam: Composite | Polyline) -> None:
    frames = composite_frames(seam, np.concatenate([np.linspace(0, 1, 1001), seam_breaks(seam)]))
    t, n = frames.tangent_C, frames.normal_C
    assert np.abs(np.sum(t * n, axis=1)).max() < 1e-14
    assert np.abs(np.linalg.norm(t, axis=1) - 1).max() < 1e-14
    assert np.abs(np.linalg.norm(n, axis=1) - 1).max() < 1e-14


@EACH
def test_position_is_continuous_where_pieces_join(seam: Composite | Polyline) -> None:
    joints, tiny = seam_breaks(seam), 1e-13
    at, before = (composite_frames(seam, s).p_C for s in (joints, joints - tiny))
    assert np.abs(at - before).max() < 1e-12


def test_u_seam_is_continuous_in_tangent_and_normal_too() -> None:
    joints = seam_breaks(U)
    at, before = (composite_frames(U, s) for s in (joints, joints - 1e-13))
    assert np.abs(at.tangent_C - before.tangent_C).max() < 1e-11
    assert np.abs(at.normal_C - before.normal_C).max() < 1e-11
    assert joints == pytest.approx(np.array([LEG, LEG + np.pi * RADIUS]) / (2 * LEG + np.pi * RADIUS), abs=1e-15)


def test_u_seam_goes_down_around_and_up_and_faces_the_middle() -> None:
    frames = composite_frames(U, np.array([0.0, 0.25, 0.5, 0.75, 1.0]))
    assert frames.p_C[[0, 2, 4]] == pytest.approx(
        np.array([[-RADIUS, 0.05, LEG], [0, 0.05, -RADIUS], [RADIUS, 0.05, LEG]]), abs=1e-15
    )
    assert frames.tangent_C[[0, 2, 4]] == pytest.approx(np.array([[0, 0, -1], [1, 0, 0], [0, 0, 1]]), abs=1e-15)
    assert frames.normal_C[[0, 2, 4]] == pytest.approx(np.array([[1, 0, 0], [0, 0, 1], [-1, 0, 0]]), abs=1e-15)


def test_normal_on_an_arc_about_its_side_is_towards_the_centre() -> None:
    frames = composite_frames(U, np.linspace(*seam_breaks(U), 50))
    to_centre = (np.array([0.0, 0.05, 0.0]) - frames.p_C) / RADIUS
    assert np.abs(frames.normal_C - to_centre).max() < 1e-12


def test_lean_turns_the_normal_about_the_tangent_towards_the_side() -> None:
    s = np.linspace(0, 1, 50)
    straight, leaned = composite_frames(U, s), composite_frames(U.beside(0.0, lean_deg=30.0), s)
    assert (leaned.tangent_C == straight.tangent_C).all()
    assert np.sum(leaned.normal_C * straight.normal_C, axis=1) == pytest.approx(np.full(50, np.cos(np.pi / 6)))
    assert leaned.normal_C @ [0, -1, 0] == pytest.approx(np.full(50, 0.5))


def test_parallel_seam_is_the_same_moved_along_the_side() -> None:
    s = np.linspace(0, 1, 50)
    here, there = composite_frames(U, s), composite_frames(U.beside(0.02), s)
    assert np.abs(there.p_C - here.p_C - [0, -0.02, 0]).max() < 1e-15
    assert np.abs(there.normal_C - here.normal_C).max() < 1e-15
    assert U.beside(0.02).lean_deg == U.lean_deg
    assert U.beside(0.02, lean_deg=-45.0).lean_deg == -45.0


@EACH
def test_points_are_equal_arc_lengths_apart(seam: Composite | Polyline) -> None:
    s = equal_steps(seam)
    step = 1 / (seam.points - (not seam.closed))
    assert s.shape == (seam.points,)
    assert s[0] == 0.0
    assert np.diff(s) == pytest.approx(np.full(seam.points - 1, step), rel=1e-12)
    assert s[-1] == pytest.approx(1 - step if seam.closed else 1.0, abs=1e-15)
    dense = composite_frames(seam, np.linspace(0, s[1], 2001)).p_C
    walked = np.linalg.norm(np.diff(dense, axis=0), axis=1).sum()
    assert walked == pytest.approx(step * seam_length_m(seam), rel=1e-6)


@pytest.mark.parametrize("seam", [RING, SQUARE], ids=["ring", "square"])
def test_closed_seam_comes_round(seam: Composite | Polyline) -> None:
    s = np.linspace(0.013, 0.93, 40)
    here = composite_frames(seam, s)
    for turns in (-2, 1):
        there = composite_frames(seam, s + turns)
        assert np.abs(there.p_C - here.p_C).max() < 1e-14
        assert np.abs(there.normal_C - here.normal_C).max() < 1e-12
    assert seam_breaks(seam)[0] == 0.0


def test_corner_takes_tangent_and_normal_of_the_piece_that_starts_there() -> None:
    breaks = seam_breaks(SQUARE)
    assert breaks == pytest.approx([0.0, 1 / 3, 0.5, 5 / 6], abs=1e-15)
    frames = composite_frames(SQUARE, breaks)
    assert frames.tangent_C == pytest.approx(np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]), abs=1e-15)
    assert frames.normal_C[1] == pytest.approx([0, 0, 1], abs=1e-15)  # (0, -1, 1) made orthogonal to +y
    before = composite_frames(SQUARE, breaks[1:2] - 1e-13)
    assert before.normal_C[0] == pytest.approx(np.array([0, -1, 1]) / np.sqrt(2), abs=1e-11)


def test_normals_of_a_polyline_are_between_those_of_its_points() -> None:
    n = composite_frames(SQUARE, np.array([1 / 6])).normal_C[0]
    assert n == pytest.approx(np.array([0, -1, 1 + np.sqrt(2)]) / np.linalg.norm([1, 1 + np.sqrt(2)]), abs=1e-12)


def test_length_of_a_given_normal_and_its_part_along_the_seam_do_not_matter() -> None:
    data = SQUARE.model_dump()
    normals = [(0.0, 0.0, 1e-4), (0.0, -5.0, 5.0), *data["normals"][2:]]
    slanted = Polyline.model_validate({**data, "normals": [(0.9e-4, 0.0, 1e-4), *normals[1:]]})
    upright = Polyline.model_validate({**data, "normals": normals})
    s = np.linspace(0, 0.33, 30)  # the first piece, along x
    expected = composite_frames(SQUARE, s).normal_C
    for seam in (slanted, upright):
        assert np.abs(composite_frames(seam, s).normal_C - expected).max() < 1e-12


@pytest.mark.parametrize("s", [-1e-9, 1.0001, np.nan])
def test_parameter_beyond_an_open_seam_is_refused(s: float) -> None:
    with pytest.raises(CellError, match=r"^seam parameter \S+ of point 1 is outside 0 to 1 of an open seam"):
        composite_frames(U, np.array([0.5, s]))
