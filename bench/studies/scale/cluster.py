"""Many Dask workers, simulated in one process: what dispatch and scheduler cost a batch, and what runs out first.

A simulated worker is a real worker of `distributed`, with its own connections by TCP and its heartbeat, but it shares
one interpreter with all others and with the scheduler. So the cost of a batch through Dask is an upper bound of what
scheduler and its messages cost on a cluster, where workers have processors of their own. What a worker does to watch
itself is off: a sample of its stack a hundred times a second and a look at its event loop fifty times a second, times
a thousand, leaves nothing of the one interpreter: with it, and the usual 30 s, connections time out at 300 workers.
"""

import logging
import os
import resource
import time
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import MappingProxyType

import dask
from distributed import Client, LocalCluster

from bench.dispatch import stream_reports
from bench.executors.contract import BatchExecutor, Work, WorkReport, run_work
from bench.executors.dask_cluster import dask_executor
from bench.run import load_experiment
from bench.studies.scale.sweeps import ReportProgress, resident_mb

BATCHES = 400  # of one small trial each
JOINING = 50  # workers at a time, since one interpreter has to greet them all
START_TIMEOUT_S = 600.0  # of these
SHARED_INTERPRETER = MappingProxyType(
    {
        "distributed.worker.profile.enabled": False,
        "distributed.admin.tick.interval": "1h",
        "distributed.admin.system-monitor.interval": "1h",
        "distributed.comm.timeouts.connect": f"{START_TIMEOUT_S:.0f}s",
        "distributed.comm.timeouts.tcp": f"{START_TIMEOUT_S:.0f}s",
    }
)


@dataclass(frozen=True)
class SimulatedCluster:
    """What a number of workers cost; times a batch of one small trial, milliseconds.

    start_s: until all workers were there. search_ms: the trial alone. dispatch_ms: the dispatch alone, with as many
    batches under way as these workers have. dask_ms: all of it through Dask. memory_mb, files: more than before, of all
    workers and the scheduler. failure: why there are no numbers, empty where there are.
    """

    workers: int
    search_ms: float
    dispatch_ms: float
    start_s: float = float("nan")
    dask_ms: float = float("nan")
    memory_mb: float = float("nan")
    files: int = 0
    failure: str = ""


def simulate_clusters(config: Path, sizes: Sequence[int], tell: ReportProgress) -> list[SimulatedCluster]:
    """Clusters of several sizes, one after the other; tell: is called with a line about each."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)  # what closing a crowd of workers says
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    found = []
    for workers in sizes:
        found.append(_simulate(config, workers))
        tell(f"{workers} workers: {found[-1].failure or f'{found[-1].dask_ms:.1f} ms a batch'}")
    return found


def _simulate(config: Path, workers: int) -> SimulatedCluster:
    entries = islice(load_experiment(config).entries, BATCHES)
    batches: list[Work] = [[(entry.key, entry.trial)] for entry in entries]
    began = time.perf_counter()
    for work in batches[:100]:
        run_work(work)
    search = 1e3 * (time.perf_counter() - began) / len(batches[:100])
    dispatch = _batch_ms(batches, _InstantExecutor(2 * workers))
    memory, files = resident_mb(os.getpid()), _open_files()
    began = time.perf_counter()
    try:
        with (
            dask.config.set(SHARED_INTERPRETER),
            LocalCluster(
                n_workers=0,
                processes=False,
                threads_per_worker=1,
                protocol="tcp",
                memory_limit=None,
                dashboard_address=":0",
            ) as cluster,
            Client(cluster) as client,
        ):
            for count in range(min(JOINING, workers), workers + 1, min(JOINING, workers)):
                cluster.scale(count)
                client.wait_for_workers(count, timeout=START_TIMEOUT_S)
            started = time.perf_counter() - began
            with dask_executor(cluster.scheduler_address, 1, None) as executor:
                through = _batch_ms(batches, executor)
            more = resident_mb(os.getpid()) - memory, _open_files() - files
        return SimulatedCluster(workers, search, dispatch, started, through, *more)
    except CancelledError:
        return SimulatedCluster(workers, search, dispatch, failure="the command lost its connection to the scheduler")
    except (OSError, TimeoutError, RuntimeError) as error:
        return SimulatedCluster(workers, search, dispatch, failure=f"{type(error).__name__}: {error}".splitlines()[0])


def _batch_ms(batches: Sequence[Work], executor: BatchExecutor) -> float:
    """Milliseconds a batch, all of them, one after the other or together."""
    began = time.perf_counter()
    for _ in stream_reports(iter(batches), executor):
        pass
    return 1e3 * (time.perf_counter() - began) / len(batches)


@dataclass(frozen=True)
class _InstantExecutor:
    """An executor whose batches are done, with no results, when they are submitted."""

    slots: int
    crashes: tuple[type[BaseException], ...] = ()

    def submit(self, work: Work) -> "Future[WorkReport]":
        done: Future[WorkReport] = Future()
        done.set_result(WorkReport([], ""))
        return done


def _open_files() -> int:
    return len(os.listdir("/proc/self/fd"))
