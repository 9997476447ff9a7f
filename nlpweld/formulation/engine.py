"""Ways to evaluate a stage graph over many candidates and seam points at once.

Inputs come in four kinds: ``candidate`` (m, n) differs from candidate to candidate, ``point`` (n, N) from seam point
to seam point, ``lane`` (n arrays of (m, N)) from both, and ``number`` (n,) from none. Outputs are lanes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.errors import OptionError
from nlpweld.formulation.lower import lower

ENGINES = ("auto", "numpy", "numba")
Lanes = Sequence[np.ndarray] | np.ndarray
Kernel = Callable[..., tuple[Lanes, ...]]


@dataclass(frozen=True)
class Engine:
    """A way to evaluate.

    Attributes:
        kernel: turns a function and the kinds of its inputs into a kernel over lanes.
        jets: whether Numba is there to differentiate by jets.
        block: candidates taken at once; NumPy's calls cost much, so it gathers the few that pass from many.
    """

    kernel: Callable[[ca.Function, tuple[str, ...]], Kernel]
    block: int
    jets: bool


def engine(name: str) -> Engine:
    """Return an engine by name; ``auto`` takes Numba where it is installed.

    Raises:
        OptionError: no such engine, or Numba is not installed.
    """
    if name not in ENGINES:
        raise OptionError(f"engine '{name}' is unknown; there are: {', '.join(ENGINES)}")
    installed = find_spec("numba") is not None
    if name == "numba" and not installed:
        raise OptionError("engine 'numba' is not installed; bring it with: pip install 'nlpweld[fast]'")
    if name == "numpy" or not installed:
        return Engine(numpy_kernel, 1024, jets=False)
    from nlpweld.formulation.numba_engine import numba_kernel

    return Engine(numba_kernel, 64, jets=True)


def numpy_kernel(function: ca.Function, kinds: tuple[str, ...]) -> Kernel:
    """Return a kernel in NumPy; what depends only on points or candidates is computed once for each."""
    lowered = lower(function)

    def kernel(*inputs: Any) -> tuple[Lanes, ...]:
        shape = lane_shape(kinds, inputs)
        outputs = lowered(*(SHAPED[kind](given) for kind, given in zip(kinds, inputs, strict=True)))
        return tuple([np.broadcast_to(value, shape) for value in output] for output in outputs)

    return kernel


def lane_shape(kinds: tuple[str, ...], inputs: tuple[Any, ...]) -> tuple[int, int]:
    """Return the number of candidates and of points that inputs of some kinds are about."""
    sizes = {}
    for kind, given in zip(kinds, inputs, strict=True):
        if kind == "lane":
            return given[0].shape
        sizes[kind] = len(given) if kind == "candidate" else given.shape[-1]
    return sizes["candidate"], sizes["point"]


SHAPED: dict[str, Callable[[Any], Any]] = {
    "candidate": lambda X: [column[:, None] for column in X.T],
    "point": lambda D: [row[None, :] for row in D],
    "lane": lambda lanes: lanes,
    "number": lambda numbers: [float(n) for n in numbers],
}


def rows(lanes: Lanes, which: Any) -> Lanes:
    """Return some candidates of lanes, by slice, index or mask."""
    return lanes[:, which] if isinstance(lanes, np.ndarray) else [lane[which] for lane in lanes]
