"""Never comes back, and starts a process that does not either."""

import subprocess
import sys
import time
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Hanger:
    PRESETS: ClassVar[dict[str, dict[str, object]]] = {"default": {}}

    def unsuitable(self, nlp):
        return None

    def solve(self, nlp, *, seed, budget):
        subprocess.Popen([sys.executable, "-c", "import time; time.sleep(977)"])
        while True:
            time.sleep(1.0)
