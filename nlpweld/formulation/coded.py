"""Variables of a redundant form: a placement, then control points of the free angles' paths."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nlpweld.cell.levels import Objective
from nlpweld.formulation.freedom import FreeAngle
from nlpweld.formulation.over_seam import smooth

# (z (d, N), sharpness, slopes) -> values (N,), gradients (d, N), Hessians (d, d, N) at every seam point
Lanes = Callable[[np.ndarray, float, bool], tuple[np.ndarray, np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Coding:
    """How a vector of variables becomes a placement and paths of free angles.

    Attributes:
        box: bounds of the placement's coordinates, shape (2, d) [m; rad].
        angles: the free angles.
        basis: B-spline values at the seam points, shape (N, K).
    """

    box: np.ndarray
    angles: tuple[FreeAngle, ...]
    basis: np.ndarray

    @property
    def d(self) -> int:
        """Coordinates of the placement."""
        return self.box.shape[1]

    @property
    def bounds(self) -> np.ndarray:
        """Bounds of all variables, shape (2, n). A path stays between its control points, so theirs are its own."""
        bands = np.array([[a.lower, a.upper] for a in self.angles]).reshape(-1, 2).T
        return np.concatenate([self.box, np.tile(bands, self.basis.shape[1])], axis=1)

    def decode(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the placement's coordinates (d,) and the angles at the seam points (f, N) [rad]."""
        control = z[self.d :].reshape(self.basis.shape[1], len(self.angles))
        return z[: self.d], (self.basis @ control).T

    def constant(self, x: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Return the variables of placements (m, d) whose angles (m, f) [rad] stay the same along the seam, (m, n)."""
        return np.concatenate([x, np.tile(angles, self.basis.shape[1])], axis=1)


@dataclass(frozen=True, eq=False)
class Piece:
    """A sum over seam points of a function of the placement and of the angles at one or two points each.

    Attributes:
        lanes: the function and its derivatives by (x, u) or (x, u, u of the next point).
        bases: for each block of angles the basis at its points, shapes (N, K).
        objective: where the function is no summand but a value to be maximised over the seam, how (:mod:`~.over_seam`).
    """

    lanes: Lanes
    bases: tuple[np.ndarray, ...]
    objective: Objective | None = None

    def value(self, local: np.ndarray, sharpness: float) -> float:
        """Return what the piece adds, at the variables of its points (d + blocks * f, N)."""
        values = self.lanes(local, sharpness, False)[0]
        return float(values.sum()) if self.objective is None else -smooth(self.objective, values, sharpness).value

    def slopes(self, local: np.ndarray, sharpness: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Return gradients (d + blocks * f, N) and Hessians to be summed, and by how much points couple.

        The Hessian is the sum of Hessians plus that factor times the outer product of the summed gradient.
        """
        values, G, H = self.lanes(local, sharpness, True)
        if self.objective is None:
            return G, H, 0.0
        over = smooth(self.objective, values, sharpness)
        return -over.slope * G, over.bend * G[:, None] * G - over.slope * H, -over.shared


@dataclass(frozen=True, eq=False)
class Assembly:
    """A sum of pieces as a function of all variables, with gradient and Hessian by the chain rule.

    Attributes:
        coding: of the variables.
        pieces: what is summed.
    """

    coding: Coding
    pieces: Sequence[Piece]

    def value(self, z: np.ndarray, sharpness: float) -> float:
        """Return the value at variables z (n,)."""
        return float(sum(p.value(self._local(p, z), sharpness) for p in self.pieces))

    def slopes(self, z: np.ndarray, sharpness: float) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient (n,) and Hessian (n, n) at variables z (n,)."""
        gradient, hessian = np.zeros(len(z)), np.zeros((len(z), len(z)))
        for piece in self.pieces:
            G, H, shared = piece.slopes(self._local(piece, z), sharpness)
            own = np.zeros(len(z))
            self._add(piece, G, H, own, hessian)
            gradient += own
            if shared:
                hessian += shared * np.outer(own, own)
        return gradient, hessian

    def _local(self, piece: Piece, z: np.ndarray) -> np.ndarray:
        """Return the variables of a piece at every seam point, shape (d + blocks * f, N)."""
        control = z[self.coding.d :].reshape(self.coding.basis.shape[1], -1) if len(z) > self.coding.d else z[:0]
        x = np.tile(z[: self.coding.d, None], len(piece.bases[0] if piece.bases else self.coding.basis))
        return np.concatenate([x, *((basis @ control).T for basis in piece.bases)])

    def _add(self, piece: Piece, G: np.ndarray, H: np.ndarray, gradient: np.ndarray, hessian: np.ndarray) -> None:
        d, f = self.coding.d, len(self.coding.angles)
        spans = [slice(d + k * f, d + (k + 1) * f) for k in range(len(piece.bases))]
        gradient[:d] += G[:d].sum(axis=1)
        hessian[:d, :d] += H[:d, :d].sum(axis=2)
        for here, B in zip(spans, piece.bases, strict=True):
            gradient[d:] += (B.T @ G[here].T).ravel()
            cross = np.einsum("abj,jk->akb", H[:d, here], B).reshape(d, -1)
            hessian[:d, d:] += cross
            hessian[d:, :d] += cross.T
            for there, C in zip(spans, piece.bases, strict=True):
                block = np.einsum("jk,abj,jl->kalb", B, H[here, there], C, optimize=True)
                hessian[d:, d:] += block.reshape(len(gradient) - d, -1)
