"""Stage graphs as Numba kernels (the ``fast`` extra): one straight line of scalars per lane, which LLVM vectorises.

The source comes from the same instruction list as the NumPy form. It is written to a folder of its own, named by its
content, so that Numba caches the compiled kernel on disk and a second process starts warm.
"""

import hashlib
import importlib.util
import os
import sys
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.engine.lanes import ARITHMETIC, Kernel, Kinds, Lanes, lane_shape
from nlpweld.errors import OutputError
from nlpweld.plan import write_text

PATTERNS = {
    **ARITHMETIC,
    ca.OP_FMIN: "min({0}, {1})",
    ca.OP_FMAX: "max({0}, {1})",
    ca.OP_LT: "1.0 * ({0} < {1})",
    ca.OP_LE: "1.0 * ({0} <= {1})",
    ca.OP_IF_ELSE_ZERO: "({1} if {0} != 0.0 else 0.0)",
    ca.OP_FABS: "abs({0})",
    ca.OP_NOT: "1.0 * ({0} == 0.0)",
    ca.OP_SIN: "sin({0})",
    ca.OP_COS: "cos({0})",
    ca.OP_POW: "{0} ** {1}",
    ca.OP_CONSTPOW: "{0} ** {1}",
}
HEAD = "from math import cos, sin, sqrt\n\nimport numba\n\n\n"
JIT = "@numba.njit(error_model='numpy', cache=True)\n"
# for what only other compiled functions call: without wrappers it compiles in half the time
INNER = "@numba.njit(error_model='numpy', no_cpython_wrapper=True, no_cfunc_wrapper=True)\n"


def numba_kernel(function: ca.Function, kinds: Kinds) -> Kernel:
    """Return a kernel that Numba compiles on first use for a number of points, or loads from its cache."""
    sizes = [function.nnz_out(i) for i in range(function.n_out())]
    compiled: dict[int, Any] = {}

    def kernel(*inputs: Any) -> tuple[Lanes, ...]:
        m, n = lane_shape(kinds, inputs)
        if n not in compiled:
            compiled[n] = load(source(function, kinds, n)).kernel
        outputs = [np.empty((m, size, n)) for size in sizes]
        given = [_flat(each, kind) for each, kind in zip(inputs, kinds, strict=True)]
        compiled[n](m, *given, *(out.reshape(-1) for out in outputs))
        return tuple(out.transpose(1, 0, 2) for out in outputs)

    return kernel


def _flat(given: Any, kind: str) -> np.ndarray:
    """Return an input as one row of numbers; lanes candidate by candidate, as kernels write them."""
    if kind == "lane":
        given = (given if isinstance(given, np.ndarray) else np.stack(given)).transpose(1, 0, 2)
    return np.ascontiguousarray(given, dtype=float).reshape(-1)


def source(function: ca.Function, kinds: Kinds, n: int) -> str:
    """Return the source text of a module with the kernel for n seam points."""
    return HEAD + JIT + kernel_source(function, kinds, n, "kernel")


def kernel_source(function: ca.Function, kinds: Kinds, n: int, called: str) -> str:
    """Return the source text of a kernel for n seam points, a function of the number of candidates and flat arrays.

    Everything a candidate reads and writes is one slice with the number of points as a literal: offsets known when
    compiling let LLVM see that nothing overlaps, without which it does not vectorise a loop with many outputs.
    """
    names = [f"i{k}" for k in range(function.n_in())]
    outs = [function.nnz_out(k) * n for k in range(function.n_out())]
    lines = [
        f"def {called}(m, {', '.join(names + [f'o{k}' for k in range(len(outs))])}):",
        "    for i in range(m):",
        *(f"        o{k}_ = o{k}[i * {size} : (i + 1) * {size}]" for k, size in enumerate(outs)),
    ]
    for k, (name, kind) in enumerate(zip(names, kinds, strict=True)):
        size = function.nnz_in(k)
        if kind == "lane":
            lines.append(f"        {name}_ = {name}[i * {size * n} : (i + 1) * {size * n}]")
        elif kind != "point":
            first = f"i * {size} + " if kind == "candidate" else ""
            lines += [f"        {name}_{j} = {name}[{first}{j}]" for j in range(size)]
    lines.append(f"        for j in range({n}):")
    lines += [f"            {line}" for line in _body(function, kinds, n)]
    return "\n".join(lines) + "\n"


def _body(f: ca.Function, kinds: Kinds, n: int) -> list[str]:
    """Return the instructions as assignments to names used once, in the order of the list."""
    read = {"candidate": "i{0}_{1}", "number": "i{0}_{1}", "point": "i{0}[j + {2}]", "lane": "i{0}_[j + {2}]"}
    held: dict[int, str] = {}
    lines = []
    for k in range(f.n_instructions()):
        op, ins, outs = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if op == ca.OP_CONST:
            held[outs[0]] = f"({f.instruction_constant(k)!r})"
        elif op == ca.OP_INPUT:
            held[outs[0]] = read[kinds[ins[0]]].format(ins[0], ins[1], ins[1] * n)
        elif op == ca.OP_OUTPUT:
            lines.append(f"o{outs[0]}_[j + {outs[1] * n}] = {held[ins[0]]}")
        else:
            pattern = PATTERNS.get(op)
            if pattern is None:
                raise ValueError(f"{f.name()}: CasADi operation {op} has no Numba form; add it to the table above")
            lines.append(f"t{k} = " + pattern.format(*(held[i] for i in ins)))
            held[outs[0]] = f"t{k}"
    return lines


def cache_folder() -> Path:
    """Return where generated sources and compiled kernels live: ``NLPWELD_CACHE``, or below the user's cache."""
    chosen = os.environ.get("NLPWELD_CACHE")
    base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return Path(chosen) if chosen else base / "nlpweld"


def load(text: str) -> Any:
    """Return the module of a source text, written to the cache folder first if it is not there.

    Raises:
        OutputError: the folder cannot be written; names it and the variable that moves it.
    """
    name = "nlpweld_kernel_" + hashlib.sha256(text.encode()).hexdigest()[:16]
    if name in sys.modules:
        return sys.modules[name]
    path = cache_folder() / f"{name}.py"
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        try:
            write_text(path, text)
        except OutputError as error:
            raise OutputError(f"{error} or set NLPWELD_CACHE to a folder that can be written") from None
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
