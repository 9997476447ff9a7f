"""Affine enclosures hold the exact values, by operation and for whole graphs, and say so when they know nothing."""

import inspect
import subprocess
import sys

import casadi as ca
import numpy as np
import pytest

from nlpweld.engine import affine, affine_steps
from nlpweld.engine.affine import AffineForms, Forms, middles

ENGINES = ("numpy", "numba")
x, point, number = ca.SX.sym("x", 3), ca.SX.sym("point", 2), ca.SX.sym("number", 2)
inner = x[0] * x[1] + x[2] ** 2 + point[0]
EXPRESSIONS = {
    "sum": inner + x[0] * point[1],
    "difference": point[0] - x[1] - inner,
    "product": inner * (x[1] + point[1]),
    "product with data": point[1] * inner,
    "quotient": inner / (3 + x[0] ** 2 * point[0]),
    "quotient of data": point[1] / inner,
    "reciprocal": 1 / inner,
    "negative and twice": -(inner + inner),
    "square": inner**2,
    "square root": ca.sqrt(inner**2 + 0.1),
    "square root at zero": ca.sqrt(x[0] ** 2),
    "sine": ca.sin(inner * x[1]),
    "cosine": ca.cos(inner - x[2]),
    "least": ca.fmin(inner, point[1] + x[0] * x[2]),
    "greatest": ca.fmax(inner * x[0], point[0]),
    "greatest of data and form": ca.fmax(point[0], x[1]),
    "absolute": ca.fabs(x[0] * x[1] - point[0]),
    "choice": ca.if_else(x[0] < point[0], inner, x[1] * x[2]),
    "other choice": ca.if_else(x[0] <= x[1], inner, 0),
    "numbers": number[0] * inner - number[1],
    "data alone": point[0] * point[1] + ca.sqrt(point[0] ** 2),
    "constant": ca.SX(0.1) + 0 * x[0],
}
GRAPH = ca.Function("graph", [x, point, number], [ca.densify(ca.vertcat(*EXPRESSIONS.values()))])
BOXES, POINTS = 12, 9


def enclosed(forms: AffineForms, points: np.ndarray, rng: np.random.Generator, width: float) -> dict[str, tuple]:
    """Return by expression how many of many exact values are outside, and the share of forms that know nothing."""
    lower = rng.normal(size=(BOXES, 3))
    upper, given = lower + width * rng.random((BOXES, 3)), rng.normal(size=(BOXES, 2))
    found = forms(lower, upper, given)
    middle, half = middles(lower, upper)
    outside, exact = np.zeros(len(EXPRESSIONS), dtype=int), GRAPH.map(BOXES * POINTS)
    for k in range(20):
        share = np.array([[k >> i & 1 for i in range(3)]] * BOXES) if k < 8 else rng.random((BOXES, 3))
        X = np.clip(lower + share * (upper - lower), lower, upper)
        lanes = [np.repeat(X, POINTS, 0).T, np.tile(points, BOXES), np.repeat(given, POINTS, 0).T]
        value = np.array(exact(*lanes)).reshape(-1, BOXES, POINTS)
        t = np.clip((X - middle) / np.maximum(half, 1e-300), -1, 1).T[:, None, :, None]
        line = found.middle + (found.slopes * t).sum(axis=0)
        # t and the line are rounded here, by much less than the machine adds for its own rounding
        beyond = np.abs(value - line) > found.error * (1 + 1e-9) + 1e-12 * np.abs(value)
        outside += (beyond | (value < found.lower) | (value > found.upper)).sum(axis=(1, 2))
    unknown = (~np.isfinite(found.radius)).mean(axis=(1, 2))
    return {name: (outside[i], unknown[i]) for i, name in enumerate(EXPRESSIONS)}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("width", [1.0, 0.1, 1e-3, 1e-9, 0.0])
def test_forms_and_their_ends_hold_exact_values(engine: str, width: float, rng: np.random.Generator) -> None:
    points = rng.normal(size=(2, POINTS))
    forms = AffineForms(GRAPH, points, engine)
    for _ in range(3):
        found = enclosed(forms, points, rng, width)
        assert {name: n for name, (n, _) in found.items() if n} == {}
        if width < 0.01:  # small boxes leave little unknown, so that holding everything is no way out
            assert max(unknown for _, unknown in found.values()) < 0.3


def test_a_step_that_is_too_narrow_is_found_out(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    points, told = rng.normal(size=(2, POINTS)), set()
    plants = {
        "product": (" + radius_u * radius_v", ""),
        "square": ("w[p + W + j] + half", "w[p + W + j]"),
        "rooted": ("w[spare + W2 + j] = half", "w[spare + W2 + j] = 0.5 * half"),
        "inverted": ("pick(valid, half, inf)", "pick(valid, 0.5 * half, inf)"),
        "folded": ("w[spare + W2 + j] = half", "w[spare + W2 + j] = 0.5 * half"),
        "extreme": ("second + half", "second + 0.5 * half"),
        "turned": ("0.5 * radius * radius", "0.1 * radius * radius"),
        "granted": ("unknown * size", "0.0 * size"),
        "closed": ("+= abs(", "= abs("),
    }
    source = inspect.getsource
    for step, (right, wrong) in plants.items():

        def planted(f: object, step: str = step, right: str = right, wrong: str = wrong) -> str:
            text = source(f)
            if getattr(f, "__name__", "") != step:
                return text
            assert right in text
            return text.replace(right, wrong)

        with monkeypatch.context() as patch:
            patch.setattr(inspect, "getsource", planted)
            forms = AffineForms(GRAPH, points, "numpy")
        if any(n for _ in range(6) for n, _ in enclosed(forms, points, rng, 0.5).values()):
            told.add(step)
    assert told == set(plants)


def test_rounding_is_covered_where_doubles_fall_short(rng: np.random.Generator) -> None:
    # exact sums of doubles by fractions: the plain value differs from them, the form holds them
    from fractions import Fraction

    y = ca.SX.sym("y")
    f = ca.Function("f", [y, ca.SX.sym("p", 1), ca.SX.sym("n", 0)], [(y + 0.1) * (y - 0.3) + y / 3])
    forms, missed = AffineForms(f, np.zeros((1, 1)), "numpy"), 0
    for value in rng.random(200):
        v = Fraction(float(value))
        exact = (v + Fraction(0.1)) * (v - Fraction(0.3)) + v / 3
        found = forms(np.array([[value]]), np.array([[value]]), np.zeros((1, 0)))
        low, high = (Fraction(float(end[0, 0, 0])) for end in (found.lower, found.upper))
        assert low <= exact <= high
        assert high - low < 1e-11
        missed += Fraction(float(f(value, 0, []))) != exact
    assert missed > 100


@pytest.mark.parametrize("engine", ENGINES)
def test_nothing_is_claimed_where_nothing_is_known(engine: str) -> None:
    y = ca.SX.sym("y")
    rows = [1 / y, ca.fmax(1 / y, 2.0), (1 / y) * 0.0 + y, ca.sqrt(y - 3), ca.if_else(1 / y < 0, 1, y)]
    f = ca.Function("f", [y, ca.SX.sym("p", 1), ca.SX.sym("n", 0)], [ca.vertcat(*rows)])
    found = AffineForms(f, np.zeros((1, 1)), engine)(np.array([[-1.0]]), np.array([[1.0]]), np.zeros((1, 0)))
    assert np.isinf(found.upper[[0, 1, 3]]).all()
    assert found.upper[4, 0, 0] >= 1.0
    assert found.lower[4, 0, 0] <= 0.0


def test_the_error_shrinks_with_the_square_of_the_box(rng: np.random.Generator) -> None:
    points = rng.normal(size=(2, POINTS))
    lower, forms = np.full((1, 3), 1.1), AffineForms(GRAPH, points, "numpy")
    wide, narrow = (forms(lower, lower + h, np.ones((1, 2))).error for h in (1e-2, 1e-3))
    smooth = [i for i, name in enumerate(EXPRESSIONS) if name in ("product", "quotient", "square", "sine")]
    assert np.nanmax(narrow[smooth] / wide[smooth]) < 0.02


def test_engines_agree(rng: np.random.Generator) -> None:
    points, lower, given = rng.normal(size=(2, 100)), rng.normal(size=(7, 3)), rng.normal(size=(7, 2))
    ours, theirs = (AffineForms(GRAPH, points, engine)(lower, lower + 0.1, given) for engine in ENGINES)
    known = np.isfinite(ours.radius)
    assert (known == np.isfinite(theirs.radius)).all()
    np.testing.assert_allclose(ours.middle[known], theirs.middle[known], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ours.error[known], theirs.error[known], rtol=1e-6, atol=1e-11)


def test_the_mean_of_forms_holds_the_mean(rng: np.random.Generator) -> None:
    forms = Forms(rng.normal(size=(2, 5)), rng.normal(size=(3, 2, 5)), rng.random((2, 5)))
    mean = forms.mean()
    assert mean.middle == pytest.approx(forms.middle.mean(axis=1))
    assert (mean.upper >= forms.middle.mean(axis=1) + np.abs(forms.slopes.mean(axis=2)).sum(axis=0)).all()
    assert (mean.upper <= forms.upper.mean(axis=1) + 1e-12).all()


def test_an_operation_without_form_is_refused() -> None:
    y = ca.SX.sym("y")
    with pytest.raises(ValueError, match="EXP has no affine form"):
        AffineForms(ca.Function("f", [y, ca.SX.sym("p"), ca.SX.sym("n")], [ca.exp(y)]), np.zeros((1, 1)))


def test_every_operation_of_a_tape_has_steps_or_is_refused() -> None:
    text = inspect.getsource(affine_steps)
    names = set(affine.BINARY) | set(affine.UNARY)
    assert {name for name in names if f"op == {name}" not in text} == {*affine.WITHOUT, "IF_ELSE_ZERO"}


def test_numpy_needs_no_numba() -> None:
    text = (
        "import sys; sys.modules['numba'] = None\n"
        "import casadi as ca, numpy as np\nfrom nlpweld.engine.affine import AffineForms\n"
        "y = ca.SX.sym('y'); f = ca.Function('f', [y, ca.SX.sym('p'), ca.SX.sym('n')], [y * y])\n"
        "zero = np.zeros((1, 1)); print(AffineForms(f, zero)(zero, zero + 1, zero).upper[0, 0, 0] >= 1)"
    )
    assert subprocess.run([sys.executable, "-c", text], capture_output=True, text=True).stdout == "True\n"
