"""A CasADi SX function lowered to NumPy source: the same instruction list, each instruction over whole arrays."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.engine.lanes import ARITHMETIC, Kernel, Kinds, Lanes, lane_shape

PATTERNS = {
    **ARITHMETIC,
    ca.OP_FMIN: "minimum({0}, {1})",
    ca.OP_FMAX: "maximum({0}, {1})",
    ca.OP_LT: "({0} < {1}) * 1.0",
    ca.OP_LE: "({0} <= {1}) * 1.0",
    ca.OP_EQ: "({0} == {1}) * 1.0",
    ca.OP_NE: "({0} != {1}) * 1.0",
    ca.OP_IF_ELSE_ZERO: "where({0} != 0, {1}, 0.0)",
    ca.OP_POW: "{0} ** {1}",
    ca.OP_CONSTPOW: "{0} ** {1}",
    ca.OP_ATAN2: "arctan2({0}, {1})",
    ca.OP_FABS: "absolute({0})",
    ca.OP_NOT: "({0} == 0) * 1.0",
    ca.OP_SIN: "sin({0})",
    ca.OP_COS: "cos({0})",
    ca.OP_EXP: "exp({0})",
    ca.OP_LOG: "log({0})",
    ca.OP_LOG1P: "log1p({0})",
    ca.OP_SIGN: "sign({0})",
}
FUNCTIONS = ("minimum", "maximum", "where", "sqrt", "absolute", "arctan2", "sin", "cos", "exp", "log", "log1p", "sign")
NAMES = {name: getattr(np, name) for name in (*FUNCTIONS, "inf", "nan")}
Lowered = Callable[..., tuple[list[Any], ...]]


def lower(function: ca.Function) -> Lowered:
    """Return a Python function that does what an SX function does, over arrays.

    Args:
        function: a CasADi function built of SX.

    Returns:
        A callable that takes one sequence per input, holding a number or array for each nonzero of that input
        in CasADi's (column by column) order, and returns one list per output. Arrays broadcast against each
        other, so that what depends on few things is computed few times.

    Raises:
        ValueError: an operation of the function has no NumPy form here.
    """
    namespace = dict(NAMES)
    exec(compile(source(function), f"<lowered {function.name()}>", "exec"), namespace)  # our own graph, not input
    return namespace["lowered"]


def source(function: ca.Function) -> str:
    """Return the source text of the lowered function."""
    f = function.expand() if not function.is_a("SXFunction") else function
    lines = [f"def lowered({', '.join(f'i{k}' for k in range(f.n_in()))}):"]
    for k in range(f.n_out()):
        lines.append(f"    o{k} = [0.0] * {f.nnz_out(k)}")
    lines += [f"    {_instruction(f, k)}" for k in range(f.n_instructions())]
    lines.append(f"    return ({''.join(f'o{k}, ' for k in range(f.n_out()))})")
    return "\n".join(lines) + "\n"


def _instruction(f: ca.Function, k: int) -> str:
    op, ins, outs = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
    if op == ca.OP_CONST:
        return f"w{outs[0]} = {f.instruction_constant(k)!r}"
    if op == ca.OP_INPUT:
        return f"w{outs[0]} = i{ins[0]}[{ins[1]}]"
    if op == ca.OP_OUTPUT:
        return f"o{outs[0]}[{outs[1]}] = w{ins[0]}"
    pattern = PATTERNS.get(op)
    if pattern is None:
        raise ValueError(f"{f.name()}: CasADi operation {op} has no NumPy form; add it to the table above")
    return f"w{outs[0]} = " + pattern.format(*(f"w{i}" for i in ins))


def numpy_kernel(function: ca.Function, kinds: Kinds) -> Kernel:
    """Return a kernel in NumPy; what depends only on points or candidates is computed once for each."""
    lowered = lower(function)

    def kernel(*inputs: Any) -> tuple[Lanes, ...]:
        shape = lane_shape(kinds, inputs)
        outputs = lowered(*(SHAPED[kind](given) for kind, given in zip(kinds, inputs, strict=True)))
        return tuple([_whole(value, shape) for value in output] for output in outputs)

    return kernel


def _whole(value: Any, shape: tuple[int, int]) -> np.ndarray:
    """Return an output over all lanes; most are, and numpy.broadcast_to takes its time to find out."""
    return value if np.shape(value) == shape else np.broadcast_to(value, shape)


SHAPED: dict[str, Callable[[Any], Any]] = {
    "candidate": lambda X: [column[:, None] for column in X.T],
    "point": lambda D: [row[None, :] for row in D],
    "lane": lambda lanes: lanes,
    "number": lambda numbers: [float(n) for n in numbers],
}
