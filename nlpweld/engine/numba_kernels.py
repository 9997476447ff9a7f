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
}
HEAD = "from math import sqrt\n\nimport numba\n\n\n"


def numba_kernel(function: ca.Function, kinds: Kinds) -> Kernel:
    """Return a kernel compiled by Numba on first use, or loaded from its cache."""
    compiled = load(source(function, kinds)).kernel
    sizes = [function.nnz_out(i) for i in range(function.n_out())]
    ends = np.cumsum(sizes)

    def kernel(*inputs: Any) -> tuple[Lanes, ...]:
        m, n = lane_shape(kinds, inputs)
        out = np.empty((int(ends[-1]), m, n))
        compiled(*(_array(given) for given in inputs), out)
        return tuple(out[end - size : end] for size, end in zip(sizes, ends, strict=True))

    return kernel


def _array(given: Any) -> np.ndarray:
    return np.ascontiguousarray(given if isinstance(given, np.ndarray) else np.stack(given), dtype=float)


def source(function: ca.Function, kinds: Kinds) -> str:
    """Return the source text of a module with the kernel.

    Rows of inputs and outputs are taken out of the inner loop, which then runs over slices.
    """
    names = [f"i{k}" for k in range(function.n_in())]
    lines = [
        "@numba.njit(error_model='numpy', cache=True)",
        f"def kernel({', '.join(names)}, out):",
        "    for i in range(out.shape[1]):",
    ]
    row = {"candidate": "{0}[i, {1}]", "point": "{0}[{1}]", "lane": "{0}[{1}, i]", "number": "{0}[{1}]"}
    for k, (name, kind) in enumerate(zip(names, kinds, strict=True)):
        lines += [f"        {name}_{j} = {row[kind].format(name, j)}" for j in range(function.nnz_in(k))]
    count = sum(function.nnz_out(k) for k in range(function.n_out()))
    lines += [f"        o{j} = out[{j}, i]" for j in range(count)]
    lines.append("        for j in range(out.shape[2]):")
    lines += [f"            {line}" for line in _body(function, kinds)]
    return HEAD + "\n".join(lines) + "\n"


def _body(f: ca.Function, kinds: Kinds) -> list[str]:
    """Return the instructions as assignments to names used once, in the order of the list."""
    first = np.concatenate([[0], np.cumsum([f.nnz_out(k) for k in range(f.n_out())])])
    held: dict[int, str] = {}
    lines = []
    for k in range(f.n_instructions()):
        op, ins, outs = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if op == ca.OP_CONST:
            held[outs[0]] = f"({f.instruction_constant(k)!r})"
        elif op == ca.OP_INPUT:
            held[outs[0]] = f"i{ins[0]}_{ins[1]}" + ("[j]" if kinds[ins[0]] in ("point", "lane") else "")
        elif op == ca.OP_OUTPUT:
            lines.append(f"o{first[outs[0]] + outs[1]}[j] = {held[ins[0]]}")
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
