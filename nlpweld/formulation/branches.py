"""Which branches a search can meet at all, told from a sample of it.

Three robots with two shoulders and two elbows each have 64 branch combinations (modes), but only 12 robot-branches,
and whether one of those keeps reach, joint limits and the singularity floor does not depend on the other robots. A
mode is in doubt if one of its robot-branches kept them nowhere, and in less doubt if each did somewhere but never all
at the same place.

A sample is a guess: what it never met may still be there, in a corner smaller than the gaps between its points. So
nothing is taken away. The exact model judges every mode; solvers that follow modes one by one follow those in doubt
last, when the others have ended infeasible.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

SAMPLES = 512  # independent ones would miss what fills a share p of the search with probability exp(-512 p)


@dataclass(frozen=True, eq=False)
class Screening:
    """What a sample says of the branches; m samples, S stations, B arm branches.

    Attributes:
        X: the samples, shape (m, n).
        kept: whether a station on a branch keeps reach and joint limits and (nearly) the floor, shape (m, S, B).
    """

    X: np.ndarray
    kept: np.ndarray

    @cached_property
    def together(self) -> np.ndarray:
        """Whether all stations keep them at once, by sample and mode, shape (m, B^S)."""
        return np.stack([np.all(self.kept[:, self._stations, c], axis=1) for c in self._choices], axis=1)

    @cached_property
    def doubt(self) -> np.ndarray:
        """How doubtful every mode is, shape (B^S,).

        0 where all its robot-branches keep all at one sample, 1 where each does at some sample, 2 where one never does.
        """
        somewhere: np.ndarray = np.asarray(self.kept.any(axis=0))
        each = np.array([np.all(somewhere[self._stations, c]) for c in self._choices])
        return np.where(self.together.any(axis=0), 0, np.where(each, 1, 2))

    def at(self, mode: int) -> np.ndarray:
        """Return the samples at which all robot-branches of a mode keep all, shape (r, n)."""
        return self.X[self.together[:, mode]]

    @property
    def _stations(self) -> np.ndarray:
        return np.arange(self.kept.shape[1])

    @property
    def _choices(self) -> list[tuple[int, ...]]:
        _, stations, branches = self.kept.shape
        return list(product(range(branches), repeat=stations))

    def __str__(self) -> str:
        """Tell how many modes remain, and on what evidence."""
        each, both = int((self.doubt <= 1).sum()), int((self.doubt == 0).sum())
        return (
            f"of {len(self.doubt)} branch combinations {each} are of branches met, {both} were met together, "
            f"in {len(self.X)} samples"
        )
