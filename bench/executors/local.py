"""Executors on this machine: in this process, or in processes of loky, the engine of joblib."""

import os
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
_POLL_INTERVAL_S = 1.0  # long against the milliseconds in which loky sees that a worker died


class InProcessExecutor:
    """One batch after the other, here."""

    slots = 1
    crashes: tuple[type[BaseException], ...] = ()

    def submit(self, work: Work) -> "Future[WorkReport]":
        """A future that is done."""
        future: Future[WorkReport] = Future()
        future.set_result(run_work(work))
        return future


@dataclass
class LokyExecutor:
    """A pool of loky's processes, one BLAS thread each; a pool that broke with a worker is replaced by a new one.

    The pool is this executor's own: loky's reusable pool is one for the whole process, and `joblib.Parallel` takes it
    for its own.
    """

    workers: int
    timeout_s: float | None
    crashes: tuple[type[BaseException], ...] = (BrokenProcessPool,)
    pool: Any = field(init=False)

    def __post_init__(self) -> None:
        self.pool = self._start_pool()

    @property
    def slots(self) -> int:
        """Batches under way."""
        return _BATCHES_PER_WORKER * self.workers

    def submit(self, work: Work) -> "Future[WorkReport]":
        """A future of the batch."""
        try:
            return self._submit_to_pool(work)
        except BrokenProcessPool:
            self.pool.shutdown(wait=True, kill_workers=True)
            self.pool = self._start_pool()
            return self._submit_to_pool(work)

    def _submit_to_pool(self, work: Work) -> "Future[WorkReport]":
        future: Future[WorkReport] = self.pool.submit(run_in_worker, list(work), self.timeout_s)
        return future

    def _start_pool(self) -> Any:
        return ProcessPoolExecutor(
            self.workers, initializer=_prepare_worker, initargs=(os.getpid(),), env=_ONE_THREAD_ENVIRONMENT
        )


@contextmanager
def local_executor(workers: int, timeout_s: float | None) -> Iterator[BatchExecutor]:
    """One worker is this process itself, unless a time limit might end it."""
    if workers == 1 and timeout_s is None:
        yield InProcessExecutor()
        return
    executor = LokyExecutor(workers, timeout_s)
    over = threading.Event()
    threading.Thread(target=_watch_workers, args=(executor, over), daemon=True).start()
    try:
        yield executor
    except BaseException:
        executor.pool.shutdown(wait=True, kill_workers=True)  # no one waits for what is under way any more
        raise
    else:
        executor.pool.shutdown(wait=True)
    finally:
        over.set()


def _watch_workers(executor: LokyExecutor, over: threading.Event) -> None:
    """Breaks a pool that has not noticed for a while that a worker died.

    A worker that dies while it writes a report leaves half of it in the pipe, and loky would wait for the other half
    for ever: this process holds the pipe open itself.
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
    """In a worker: a terminal sends Ctrl-C to all processes, but it is for the parent to stop the work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, args=(parent,), daemon=True).start()


def _exit_with_parent(parent: int) -> None:
    """A parent that is killed cannot stop its workers, and loky leaves them behind."""
    while os.getppid() == parent:
        time.sleep(_POLL_INTERVAL_S)
    os._exit(1)
