"""Where jobs run: on this machine, or where a Dask scheduler has workers. Either way each is a process of its own."""

import subprocess
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Any, Protocol

from nlpweld.bench.apart import Ending, Job, end, run_apart
from nlpweld.errors import OptionError, missing

ANSWER_S = 10.0  # how long a scheduler may take to answer


class Engine(Protocol):
    """Runs jobs and yields how they ended, as they end."""

    def run(self, jobs: Sequence[Job]) -> Iterator[tuple[int, Ending]]:
        """Yield the index of each job and how it ended."""

    @property
    def slots(self) -> int:
        """Jobs under way at once."""


@dataclass(frozen=True)
class Local:
    """Processes of this machine.

    Attributes:
        workers: jobs under way at once; runtime tables want one.
    """

    workers: int = 1

    @property
    def slots(self) -> int:
        """Jobs under way at once."""
        return max(1, self.workers)

    def run(self, jobs: Sequence[Job]) -> Iterator[tuple[int, Ending]]:
        """Yield the index of each job and how it ended; when the caller stops early, so do the jobs."""
        pool, live = ThreadPoolExecutor(self.slots), set[subprocess.Popen]()
        futures = {pool.submit(run_apart, job, live): index for index, job in enumerate(jobs)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            while any(future.running() for future in futures):
                for process in tuple(live):
                    end(process)
                time.sleep(0.01)


class OnDask:
    """The workers of a Dask scheduler; nlpweld is installed on each of them, and each thread takes one job."""

    def __init__(self, address: str, workers: int = 1) -> None:
        """Connect.

        Args:
            address: of the scheduler, or ``local`` for a cluster on this machine.
            workers: of the local cluster.

        Raises:
            OptionError: Dask is not installed, or nobody answers at the address.
        """
        try:
            import distributed
        except ImportError:
            raise missing("--scheduler: Dask", "dask") from None
        self._cluster: Any = None
        try:
            if address == "local":
                self._cluster = distributed.LocalCluster(
                    n_workers=workers, threads_per_worker=1, dashboard_address=None
                )
            self._client = distributed.Client(self._cluster or address, timeout=ANSWER_S)
        except (OSError, ValueError, TypeError) as error:
            why = str(error).splitlines()[0] if str(error) else type(error).__name__
            hint = "start one with 'dask scheduler' or leave --scheduler out"
            raise OptionError(f"--scheduler {address}: nobody answers ({why}); {hint}") from None

    @property
    def slots(self) -> int:
        """Jobs under way at once."""
        return max(1, sum(self._client.nthreads().values()))

    def run(self, jobs: Sequence[Job]) -> Iterator[tuple[int, Ending]]:
        """Yield the index of each job and how it ended; closes the connection at the end."""
        import distributed

        try:
            futures = self._client.map(run_apart, jobs, pure=False, retries=1)
            index = {future.key: i for i, future in enumerate(futures)}
            for future, ending in distributed.as_completed(futures, with_results=True):
                yield index[future.key], ending
        finally:
            self._client.close()
            if self._cluster is not None:
                self._cluster.close()


def engine_of(workers: int = 1, scheduler: str | None = None) -> Engine:
    """Return where to run: so many processes of this machine, or the workers of a scheduler.

    Raises:
        OptionError: Dask is not installed, or nobody answers at the address.
    """
    return Local(workers) if scheduler is None else OnDask(scheduler, workers)
