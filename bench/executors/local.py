"""Executors on this machine: in this process, or in processes of loky, the engine of joblib."""

import os
import queue
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from joblib.externals.loky.process_executor import BrokenProcessPool, ProcessPoolExecutor

from bench.executors.contract import BatchExecutor, Work, WorkReport, run_in_worker, run_work

_ONE_THREAD_ENVIRONMENT = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1"
)
_BATCHES_PER_WORKER = 2  # batches a worker, so that none waits for the next one
_FEEDER_WAIT_S = 5.0  # it has nothing to do any more, and ends at once
_POLL_INTERVAL_S = 1.0  # long against the milliseconds in which loky sees that a worker died


class InProcessExecutor:
    """Runs each batch at once, in this process."""

    slots = 1
    crashes: tuple[type[BaseException], ...] = ()

    def submit(self, work: Work) -> "Future[WorkReport]":
        """A future that is done already."""
        future: Future[WorkReport] = Future()
        future.set_result(run_work(work))
        return future


@dataclass
class LokyExecutor:
    """A pool of loky's processes, one BLAS thread each; a pool that broke because a worker died is replaced.

    The pool belongs to this executor. loky's reusable pool is shared by the whole process, and `joblib.Parallel` would
    take it for its own.
    """

    workers: int
    timeout_s: float | None
    crashes: tuple[type[BaseException], ...] = (BrokenProcessPool,)
    pool: Any = field(init=False)

    def __post_init__(self) -> None:
        self.pool = self._start_pool()

    @property
    def slots(self) -> int:
        """How many batches are submitted at a time."""
        return _BATCHES_PER_WORKER * self.workers

    def submit(self, work: Work) -> "Future[WorkReport]":
        try:
            return self._submit_to_pool(work)
        except BrokenProcessPool:
            self.end()
            self.pool = self._start_pool()
            return self._submit_to_pool(work)

    def end(self) -> None:
        """Kill the workers, whatever they do.

        Workers that are asked to end read this from a queue that they share. If one dies while it reads, the queue
        stays locked, and the others never end. Work that no worker has taken is removed from loky's list first: loky
        deletes its records of all work before it reads this list once more, and fails where a record is missing.
        loky does not wait for the thread that feeds its workers. Python could end while that thread, the last to use
        the semaphores of the queue, removes them; loky's tracker of resources would then warn of a leak.
        """
        with suppress(queue.Empty):
            while True:
                self.pool._work_ids.get_nowait()
        feeder = getattr(self.pool._call_queue, "_thread", None)  # none before the first work, or after the end
        self.pool.shutdown(wait=True, kill_workers=True)
        if feeder is not None:
            feeder.join(_FEEDER_WAIT_S)

    def _submit_to_pool(self, work: Work) -> "Future[WorkReport]":
        future: Future[WorkReport] = self.pool.submit(run_in_worker, list(work), self.timeout_s)
        return future

    def _start_pool(self) -> Any:
        return ProcessPoolExecutor(
            self.workers, initializer=_prepare_worker, initargs=(os.getpid(),), env=_ONE_THREAD_ENVIRONMENT
        )


@contextmanager
def local_executor(workers: int, timeout_s: float | None, isolated: bool = False) -> Iterator[BatchExecutor]:
    """Processes on this machine; a single worker without a time limit is this process itself, unless isolated."""
    if workers == 1 and timeout_s is None and not isolated:
        yield InProcessExecutor()
        return
    executor = LokyExecutor(workers, timeout_s)
    over = threading.Event()
    watcher = threading.Thread(target=_watch_workers, args=(executor, over), daemon=True)
    watcher.start()
    try:
        yield executor
    finally:
        executor.end()
        over.set()
        watcher.join()  # it, too, refers to the pool and its semaphores


def _watch_workers(executor: LokyExecutor, over: threading.Event) -> None:
    """Break a pool that has not noticed for a while that a worker died.

    A worker that dies while it writes a report leaves a part of it in the pipe. loky then waits for the rest without
    end, because this process holds the pipe open itself.
    """
    before: set[int] = set()
    while not over.wait(_POLL_INTERVAL_S):
        pool = executor.pool
        workers = dict(pool._processes or {})
        dead = {pid for pid, worker in workers.items() if worker.exitcode is not None}
        if dead & before:
            for pid in workers.keys() - dead:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            pool._result_queue._writer.close()
        before = dead


def _prepare_worker(parent: int) -> None:
    """Ignore Ctrl-C, which a terminal sends to all processes: only the parent stops the work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, args=(parent,), daemon=True).start()


def _exit_with_parent(parent: int) -> None:
    """End this worker when its parent is gone: loky leaves the workers of a killed process running."""
    while os.getppid() == parent:
        time.sleep(_POLL_INTERVAL_S)
    os._exit(1)
