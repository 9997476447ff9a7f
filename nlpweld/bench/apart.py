"""One task in a process of its own: killed when its time is up, held to its memory, ended with whoever asked."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from typing import IO, Any

from nlpweld.solvers.starts import SINGLE_THREADED

GRACE_S = 30.0  # on top of a task's time limit: start-up, verification
TAIL = 12  # lines on standard error that are kept of a process that failed
WORKER = [sys.executable, "-m", "nlpweld.bench.worker"]


@dataclass(frozen=True)
class Job:
    """What a process is given.

    Attributes:
        task: the task as plain data.
        limit_s: wall time after which the process is killed, or None.
        limit_mb: memory it may take, or None.
    """

    task: dict[str, Any]
    limit_s: float | None = None
    limit_mb: int | None = None


@dataclass(frozen=True)
class Ending:
    """How a process ended.

    Attributes:
        record: what it wrote, or None.
        status: ``FAILED``, or ``TIMEOUT`` when it was killed; of no meaning where there is a record.
        message: why there is no record.
        stderr: its last lines on standard error.
        wall_s: how long it took.
    """

    record: dict[str, Any] | None
    status: str
    message: str
    stderr: list[str]
    wall_s: float


def run_apart(job: Job, live: set[subprocess.Popen] | None = None) -> Ending:
    """Run a job in a process of its own and return how it ended; never raises for what happens in there.

    Args:
        job: what to run.
        live: where the process is listed while it is alive, for those who may want to end it.
    """
    began = time.perf_counter()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = _started(job, out, err)
        live = set() if live is None else live
        live.add(process)
        try:
            code: int | None = process.wait(job.limit_s)
        except subprocess.TimeoutExpired:
            code = None
        finally:
            end(process)
            live.discard(process)
        return _ending(code, job, _read(out), _read(err).splitlines()[-TAIL:], time.perf_counter() - began)


def end(process: subprocess.Popen) -> None:
    """Kill a process and all it started."""
    if process.stdin and not process.stdin.closed:
        with contextlib.suppress(OSError):
            process.stdin.close()
    with contextlib.suppress(OSError):  # it is gone already
        os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
    process.wait()


def _started(job: Job, out: IO[bytes], err: IO[bytes]) -> subprocess.Popen:
    """Start the process; its standard input stays open as long as whoever asked is alive."""
    environment = {**os.environ, **SINGLE_THREADED}
    process = subprocess.Popen(
        WORKER, stdin=subprocess.PIPE, stdout=out, stderr=err, env=environment, start_new_session=True
    )
    assert process.stdin is not None
    with contextlib.suppress(OSError):  # it died at once; its standard error says why
        process.stdin.write(json.dumps({"task": job.task, "limit_mb": job.limit_mb}).encode() + b"\n")
        process.stdin.flush()
    return process


def _ending(code: int | None, job: Job, out: str, err: list[str], wall_s: float) -> Ending:
    if code is None:
        return Ending(None, "TIMEOUT", f"killed after {job.limit_s:.0f} s", err, wall_s)
    try:
        return Ending(json.loads(out), "", "", err, wall_s)
    except ValueError:
        why = err[-1].strip() if err else "nothing on standard error"
        return Ending(None, "FAILED", f"process ended {_code(code)}: {why}", err, wall_s)


def _code(code: int) -> str:
    if code >= 0:
        return f"with {code}"
    with contextlib.suppress(ValueError):
        return f"by {signal.Signals(-code).name}"
    return f"by signal {-code}"


def _read(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")
