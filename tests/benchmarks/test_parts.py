"""The graphs of single parts compute what the naive functions compute."""

import numpy as np
import pytest

from benchmarks import graphs, naive
from benchmarks.parts import samples
from benchmarks.peak import instructions
from nlpweld.cell import Cell


@pytest.fixture(scope="module")
def here(cell: Cell):
    return samples(cell)


def test_jacobian_graph_is_the_naive_jacobian(cell: Cell, here) -> None:
    graph, arm = graphs.jacobian_graph(cell.stations[0]), here.arms[0]
    for q in here.q[0][::9]:
        theta = q + np.array(arm.dh)[:, 3]
        out = np.array(graph(np.hstack([np.cos(theta), np.sin(theta)]))).ravel()
        J = naive.jacobian(naive.links(arm, q))
        assert pytest.approx(naive.links(arm, q)[-1][:3], abs=1e-12) == out[:12].reshape(4, 3).T
        assert np.vstack([out[12:30].reshape(6, 3).T, out[30:48].reshape(6, 3).T]) == pytest.approx(J, abs=1e-12)
        assert out[48] == pytest.approx(abs(np.linalg.det(J)), rel=1e-9)


def test_inverse_graph_gives_the_naive_joints_on_every_branch(cell: Cell, here) -> None:
    graph, arm = graphs.inverse_graph(cell.stations[0]), here.arms[0]
    for T in here.poses[::9]:
        out = np.array(graph(np.hstack([T[:3, :3].T.ravel(), T[:3, 3]]))).reshape(4, 13)
        for row, branch in zip(out, naive.BRANCHES[::2], strict=True):
            q = naive.inverse(arm.dh, T, *branch)
            assert (q is None) == (row[12] < 0)
            if q is not None:
                theta = q + np.array(arm.dh)[:, 3]
                assert row[:12] == pytest.approx(np.hstack([np.cos(theta), np.sin(theta)]), abs=1e-9)


@pytest.mark.parametrize("branch", naive.BRANCHES)
def test_naive_inverse_puts_the_flange_where_it_was_asked(here, branch: tuple[int, int, int]) -> None:
    arm, reached = here.arms[0], 0
    for T in here.poses[::9]:
        q = naive.inverse(arm.dh, T, *branch)
        if q is not None:
            reached += 1
            assert arm.T_B_W @ naive.links(arm, q)[6] == pytest.approx(T, abs=1e-9)
    assert reached or branch[0] == -1


def test_clearance_graphs_give_fcls_least_distance(cell: Cell, here) -> None:
    loop, work = naive.Naive(cell), graphs.clearance_graphs(cell, naive.body_lengths(cell))
    outs = [np.array(graph(graphs.clearance_sources(here.ends, bodies))).ravel() for graph, bodies in work]
    assert np.min(outs, axis=0) == pytest.approx([loop.least_distance(ends) for ends in here.ends], abs=1e-6)


def test_inputs_outputs_and_constants_are_not_counted_as_instructions() -> None:
    import casadi as ca

    x = ca.SX.sym("x")
    assert instructions(ca.Function("f", [x], [2.5 * x + 1])) == 2
