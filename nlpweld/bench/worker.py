"""The child process of one task: a task as one line of JSON on standard input, its record on standard output.

Standard input stays open while whoever asked is alive; when it ends, so does this process and all it started.
"""

import contextlib
import json
import os
import signal
import sys
import threading
from typing import Any

from nlpweld.bench.task import Task, run_task


def main() -> None:
    """Run the one task and print its record; whatever goes wrong beyond it is told on standard error."""
    asked = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if asked["limit_mb"] is not None:
        _limit_memory(asked["limit_mb"])
    out, sys.stdout = sys.stdout, sys.stderr  # what a library prints is no part of the record
    out.write(run_task(Task.from_json(asked["task"])).model_dump_json())
    out.flush()


def _end_with_parent() -> None:
    with contextlib.suppress(OSError, ValueError):
        sys.stdin.read()
    os.killpg(0, signal.SIGKILL) if hasattr(os, "killpg") else os._exit(1)


def _limit_memory(limit_mb: int) -> None:
    """Hold this process to so much data; where the system knows no such limit there is none."""
    resource: Any
    try:
        import resource
    except ImportError:
        return
    limit = limit_mb * 1_000_000
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


if __name__ == "__main__":
    main()
