"""Exact distances: FCL in a watched process, held against segment distances in NumPy."""

import atexit
import contextlib
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import IO

import numpy as np

from nlpweld.errors import VerifierError
from nlpweld.verify.pipe import receive, send

COMMAND = (sys.executable, "-P", "-m", "nlpweld.verify.worker")
LIMIT_S = 60.0
CHUNK = 2000  # samples a request; about 0.6 s of work
AGREE_M = 1e-6


class Watched:
    """The geometry process, started when first needed, killed when it hangs, and restarted once a request.

    Args:
        command: what to run; it speaks the protocol of :mod:`nlpweld.verify.worker`.
        limit_s: time one request may take [s].
    """

    def __init__(self, command: Sequence[str] = COMMAND, limit_s: float = LIMIT_S) -> None:
        """Keep the command; nothing is started yet."""
        self.command = tuple(command)
        self.limit_s = limit_s
        self.starts = 0
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0
        self._said: IO[bytes] | None = None
        self._last_words = ""
        self._lock = threading.Lock()

    def distances(self, ends: np.ndarray, radii: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """Return raw FCL distances, shape (M, P) [m]; arguments as in :func:`nlpweld.verify.worker.distances`.

        Raises:
            VerifierError: the process hung or died twice.
        """
        with self._lock:
            for _ in range(2):
                answer = self._ask(ends, radii, pairs)
                if answer is not None and answer.shape == (len(ends), len(pairs)):
                    return answer
                self.close()
            raise VerifierError(
                f"the geometry process hung (over {self.limit_s:g} s) or died, twice{self._last_words}; "
                "check that python-fcl works here, then verify again"
            )

    def close(self) -> None:
        """Stop the process, if this process started one."""
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():  # a forked child must not kill its parent's worker
            return
        process.kill()
        process.wait()
        self._last_words = self._read_last_words()
        for stream in (process.stdin, process.stdout, self._said):
            if stream is not None:
                with contextlib.suppress(OSError):  # bytes left in a pipe to a dead process
                    stream.close()

    def _ask(self, *request: np.ndarray) -> np.ndarray | None:
        """Send one request; None if the process died, or was killed at the limit."""
        process = self._running()
        assert process.stdin is not None
        assert process.stdout is not None
        watchdog = threading.Timer(self.limit_s, process.kill)
        watchdog.daemon = True
        watchdog.start()
        try:
            send(process.stdin, *request)
            return receive(process.stdout, 1)[0]
        except (EOFError, OSError, ValueError, OverflowError, MemoryError):  # gone, or answers with rubbish
            return None
        finally:
            watchdog.cancel()

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None or self._owner != os.getpid():
            # The parent's own search path, in its order: the child finds the same nlpweld wherever it is started.
            path = os.pathsep.join(p or str(Path.cwd()) for p in sys.path)
            env = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
            self._said = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process)
            pipe = subprocess.PIPE
            self._process = subprocess.Popen(self.command, stdin=pipe, stdout=pipe, stderr=self._said, env=env)
            self._owner = os.getpid()
            self.starts += 1
        return self._process

    def _read_last_words(self) -> str:
        """Return the last line the process wrote to stderr, in brackets."""
        if self._said is None:
            return ""
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        return f" ({lines[-1].strip()})" if lines else ""


def segment_distances(ends: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the distance of the axes of every pair in every sample, shape (M, P) [m], in NumPy.

    The nearest points of two segments are either inside both, or one of them is an end.

    Args:
        ends: axis ends, shape (M, B, 2, 3) [m].
        pairs: two body indices a row, shape (P, 2).
    """
    p, q = ends[:, pairs[:, 0]], ends[:, pairs[:, 1]]
    tips = [_tip_to_segment(p[:, :, i], q) for i in (0, 1)] + [_tip_to_segment(q[:, :, i], p) for i in (0, 1)]
    return np.minimum(np.min(tips, axis=0), _inside_both(p, q))


def pair_distances(watched: Watched, ends: np.ndarray, radii: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the distance of every pair of capsules in every sample, shape (M, P) [m]; negative is penetration.

    FCL and NumPy are both asked. Where they differ by more than ``AGREE_M`` the smaller counts; where FCL has no
    answer (-1 or not a number) NumPy's counts, and says how deep.

    Raises:
        VerifierError: the geometry process hung or died twice.
    """
    if len(pairs) == 0:
        return np.empty((len(ends), 0))
    parts = []
    for i in range(0, len(ends), CHUNK):
        part = ends[i : i + CHUNK]
        said = watched.distances(part, radii, pairs)
        own = segment_distances(part, pairs) - radii[pairs].sum(axis=1)
        parts.append(settle(said, own))
    return np.concatenate(parts)


def settle(said: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return FCL's distances where they stand, and the safe choice where they do not."""
    undefined = ~np.isfinite(said) | (said == -1.0)
    differ = np.abs(said - own) > AGREE_M
    return np.where(undefined, own, np.where(differ, np.minimum(said, own), said))


def shared() -> Watched:
    """Return the one geometry process of this process; it is stopped at exit."""
    global _shared
    if _shared is None:
        _shared = Watched()
        atexit.register(_shared.close)
    return _shared


_shared: Watched | None = None


def _tip_to_segment(tip: np.ndarray, segment: np.ndarray) -> np.ndarray:
    """Return distances of points (M, P, 3) from segments (M, P, 2, 3), shape (M, P)."""
    d = segment[:, :, 1] - segment[:, :, 0]
    square = (d * d).sum(axis=-1)
    t = ((tip - segment[:, :, 0]) * d).sum(axis=-1) / np.where(square > 0, square, 1.0)
    return np.linalg.norm(tip - segment[:, :, 0] - np.clip(t, 0.0, 1.0)[..., None] * d, axis=-1)


def _inside_both(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return distances where the common normal of both lines meets both segments, else infinity, shape (M, P)."""
    u, v, w = p[:, :, 1] - p[:, :, 0], q[:, :, 1] - q[:, :, 0], p[:, :, 0] - q[:, :, 0]
    uu, vv, uv = (u * u).sum(-1), (v * v).sum(-1), (u * v).sum(-1)
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    det = uu * vv - uv**2
    skew = det > 1e-12 * uu * vv  # nearly parallel segments are nearest at a tip, to within 1e-6 of their length
    det = np.where(skew, det, 1.0)
    a, b = (uv * vw - vv * uw) / det, (uu * vw - uv * uw) / det
    inside = skew & (a >= 0) & (a <= 1) & (b >= 0) & (b <= 1)
    return np.where(inside, np.linalg.norm(w + a[..., None] * u - b[..., None] * v, axis=-1), np.inf)
