"""Lanes: arrays over many candidates and seam points at once, and what a kernel takes and gives.

Inputs come in four kinds: ``candidate`` (m, n) differs from candidate to candidate, ``point`` (n, N) from seam point
to seam point, ``lane`` (n arrays of (m, N)) from both, and ``number`` (n,) from none. Outputs are lanes.
"""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

Lanes = Sequence[np.ndarray] | np.ndarray
Kinds = tuple[str, ...]
Kernel = Callable[..., tuple[Lanes, ...]]

# operations whose form as Python source is the same for arrays and for numbers
ARITHMETIC = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "1.0 / {0}",
    ca.OP_SQRT: "sqrt({0})",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
}


def lane_shape(kinds: Kinds, inputs: tuple[Any, ...]) -> tuple[int, int]:
    """Return the number of candidates and of points that inputs of some kinds are about."""
    sizes = {}
    for kind, given in zip(kinds, inputs, strict=True):
        if kind == "lane":
            return given[0].shape
        sizes[kind] = len(given) if kind == "candidate" else given.shape[-1]
    return sizes["candidate"], sizes["point"]


def rows(lanes: Lanes, which: Any) -> Lanes:
    """Return some candidates of lanes, by slice, index or mask; arrays keep a candidate's numbers together."""
    if isinstance(lanes, np.ndarray):
        return lanes.transpose(1, 0, 2)[which].transpose(1, 0, 2)
    return [lane[which] for lane in lanes]


def joined(parts: list[Lanes]) -> Lanes:
    """Return lanes of several chunks of candidates as one."""
    if len(parts) == 1:
        return parts[0]
    if isinstance(parts[0], np.ndarray):
        return np.concatenate([np.asarray(part).transpose(1, 0, 2) for part in parts]).transpose(1, 0, 2)
    return [np.concatenate(same) for same in zip(*parts, strict=True)]
