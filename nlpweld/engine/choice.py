"""Which engine runs the graphs: NumPy always, Numba where the ``fast`` extra is installed."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import casadi as ca

from nlpweld.engine.lanes import Kernel, Kinds
from nlpweld.engine.numpy_kernels import numpy_kernel
from nlpweld.errors import OptionError

ENGINES = ("auto", "numpy", "numba")


@dataclass(frozen=True)
class Engine:
    """A way to evaluate.

    Attributes:
        kernel: turns a function and the kinds of its inputs into a kernel over lanes.
        block: lanes (candidates times points) taken at once; NumPy's calls cost much, so it gathers the few
            candidates that pass from many.
        chunk: lanes in one call, whose arrays fit the cache together.
        jets: whether Numba is there to differentiate by jets.
    """

    kernel: Callable[[ca.Function, Kinds], Kernel]
    block: int
    chunk: int
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
        return Engine(numpy_kernel, block=75_000, chunk=2_400, jets=False)
    from nlpweld.engine.numba_kernels import numba_kernel

    return Engine(numba_kernel, block=9_600, chunk=9_600, jets=True)
