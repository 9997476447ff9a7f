"""Branch and bound finds known optima, excludes what it may, and goes on as if never interrupted."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from nlpweld.engine.affine import AffineForms, Forms
from nlpweld.reference.bound import dense_parameters, lagrange_bound
from nlpweld.reference.checkpoint import load_tree, save_tree
from nlpweld.reference.tree import Tree, explore, halves, whole

x = ca.SX.sym("x", 2)
BOX = np.array([[-2.0, -2.0], [2.0, 2.0]])
# mode 0 has its optimum 1 at (0.3, -0.2); mode 1 its optimum 2 - 0.5**2 on the level's edge, where x0 = 0.5
OBJECTIVE = ca.vertcat(1 - ca.sumsqr(x - ca.DM([0.3, -0.2])), 2 - x[0] ** 2 - x[1] ** 2)
LEVEL = ca.vertcat(ca.SX(1), x[0] - 0.5)


def toy(output: ca.SX) -> AffineForms:
    return AffineForms(ca.Function("toy", [x, ca.SX.sym("p"), ca.SX.sym("n")], [ca.densify(output)]), np.zeros((1, 1)))


class ToyBound:
    """Bounds the toy as cells are bounded; counts what it is asked."""

    def __init__(self, sharp: bool = True) -> None:
        self.objective, self.level, self.sharp, self.asked = toy(OBJECTIVE), toy(LEVEL), sharp, 0

    def __call__(self, lower: np.ndarray, upper: np.ndarray, mode: np.ndarray, enough: float) -> np.ndarray:
        self.asked += len(lower)
        given, found = np.zeros((len(lower), 1)), []
        objective, level = (forms(lower, upper, given) for forms in (self.objective, self.level))
        for i, m in enumerate(mode):
            f = Forms(objective.middle[m, i, 0], objective.slopes[:, m, i, 0], objective.error[m, i, 0])
            g = Forms(level.middle[m, i], level.slopes[:, m, i], level.error[m, i])
            bound = lagrange_bound(f, [g]) if self.sharp else float(f.upper)
            found.append(-np.inf if g.upper[0] < 0 else bound)
        return np.array(found)


def quiet(_: Tree) -> None:
    pass


@pytest.mark.parametrize(("modes", "optimum"), [(1, 1.0), (2, 1.75)])
def test_the_bound_comes_down_to_the_known_optimum_and_never_below(modes: int, optimum: float) -> None:
    for gap in (0.1, 1e-3, 1e-6):
        tree = explore(whole(BOX, modes), ToyBound(), optimum + gap, 100_000, quiet)
        assert not len(tree.bound)
        assert optimum <= tree.upper_bound <= optimum + gap


def test_multipliers_save_boxes_at_an_edge() -> None:
    plain, sharp = ToyBound(sharp=False), ToyBound()
    for bound in (plain, sharp):
        explore(whole(BOX, 2), bound, 1.75 + 1e-4, 100_000, quiet)
    assert sharp.asked < plain.asked


def test_out_of_boxes_the_bound_still_holds() -> None:
    tree = explore(whole(BOX, 2), ToyBound(), 1.75 + 1e-9, 100, quiet)
    assert len(tree.bound)
    assert tree.upper_bound >= 1.75
    assert explore(whole(BOX), ToyBound(), 1.0, 0, quiet).upper_bound == np.inf


def test_nothing_feasible_is_proven_too() -> None:
    tree = explore(whole(np.array([[-2.0, -2.0], [0.4, 2.0]]), 2), ToyBound(), 1.0 + 1e-3, 100_000, quiet)
    assert tree.upper_bound < 1.01  # all of mode 1 misses its level here, and what is left is mode 0


def test_parts_make_up_the_whole() -> None:
    lower, upper, mode = halves(np.array([[0.0, 0.0]]), np.array([[1.0, 3.0]]), np.array([7]))
    assert lower.tolist() == [[0.0, 0.0], [0.0, 1.5]]
    assert upper.tolist() == [[1.0, 1.5], [1.0, 3.0]]
    assert mode.tolist() == [7, 7]


def test_an_interrupted_search_ends_as_an_undisturbed_one(tmp_path: Path) -> None:
    path, target = tmp_path / "search.npz", 1.75 + 1e-5

    def interrupt(tree: Tree) -> None:
        save_tree(path, tree, "key")
        if tree.boxes > 60:
            raise KeyboardInterrupt

    undisturbed, bound = explore(whole(BOX, 2), ToyBound(), target, 100_000, quiet), ToyBound()
    with pytest.raises(KeyboardInterrupt):
        explore(whole(BOX, 2), bound, target, 100_000, interrupt)
    taken_up = load_tree(path, "key")
    assert taken_up is not None
    assert 0 < taken_up.boxes < undisturbed.boxes
    resumed = explore(taken_up, bound, target, 100_000, quiet)
    assert (resumed.upper_bound, resumed.boxes) == (undisturbed.upper_bound, undisturbed.boxes)
    assert bound.asked == undisturbed.boxes  # nothing was done twice


def test_a_search_of_something_else_or_a_broken_one_is_not_taken_up(tmp_path: Path) -> None:
    path = tmp_path / "search.npz"
    assert load_tree(path, "key") is None
    save_tree(path, whole(BOX), "key")
    assert load_tree(path, "key") is not None
    assert load_tree(path, "another") is None
    path.write_bytes(path.read_bytes()[:-80])
    assert load_tree(path, "key") is None
    assert [p.name for p in tmp_path.iterdir()] == ["search.npz"]


def test_lagrange_bound_holds_for_random_forms_at_random_places(rng: np.random.Generator) -> None:
    sharper = 0
    for _ in range(200):
        f = Forms(np.array(rng.normal()), rng.normal(size=3), np.array(0.1 * rng.random()))
        g = Forms(rng.normal(size=5) + 1, rng.normal(size=(3, 5)), 0.1 * rng.random(5))
        bound, t = lagrange_bound(f, [g]), rng.uniform(-1, 1, size=(2000, 3))
        kept = (g.middle + t @ g.slopes + g.error >= 0).all(axis=1)
        assert ((f.middle + t @ f.slopes + f.error)[kept] <= bound).all()
        sharper += bound < f.upper - 1e-9
    assert sharper > 20


def test_levels_nothing_is_known_of_are_left_out() -> None:
    f = Forms(np.array(1.0), np.array([1.0]), np.array(0.0))
    g = Forms(np.array([np.nan, 0.0]), np.array([[np.nan, -1.0]]), np.array([np.inf, 0.0]))
    assert lagrange_bound(f, [g]) == pytest.approx(1.0)
    assert lagrange_bound(Forms(f.middle, f.slopes, np.array(np.nan)), [g]) == np.inf


def test_dense_parameters_keep_the_seam_s_own() -> None:
    closed, own = dense_parameters(np.arange(4) / 4, True, 2)
    assert closed.tolist() == [i / 8 for i in range(8)]
    assert closed[own].tolist() == [0.0, 0.25, 0.5, 0.75]
    opened, own = dense_parameters(np.linspace(0, 1, 3), False, 4)
    assert opened.tolist() == [i / 8 for i in range(9)]
    assert opened[own].tolist() == [0.0, 0.5, 1.0]
