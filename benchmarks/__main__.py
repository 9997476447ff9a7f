"""Everything that is reported, by one command: ``python -m benchmarks``; about ten minutes.

Each part has a process of its own, so that the memory one takes does not count for the next.
"""

import subprocess
import sys

for part in (
    "benchmarks.ratios",
    "benchmarks.scaling",
    "benchmarks.forms",
    "benchmarks.studies",
    "benchmarks.s_curves",
):
    subprocess.run([sys.executable, "-m", part], check=True)
