"""Rigorous linear enclosures of a stage graph over boxes of its variables: its instruction list run on affine forms.

For every box and seam point each output comes out as ``c + a . t`` to within r, t in [-1, 1]^d from the middle of the
box to its sides. That holds for the graph's real-number value at every place of the box, its constants and the seam
point's data taken as the floating-point numbers they are, whatever rounding does here. The machine
(:mod:`~.affine_steps`) is the same text in NumPy and, with the ``fast`` extra, compiled by Numba.
"""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from nlpweld.engine import affine_steps
from nlpweld.engine.numba_kernels import INNER, JIT, load
from nlpweld.engine.tape import BINARY, CONST, INPUT, OUTPUT, UNARY, numbers, tape

EPS = affine_steps.EPS
ROWS = 3  # of a form, before its slopes
SCRATCH = 6  # rows a step may use
WITHOUT = ("EXP", "LOG1P", "POW", "CONSTPOW")
NUMPY_LANES = 2_000  # taken at once, so that the forms of a pass fit the cache
NUMBA_LANES = 72  # the usual number of seam points leaves none idle
OWN = [f for _, f in inspect.getmembers(affine_steps, inspect.isfunction) if f.__module__ == affine_steps.__name__]
STEPS = tuple(sorted(OWN, key=lambda f: f.__code__.co_firstlineno))


@dataclass(frozen=True, eq=False)
class Forms:
    """Linear enclosures over boxes: ``middle + slopes . t`` to within ``error`` for t in [-1, 1]^d.

    A form that knows nothing has an infinite or NaN error.

    Attributes:
        middle: any shape S.
        slopes: shape (d, *S).
        error: shape S.
    """

    middle: np.ndarray
    slopes: np.ndarray
    error: np.ndarray

    @property
    def radius(self) -> np.ndarray:
        """How far from its middle the number may be, moved outwards beyond rounding; infinite where unknown."""
        total = self.error + np.abs(self.slopes).sum(axis=0)
        total = total + EPS * (total + np.abs(self.middle))
        return np.where(np.isfinite(total), total, np.inf)

    @property
    def upper(self) -> np.ndarray:
        """What no number enclosed is above."""
        radius = self.radius
        return np.where(np.isfinite(radius), self.middle + radius, np.inf)

    @property
    def lower(self) -> np.ndarray:
        """What no number enclosed is below."""
        radius = self.radius
        return np.where(np.isfinite(radius), self.middle - radius, -np.inf)

    def mean(self) -> "Forms":
        """Return forms of the mean over the last axis."""
        n = self.middle.shape[-1]
        size = np.abs(self.middle).sum(axis=-1) + np.abs(self.slopes).sum(axis=(0, -1)) + self.error.sum(axis=-1)
        # n additions err by less than n * 2**-53 of the sizes' sum
        error = self.error.mean(axis=-1) + EPS * (1 + n / 64) * size
        return Forms(self.middle.mean(axis=-1), self.slopes.mean(axis=-1), error)


@dataclass(frozen=True)
class Whole:
    """All lanes of a row at once: added to where the row begins, it is the slice of the row.

    Attributes:
        lanes: how many there are.
    """

    lanes: int

    def __radd__(self, start: int) -> slice:
        """Return the slice of a row that begins at start."""
        return slice(start, start + self.lanes)


def _names(lanes: int) -> dict[str, int]:
    """Return the numbers the machine's text uses by name."""
    operations = {name: number for number, name in {**numbers(BINARY), **numbers(UNARY)}.items()}
    multiples = {"W": lanes, **{f"W{k}": k * lanes for k in (2, 3, 4)}, "THREE": ROWS}
    return {**operations, **multiples, "INPUT": INPUT, "OUTPUT": OUTPUT}


def _text() -> str:
    """Return the source of the constants every step uses."""
    return (
        "from numpy import cos, inf, maximum, nan, sin, sqrt\n\n"
        f"EPS, TINY = {affine_steps.EPS!r}, {affine_steps.TINY!r}\n"
    )


def numpy_machine(lanes: int) -> Callable[..., None]:
    """Return the machine in NumPy, for a number of lanes."""
    namespace: dict[str, Any] = {**_names(lanes), "each": lambda _: (Whole(lanes),), "pick": np.where}
    text = "\n\n".join([_text(), *(inspect.getsource(step) for step in STEPS)])
    exec(compile(text, "<affine machine>", "exec"), namespace)  # our own text, not input
    run = namespace["run"]

    def quiet(code: np.ndarray, slopes: np.ndarray, *rest: Any) -> None:
        with np.errstate(all="ignore"):  # what is not known is infinite or NaN, and said so in the end
            run(code.astype(object), slopes.astype(object), *map(_plain, rest))

    return quiet


def _plain(value: Any) -> Any:
    return int(value) if isinstance(value, np.integer) else value


def numba_machine(lanes: int) -> Callable[..., None]:
    """Return the machine compiled by Numba, for a number of lanes."""
    sized = ("W", "W2", "W3", "W4", "THREE")
    head = [_text(), "import numba", "import numpy as np", ""]
    head += [f"{name} = {f'np.uint64({n})' if name in sized else n}" for name, n in _names(lanes).items()]
    pick = "def pick(condition, yes, no):\n    return yes if condition else no\n"
    parts = ["\n".join(head), INNER + pick]
    for step in STEPS:
        source = inspect.getsource(step).replace("in each(W)", "in range(W)")
        parts.append((JIT if step is affine_steps.run else INNER) + source)
    return load("\n\n".join(parts)).run


class AffineForms:
    """Encloses the outputs of an SX function ``f(x, data, numbers)`` over boxes of x, at every seam point."""

    def __init__(self, f: ca.Function, points: np.ndarray, engine: str = "numpy") -> None:
        """Lower a function for a machine.

        Args:
            f: an SX function of d variables, a seam point's data, and numbers that differ from box to box, with dense
                outputs.
            points: the data of every seam point, shape (k, N).
            engine: ``numba`` or ``numpy``.

        Raises:
            ValueError: the function has an operation without affine form.
        """
        self.d, self.points = f.nnz_in(0), np.asarray(points, dtype=float)
        self.outputs = sum(f.nnz_out(i) for i in range(f.n_out()))
        rows, n = ROWS + self.d, self.points.shape[1]
        self.lanes = NUMBA_LANES if engine == "numba" else max(1, NUMPY_LANES // n) * n
        self._run = (numba_machine if engine == "numba" else numpy_machine)(self.lanes)
        self._given = sum(f.nnz_in(i) for i in range(f.n_in()))
        program = tape(f)
        without = numbers(WITHOUT)
        for op in program.code[:, 0].tolist():
            if op in without:
                raise ValueError(f"{f.name()}: CasADi operation {without[op]} has no affine form")
        code, active = program.code.copy(), program.active.copy()
        constants = np.flatnonzero(code[:, 0] == CONST)
        code[constants, 0], code[constants, 2] = INPUT, self._given + np.arange(len(constants))
        code[:, 1:] *= rows * self.lanes
        self._code, self._slopes = code.astype(np.uint64), (active * self.d).astype(np.uint64)
        self._inputs = np.zeros((self._given + len(constants), rows, self.lanes))
        self._inputs[self._given :, 0] = program.constants[constants, None]
        registers = program.registers * rows * self.lanes
        self._inverse = np.uint64(registers)
        self._spare = np.uint64(registers + rows * self.lanes)
        self._work = np.zeros(registers + (rows + SCRATCH) * self.lanes)

    def __call__(self, lower: np.ndarray, upper: np.ndarray, given: np.ndarray) -> Forms:
        """Return forms of shape (outputs, m, N) over boxes.

        Args:
            lower: lower corners, shape (m, d).
            upper: upper corners, shape (m, d).
            given: the numbers of every box, shape (m, g).
        """
        middle, half = middles(lower, upper)
        m, n, d = len(lower), self.points.shape[1], self.d
        out = np.zeros((self.outputs, ROWS + d, -(-m * n // self.lanes), self.lanes))
        found = np.zeros((self.outputs, ROWS + d, self.lanes))
        flat = found.reshape(-1)
        for k in range(out.shape[2]):
            lane = np.minimum(np.arange(k * self.lanes, (k + 1) * self.lanes), m * n - 1)
            box, point = lane // n, lane % n
            self._inputs[:d, 0], self._inputs[:d, 2] = middle[box].T, half[box].T
            self._inputs[range(d), range(ROWS, ROWS + d)] = half[box].T
            self._inputs[d : d + len(self.points), 0] = self.points[:, point]
            self._inputs[d + len(self.points) : self._given, 0] = given[box].T
            self._run(self._code, self._slopes, self._inputs.reshape(-1), self._work, self._spare, self._inverse, flat)
            out[:, :, k] = found
        whole = out.reshape(self.outputs, ROWS + d, -1)[:, :, : m * n].reshape(self.outputs, ROWS + d, m, n)
        return Forms(whole[:, 0], whole[:, ROWS:].swapaxes(0, 1), whole[:, 1])


def middles(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return middles of boxes and half widths that reach both sides whatever rounding did to the middles."""
    middle = 0.5 * (lower + upper)
    half = np.maximum(upper - middle, middle - lower)
    return middle, np.nextafter(half, np.inf)


def chunks(count: int, size: int) -> Iterator[slice]:
    """Yield slices that cover a count."""
    return (slice(start, min(start + size, count)) for start in range(0, count, size))
