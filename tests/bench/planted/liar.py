"""Claims a corner of the box, whatever the exact model says of it."""

from dataclasses import dataclass
from typing import ClassVar

from nlpweld.solvers.base import Outcome


@dataclass(frozen=True)
class Liar:
    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}}

    def unsuitable(self, nlp):
        return None

    def solve(self, nlp, *, seed, budget):
        return Outcome("SOLVED", nlp.upper.copy(), 0, 1e6, 1, 0.0, 0.001, message="the best there is")
