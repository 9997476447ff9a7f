"""Dies like a library with a bug: by a signal, with a word on standard error."""

import os
import signal
import sys
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Crasher:
    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}}

    def unsuitable(self, nlp):
        return None

    def solve(self, nlp, *, seed, budget):
        print("about to fall", file=sys.stderr, flush=True)
        os.kill(os.getpid(), signal.SIGSEGV)
