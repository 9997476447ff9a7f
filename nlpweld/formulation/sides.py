"""Branches read off joints: shoulder, elbow and wrist are the signs of the three factors of |det J|."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nlpweld.cell.levels import Configuration
from nlpweld.formulation.smooth import Mode
from nlpweld.kinematics.ik import ELBOW, SHOULDER, WRIST

SIDES = (SHOULDER, ELBOW, WRIST)


@dataclass(frozen=True)
class Sides:
    """What factors (m, N, 3 S) at N seam points say of the branches of S stations, for m candidates.

    Attributes:
        configuration: branches that are allowed.
        modes: combinations of shoulder and elbow.
    """

    configuration: Configuration
    modes: Sequence[Mode]

    def astray(self, factors: np.ndarray) -> np.ndarray:
        """Return the share of points with a robot on another side than at the first, or one not allowed, (m,)."""
        side = _signs(factors)
        asked, chosen = side[:, :1].copy(), self.configuration
        for i, (name, all_) in enumerate(zip((chosen.shoulder, chosen.elbow, chosen.wrist), SIDES, strict=True)):
            if name != "any":
                asked[..., i] = all_[name]
        return (side != asked).any(axis=(2, 3)).mean(axis=1)

    def branches(self, factors: np.ndarray) -> list[list[tuple[str, ...]]]:
        """Return the names of the sides every station is on at the first point, for every candidate."""
        named = [{sign: name for name, sign in side.items()} for side in SIDES]
        first = _signs(factors)[:, 0]
        return [[tuple(n[int(i)] for n, i in zip(named, s, strict=True)) for s in stations] for stations in first]

    def mode(self, factors: np.ndarray) -> np.ndarray:
        """Return which mode every candidate is on at its first point, (m,); 0 where that is none."""
        known = {tuple(mode): i for i, mode in enumerate(self.modes)}
        arms = [tuple((b[0], b[1]) for b in stations) for stations in self.branches(factors)]
        return np.array([known.get(arm, 0) for arm in arms])


def _signs(factors: np.ndarray) -> np.ndarray:
    """Return the signs of shoulder, elbow and wrist, shape (m, N, S, 3)."""
    return np.where(factors.reshape(*factors.shape[:2], -1, len(SIDES)) > 0.0, 1, -1)
