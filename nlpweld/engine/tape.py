"""The instruction list of a CasADi SX function as arrays, for machines that run it on more than plain numbers."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

CONST, INPUT, OUTPUT = ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT
FLAT = ("LT", "LE", "NOT")  # without derivative
BINARY = ("ADD", "SUB", "MUL", "DIV", "FMIN", "FMAX", "LT", "LE", "IF_ELSE_ZERO", "POW", "CONSTPOW")
UNARY = ("NEG", "TWICE", "SQ", "SQRT", "INV", "EXP", "LOG1P", "SIN", "COS", "FABS", "NOT", "ASSIGN")


def numbers(names: tuple[str, ...]) -> dict[int, str]:
    """Return CasADi's operations by number."""
    return {getattr(ca, f"OP_{name}"): name for name in names}


@dataclass(frozen=True, eq=False)
class Tape:
    """An instruction list as arrays.

    Attributes:
        code: operation, result, first and second operand, shape (n, 4). Inputs are counted over all nonzeros of all
            inputs, results of OUTPUT over those of all outputs.
        active: whether result, first and second operand depend on the variables, shape (n, 3).
        constants: the number of each CONST instruction, shape (n,).
        registers: how many results are held at once.
    """

    code: np.ndarray
    active: np.ndarray
    constants: np.ndarray
    registers: int


def tape(f: ca.Function) -> Tape:
    """Return the instruction list of an SX function whose first input are the variables.

    Raises:
        ValueError: an operation that has no steps.
    """
    first = np.concatenate([[0], np.cumsum([f.nnz_in(i) for i in range(f.n_in())])])
    first_out = np.concatenate([[0], np.cumsum([f.nnz_out(i) for i in range(f.n_out())])])
    n = f.n_instructions()
    code, active, constants = np.zeros((n, 4), dtype=np.int64), np.zeros((n, 3), dtype=np.int64), np.zeros(n)
    alive = np.zeros(f.sz_w(), dtype=bool)
    binary, unary, flat = numbers(BINARY), numbers(UNARY), numbers(FLAT)
    for k in range(n):
        op, ins, outs = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if op == CONST:
            code[k, :2], constants[k], alive[outs[0]] = (op, outs[0]), f.instruction_constant(k), False
        elif op == INPUT:
            code[k, :3], alive[outs[0]] = (op, outs[0], first[ins[0]] + ins[1]), ins[0] == 0
            active[k, 0] = ins[0] == 0
        elif op == OUTPUT:
            code[k, :3], active[k, 1] = (op, first_out[outs[0]] + outs[1], ins[0]), alive[ins[0]]
        elif op in binary or op in unary:
            a, b = ins[0], ins[1] if op in binary else ins[0]
            uses_b = op in binary and alive[b]
            code[k] = op, outs[0], a, b
            result = op not in flat and bool(alive[a] or uses_b)
            active[k], alive[outs[0]] = (result, alive[a], uses_b), result
        else:
            raise ValueError(f"{f.name()}: CasADi operation {op} has no jet; add it to nlpweld/engine/tape.py")
    code, registers = _apart(code)
    return Tape(code, active, constants, registers)


def _apart(code: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the code with registers given anew, so that no result lies where its operands do, and their number."""
    made: dict[int, int] = {}  # by which instruction each of the old registers was written last
    read: list[list[int]] = []
    for k, (op, result, a, b) in enumerate(code.tolist()):
        read.append([] if op in (CONST, INPUT) else [made[a]] if op == OUTPUT else [made[a], made[b]])
        if op != OUTPUT:
            made[result] = k
    last = {value: k for k, values in enumerate(read) for value in values}
    place, free, count, code = {}, list[int](), 0, code.copy()
    for k, values in enumerate(read):
        if code[k, 0] != OUTPUT:
            place[k] = free.pop() if free else count
            count = max(count, place[k] + 1)
            code[k, 1] = place[k]
        code[k, 2 : 2 + len(values)] = [place[value] for value in values]
        free += [place[value] for value in set(values) if last[value] == k]
    return code, count
