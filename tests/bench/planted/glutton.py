"""Eats all the memory it is given."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np


@dataclass(frozen=True)
class Glutton:
    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}}

    def unsuitable(self, nlp):
        return None

    def solve(self, nlp, *, seed, budget):
        eaten = []
        while True:
            eaten.append(np.ones(10_000_000))
