"""How many double multiply-adds a second one core does: the bound that instruction counts are held to."""

import time
from collections.abc import Callable
from importlib.util import find_spec

import casadi as ca
import numpy as np

LANES, STEPS, CHAINS = 256, 64, 10
MOVES = (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST)


def instructions(function: ca.Function) -> int:
    """Return the arithmetic instructions of an SX function; inputs, outputs and constants are not counted."""
    return sum(function.instruction_id(k) not in MOVES for k in range(function.n_instructions()))


def peak_per_s(seconds: float = 0.5) -> tuple[float, str]:
    """Return multiply-adds a second, each counted as one instruction per lane, and how it was measured.

    Straight-line Horner chains over arrays in the first-level cache, best of many short runs. Divisions and square
    roots take many times as long as a multiply-add, so real graphs cannot reach this rate.
    """
    run, work, how = _numba() if find_spec("numba") else _numpy()
    run()
    best, end = float("inf"), time.perf_counter() + seconds
    while time.perf_counter() < end:
        began = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - began)
    return work / best, how


def _numba() -> tuple[Callable[[], None], int, str]:
    import numba

    names = [f"x{i}" for i in range(CHAINS)]
    step = "; ".join(f"{x} = {x} * b + c" for x in names)
    source = [
        "def horner(a, b, c, repeats):",
        "    for _ in range(repeats):",
        f"        for j in range({LANES}):",
        f"            {'; '.join(f'{x} = a[{i}, j]' for i, x in enumerate(names))}",
        *[f"            {step}"] * STEPS,
        f"            {'; '.join(f'a[{i}, j] = {x}' for i, x in enumerate(names))}",
    ]
    namespace: dict = {}
    exec("\n".join(source), namespace)
    kernel = numba.njit(fastmath={"contract"})(namespace["horner"])
    a, repeats = np.full((CHAINS, LANES), 0.5), 50
    return lambda: kernel(a, 0.999, 1e-3, repeats), LANES * STEPS * CHAINS * repeats, "Numba, Horner chains"


def _numpy() -> tuple[Callable[[], None], int, str]:
    a, repeats = np.full(1024, 0.5), 200

    def run() -> None:
        for _ in range(repeats):
            np.multiply(a, 0.999, out=a)
            np.add(a, 1e-3, out=a)

    return run, a.size * repeats, "NumPy, multiply then add (Numba is not installed: a low bound)"
