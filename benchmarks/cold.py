"""How long the first answer takes: new processes, with and without caches of compiled kernels."""

import os
import subprocess
import sys
import tempfile
import time

import numpy as np

PAPER = ("0.023", "-0.266", "0.404")
IMPORT = (sys.executable, "-c", "import nlpweld")
EVALUATE = (sys.executable, "-c", "from nlpweld.cli import main; main()", "evaluate", "three_er16", "--at", *PAPER)


def rows(repeats: int = 3) -> list[dict]:
    """Return rows for ``import nlpweld`` and ``nlpweld evaluate``; the cache folder is a fresh one."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NLPWELD_CACHE": folder}
        cold = [_wall_s(EVALUATE, environment)]
        warm = [_wall_s(EVALUATE, environment) for _ in range(repeats)]
        loaded = [_wall_s(IMPORT, environment) for _ in range(repeats)]
    return [
        _row("import nlpweld", loaded, f"median of {repeats}"),
        _row("nlpweld evaluate", cold, "empty cache of kernels, once"),
        _row("nlpweld evaluate", warm, f"caches exist, median of {repeats}"),
    ]


def _wall_s(command: tuple[str, ...], environment: dict[str, str]) -> float:
    began = time.perf_counter()
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command[1:])} failed: {done.stderr.strip()}")
    return time.perf_counter() - began


def _row(what: str, times: list[float], note: str) -> dict:
    row = {"section": "start", "what": what, "contender": "nlpweld", "unit": "process", "note": note}
    return row | {"median_s": float(np.median(times)), "fastest_s": min(times), "slowest_s": max(times)}
