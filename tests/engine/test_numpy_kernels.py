"""Graphs lowered to NumPy do what CasADi does."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.cell import Cell
from nlpweld.engine.numpy_kernels import PATTERNS, lower
from nlpweld.formulation.batch import Batch
from nlpweld.formulation.coupling import point_data
from nlpweld.formulation.stage import Stage
from nlpweld.geometry.capsules import segment_distance

Inputs = list[np.ndarray]


def largest_difference(function: ca.Function, inputs: Inputs) -> float:
    """Return the largest difference between lowered and original, relative to values above one.

    Args:
        function: an SX function.
        inputs: for each of its inputs one row of nonzeros per case, shape (m, nnz).
    """
    m, worst = len(inputs[0]), 0.0
    got = lower(function)(*[list(values.T) for values in inputs])
    for i in range(m):
        given = [ca.DM(function.sparsity_in(k), values[i]) for k, values in enumerate(inputs)]
        for k, expected in enumerate(function.call(given)):
            numbers = np.array(expected.nonzeros())
            mine = np.array([np.broadcast_to(value, (m,))[i] for value in got[k]])
            assert np.isfinite(numbers).all()
            worst = max(worst, float(np.max(np.abs(mine - numbers) / np.maximum(1.0, np.abs(numbers)))))
    return worst


def stage_inputs(cell: Cell, rng: np.random.Generator) -> Inputs:
    """Return placements (a third of them out of reach), seam points and branches, 60 of each."""
    x = rng.uniform(*cell.box, (60, 3))
    x[::3] += rng.choice([-4.0, 4.0], (20, 3))
    return [x, point_data(cell, rng.random(60)).T, rng.choice([-1.0, 1.0], (60, 3))]


@pytest.mark.parametrize("k", range(3))
def test_lowered_arm_agrees_with_its_graph_within_and_out_of_reach(
    batch: Batch, rng: np.random.Generator, k: int
) -> None:
    inputs = stage_inputs(batch.cell, rng)
    reach = [float(batch.stage.arms[k](*[values[i] for values in inputs])[3]) for i in range(60)]
    assert min(reach) < 0.0 < max(reach)
    assert largest_difference(batch.stage.arms[k], inputs) < 1e-12


@pytest.mark.parametrize("pair", [(0, 1), (0, 2), (1, 2)])
def test_lowered_meeting_agrees_with_its_graph(batch: Batch, rng: np.random.Generator, pair: tuple[int, int]) -> None:
    meeting = batch.stage.meetings[pair]
    inputs = [rng.uniform(-1, 1, (60, meeting.nnz_in(side))) for side in (0, 1)]
    assert largest_difference(meeting, inputs) < 1e-12


def test_lowered_workpiece_agrees_with_its_graph(batch: Batch, rng: np.random.Generator) -> None:
    inputs = stage_inputs(batch.cell, rng)[:2]
    assert largest_difference(batch.stage.work, inputs) < 1e-12


def test_lowered_distance_of_two_bodies_without_length_is_that_of_their_points() -> None:
    ends = [ca.SX.sym(name, 3) for name in ("a0", "a1", "b0", "b1")]
    lowered = lower(ca.Function("d", ends, [segment_distance(*ends, 0.0, 0.0)]))
    here, there = [np.zeros(2)] * 3, [np.full(2, 3.0), np.full(2, 4.0), np.zeros(2)]
    ((distance,),) = lowered(here, here, there, there)
    assert distance == pytest.approx([5.0, 5.0], abs=2e-7)


def test_three_stations_meet_each_other_and_the_workpiece(cell: Cell) -> None:
    assert list(Stage(cell).meetings) == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]


# Numbers that settle every comparison, sign and logic; the logarithm, root and power take the positive ones.
POSITIVE = np.array([[0.3, 0.3], [1.0, 2.0], [2.5, 0.7], [1.0, 1.0]])
MIXED = np.array([[-1.5, 2.0], [2.0, -1.5], [1.0, 1.0], [-0.5, -0.5]])
NEED_POSITIVE = {ca.OP_LOG, ca.OP_LOG1P, ca.OP_SQRT, ca.OP_POW, ca.OP_CONSTPOW}


def one_operation(op: int) -> ca.Function:
    """Return a function of two numbers that is one operation of the table."""
    x = ca.SX.sym("x", 2)
    if op == ca.OP_CONSTPOW:
        value = x[0] ** 2.7
    elif op == ca.OP_IF_ELSE_ZERO:
        value = ca.if_else(x[0] < x[1], x[1], 0)
    elif op == ca.OP_ASSIGN:
        value = x[0]
    else:
        two = "{1}" in PATTERNS[op]
        value = ca.SX.binary(op, x[0], x[1]) if two else ca.SX.unary(op, x[0] - 1 if op == ca.OP_NOT else x[0])
    return ca.Function(f"op_{op}", [x], [value])


@pytest.mark.parametrize("op", PATTERNS)
def test_every_operation_of_the_tables_does_what_casadi_does(op: int) -> None:
    function = one_operation(op)
    used = {function.instruction_id(k) for k in range(function.n_instructions())}
    assert op in used or op == ca.OP_ASSIGN  # CasADi drops assignments when it builds a function
    assert largest_difference(function, [POSITIVE if op in NEED_POSITIVE else MIXED]) < 1e-15


def test_operation_without_a_numpy_form_is_refused_by_number() -> None:
    x = ca.SX.sym("x")
    with pytest.raises(ValueError, match=rf"^f: CasADi operation {ca.OP_TAN} has no NumPy form"):
        lower(ca.Function("f", [x], [ca.tan(x)]))


@pytest.mark.parametrize("constant", [np.inf, -np.inf, 1e-300, -0.1])
def test_constants_survive_lowering_to_the_last_bit(constant: float) -> None:
    x = ca.SX.sym("x")
    assert lower(ca.Function("f", [x], [constant, x]))([1.0]) == ([constant], [1.0])


def test_nan_constant_survives_lowering() -> None:
    x = ca.SX.sym("x")
    ((value,),) = lower(ca.Function("f", [x], [np.nan]))([1.0])
    assert np.isnan(value)


def test_entries_that_are_structurally_zero_are_left_out() -> None:
    x = ca.SX.sym("x", 2)
    ((first, second),) = lower(ca.Function("f", [x], [ca.diag(x)]))([3.0, 4.0])
    assert (first, second) == (3.0, 4.0)


def test_graph_of_mx_is_lowered_through_its_expansion() -> None:
    x = ca.MX.sym("x", 2)
    assert lower(ca.Function("f", [x], [ca.sumsqr(x)]))([3.0, 4.0]) == ([25.0],)


def test_inputs_of_different_shape_broadcast() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    rows, columns = np.arange(3.0)[:, None], np.arange(4.0)[None, :]
    ((got,),) = lower(ca.Function("f", [x, y], [x * y + 1]))([rows], [columns])
    assert (got == rows * columns + 1).all()
