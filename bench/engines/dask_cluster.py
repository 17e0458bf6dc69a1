"""On a Dask cluster; needs the extra `cluster`."""

from collections.abc import Iterator
from concurrent.futures import Executor as Pool
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from distributed import Client, KilledWorker, LocalCluster

from bench.engines.contract import Engine
from bench.engines.work import Report, Work, do_elsewhere
from problem.errors import InputError

_AHEAD = 2  # batches a worker, so that none waits for the next one
_SECONDS_TO_ANSWER = 30


@dataclass(frozen=True)
class Dask:
    """Batches through the client's own pool of futures. A batch whose worker dies is given to another by Dask itself,
    and is a crash when it has cost so many workers as the scheduler allows.
    """

    pool: Pool
    slots: int
    timeout_s: float | None
    crashes: tuple[type[BaseException], ...] = (KilledWorker,)

    def submit(self, work: Work) -> "Future[Report]":
        """A future of the batch."""
        return self.pool.submit(do_elsewhere, list(work), self.timeout_s)


@contextmanager
def dask_engine(address: str | None, workers: int, timeout_s: float | None) -> Iterator[Engine]:
    """A running cluster, or one of this machine for the time of the run.

    Raises InputError if no cluster answers, or its workers have several threads.
    """
    with _client(address, workers) as client:
        threads = client.nthreads()
        if any(count > 1 for count in threads.values()):
            raise InputError(
                f"the Dask workers at {address} have several threads, and processor time is counted by process: "
                "start them with `dask worker --nthreads 1 --nworkers N`"
            )
        with client.get_executor(pure=False) as pool:
            yield Dask(pool, _AHEAD * len(threads), timeout_s)


@contextmanager
def _client(address: str | None, workers: int) -> Iterator[Any]:
    if address is None:
        local = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
        with local as cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(address, timeout=_SECONDS_TO_ANSWER)
        client.wait_for_workers(1, timeout=_SECONDS_TO_ANSWER)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask cluster with a worker answers at {address}: {error}".splitlines()[0]) from None
    with client:
        yield client
