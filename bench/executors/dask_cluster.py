"""The executor on a Dask cluster; needs the extra `cluster`."""

import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Future
from concurrent.futures import Executor as Pool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from distributed import Client, KilledWorker, LocalCluster
from distributed.comm.core import CommClosedError

from armlab.common.errors import InputError
from bench.executors.contract import BatchExecutor, Work, WorkReport, run_in_worker

_BATCHES_PER_WORKER = 2  # batches a worker, so that none waits for the next one
_CONNECT_TIMEOUT_S = 30
_COUNT_INTERVAL_S = 5.0  # between two counts of the workers


@dataclass(eq=False)
class DaskExecutor:
    """Batches through the client's own pool of futures.

    If a worker dies, Dask itself gives its batch to another one. It reports a crash after as many dead workers as the
    scheduler allows. Workers may join at any time, as the jobs of a queue begin: they are counted again and again.
    """

    client: Any
    pool: Pool
    address: str | None
    timeout_s: float | None
    crashes: tuple[type[BaseException], ...] = (KilledWorker,)
    counted: int = 0
    counted_at: float = -np.inf

    @property
    def slots(self) -> int:
        """Batches for all workers that are there; raises InputError if one has several threads."""
        if time.monotonic() - self.counted_at > _COUNT_INTERVAL_S:
            self.counted, self.counted_at = _count_workers(self.client, self.address), time.monotonic()
        return _BATCHES_PER_WORKER * max(self.counted, 1)

    def submit(self, work: Work) -> "Future[WorkReport]":
        return self.pool.submit(run_in_worker, list(work), self.timeout_s)


@contextmanager
def dask_executor(address: str | None, workers: int, timeout_s: float | None) -> Iterator[BatchExecutor]:
    """A running cluster, or a cluster on this machine for the time of the run.

    Raises InputError if no cluster answers or its scheduler is lost, or if its workers have several threads.
    """
    with _connect_client(address, workers) as client:
        _count_workers(client, address)
        try:
            with client.get_executor(pure=False) as pool:
                yield DaskExecutor(client, pool, address, timeout_s)
        except (CancelledError, CommClosedError):
            raise InputError(
                f"the Dask scheduler at {address or 'this machine'} was lost: start it and the same command again; "
                "what is finished stays"
            ) from None


def _count_workers(client: Any, address: str | None) -> int:
    threads = client.nthreads()
    if any(count > 1 for count in threads.values()):
        raise InputError(
            f"the Dask workers at {address} have several threads, and processor time is counted by process: "
            "start them with `dask worker --nthreads 1 --nworkers N`"
        )
    return len(threads)


@contextmanager
def _connect_client(address: str | None, workers: int) -> Iterator[Any]:
    if address is None:
        local = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
        with local as cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(address, timeout=_CONNECT_TIMEOUT_S)
        client.wait_for_workers(1, timeout=_CONNECT_TIMEOUT_S)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask cluster with a worker answers at {address}: {error}".splitlines()[0]) from None
    with client:
        yield client
