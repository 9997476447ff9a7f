"""Many starts of one solver, one after another in this process or side by side in processes of their own.

Processes, not threads: one CasADi solver shared by threads corrupts memory. Each is a plain subprocess
(:mod:`~.worker`) that is told how to build the problem, so a script without a main guard works. A process that dies
costs the start it was at and is replaced. None outlives this one: they are killed when the generator is closed, and
end by themselves when their standard input does.
"""

import contextlib
import os
import pickle
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from nlpweld.formulation.nlp import Nlp
from nlpweld.solvers.base import Budget, Outcome, Solver

COMMAND = (sys.executable, "-P", "-m", "nlpweld.solvers.worker")
SINGLE_THREADED = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
GRACE_S = 10.0  # how long a process may go on after the time limit before it is killed
NOT_BEGUN = "not begun"


@dataclass(frozen=True)
class Start:
    """One start: the seed of its random draws, and its limits."""

    seed: int
    budget: Budget


@dataclass(frozen=True, eq=False)
class End:
    """What became of a start.

    Attributes:
        outcome: what the solver says, or None where there is nothing.
        lost: why there is nothing.
        began_s: when it began [s], on the clock it was given.
        build_s: time to start a process and build the problem there [s], beside what the outcome tells.
    """

    outcome: Outcome | None
    lost: str = ""
    began_s: float = 0.0
    build_s: float = 0.0


@dataclass(frozen=True)
class Clock:
    """Time since a moment of ``time.perf_counter()``, and how much of it there is (None: no end)."""

    started: float
    time_s: float | None

    @property
    def now_s(self) -> float:
        """Time since the start [s]."""
        return time.perf_counter() - self.started

    @property
    def left_s(self) -> float | None:
        """Time that is left [s], or None where there is no limit."""
        return None if self.time_s is None else self.time_s - self.now_s


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def kept(nlp: Nlp) -> Nlp:
    """Return the problem with its relaxations kept for the next start in this process."""
    return replace(nlp, relax=cache(nlp.relax)) if nlp.relax else nlp


def attempt(nlp: Nlp, solver: Solver, start: Start) -> Outcome | str:
    """Solve from one start; what goes wrong is told in words, for it costs this start only."""
    try:
        return solver.solve(nlp, seed=start.seed, budget=start.budget)
    except (ArithmeticError, RuntimeError, ValueError) as error:
        return f"{type(error).__name__}: {error}"


def here(nlp: Nlp, solver: Solver, starts: Sequence[Start], clock: Clock) -> Generator[End, None, None]:
    """Yield the ends of starts, solved one after another in this process."""
    nlp = kept(nlp)
    for start in starts:
        left_s, began_s = clock.left_s, clock.now_s
        if left_s is not None and left_s <= 0.0:
            yield End(None, NOT_BEGUN)
        else:
            yield _end(attempt(nlp, solver, _within(start, left_s)), began_s)


def apart(nlp: Nlp, solver: Solver, starts: Sequence[Start], clock: Clock, workers: int) -> Generator[End, None, None]:
    """Yield the ends of starts in their order, solved side by side by processes that build the problem anew.

    Args:
        nlp: the problem; its ``rebuild`` goes to the processes.
        solver: what solves it.
        starts: where from.
        clock: tells what is left of the time limit.
        workers: processes at once.
    """
    crew = _Crew(pickle.dumps((nlp.rebuild, solver)), workers, clock)
    pool = ThreadPoolExecutor(workers)  # whose threads wait for one process each
    try:
        ends = [pool.submit(crew.run, start) for start in starts]
        for end in ends:
            yield end.result()
    finally:
        crew.stop()
        pool.shutdown(cancel_futures=True)
        crew.close()


def _within(start: Start, left_s: float | None) -> Start:
    return replace(start, budget=replace(start.budget, time_s=left_s))


def _end(said: Outcome | str, began_s: float, build_s: float = 0.0) -> End:
    return End(None, said, began_s, build_s) if isinstance(said, str) else End(said, "", began_s, build_s)


class _DiedError(Exception):
    """A process has gone; the text is its last words."""


class _Crew:
    """Processes that wait for starts; each is begun when it is first needed."""

    def __init__(self, recipe: bytes, workers: int, clock: Clock) -> None:
        self.recipe, self.clock, self.stopped = recipe, clock, False
        self._lock = threading.Lock()
        self._all: list[_Worker] = []
        self._idle: queue.LifoQueue[_Worker | None] = queue.LifoQueue()
        for _ in range(workers):
            self._idle.put(None)

    def run(self, start: Start) -> End:
        """Return the end of a start on a process that is idle, or on a new one."""
        worker, began_s = self._idle.get(), self.clock.now_s
        try:
            if self._left(0.0) <= 0.0:
                return End(None, NOT_BEGUN)
            fresh = worker is None
            worker = worker or self._begin()
            build_s = self.clock.now_s - began_s if fresh else 0.0
            began_s, left_s = self.clock.now_s, self.clock.left_s
            return _end(worker.ask(_within(start, left_s), self._left(GRACE_S)), began_s, build_s)
        except _DiedError as died:
            worker = None
            return End(None, str(died), began_s)
        finally:
            self._idle.put(worker)

    def stop(self) -> None:
        """Kill all processes, and begin no more."""
        with self._lock:
            self.stopped = True
        for worker in self._all:
            worker.process.kill()

    def close(self) -> None:
        """Close what is left of the processes, once nobody waits for them."""
        for worker in self._all:
            worker.close()

    def _begin(self) -> "_Worker":
        with self._lock:
            if self.stopped:
                raise _DiedError(NOT_BEGUN)
            worker = _Worker()
            self._all.append(worker)
        worker.tell(self.recipe, self._left(GRACE_S))
        return worker

    def _left(self, grace_s: float) -> float:
        left_s = self.clock.left_s
        return float("inf") if left_s is None else left_s + grace_s


class _Worker:
    """One process."""

    def __init__(self) -> None:
        # The parent's own search path, in its order: the child finds the same modules wherever it is started.
        path = os.pathsep.join(p or str(Path.cwd()) for p in sys.path)
        env, pipe = {**os.environ, **SINGLE_THREADED, "PYTHONPATH": path}, subprocess.PIPE
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process)
        self.process = subprocess.Popen(COMMAND, stdin=pipe, stdout=pipe, stderr=self._said, env=env)

    def ask(self, start: Start, limit_s: float) -> Outcome | str:
        """Return what became of a start."""
        return self.tell(pickle.dumps(start), limit_s)

    def tell(self, message: bytes, limit_s: float) -> Any:
        """Send a message and return the answer.

        Raises:
            _DiedError: the process ended, or was killed at the limit.
        """
        asked, answers = self.process.stdin, self.process.stdout
        assert asked is not None
        assert answers is not None
        watchdog = threading.Timer(min(limit_s, threading.TIMEOUT_MAX), self.process.kill)
        watchdog.daemon = True
        watchdog.start()
        try:
            asked.write(message)
            asked.flush()
            return pickle.load(answers)
        except (EOFError, OSError, pickle.UnpicklingError):
            self.process.kill()
            raise _DiedError(self._last_words()) from None
        finally:
            watchdog.cancel()

    def close(self) -> None:
        """Kill the process and close its pipes."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self._said):
            if stream is not None:
                with contextlib.suppress(OSError):  # bytes left in a pipe to a dead process
                    stream.close()

    def _last_words(self) -> str:
        status = self.process.wait()
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        return f"process ended with {status}" + (f": {lines[-1].strip()}" if lines else "")
