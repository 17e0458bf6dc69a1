"""What the dispatch of trials and an executor agree on: batches, reports, settings, and the work of a worker."""

import faulthandler
import os
import platform
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from functools import lru_cache
from typing import Annotated, Literal, NamedTuple, Protocol, Self

from pydantic import Field, model_validator
from threadpoolctl import threadpool_limits

from armlab.common.settings import Settings
from bench.execute import Failure, Outcome, Trial, load_algorithm, run_batch
from bench.fingerprint import fingerprint
from bench.provenance import provenance
from problem.registry import ProblemSettings

Work = Sequence[tuple[str, Trial]]
"""Trials, each with its key in the run store."""


class WorkReport(NamedTuple):
    """The results of a batch, trial by trial, and the provenance of the worker."""

    results: list[tuple[str, Outcome | Failure]]
    origin: str

    @property
    def outcomes(self) -> list[tuple[str, Outcome]]:
        """The outcomes, each with its key in the run store."""
        return [(key, result) for key, result in self.results if isinstance(result, Outcome)]

    @property
    def failures(self) -> list[tuple[str, Failure]]:
        """The trials that failed, each with its key."""
        return [(key, result) for key, result in self.results if isinstance(result, Failure)]


def run_work(work: Work, timeout_s: float | None = None) -> WorkReport:
    """Run trials one after the other; the process dies with a trial that takes longer than `timeout_s`.

    Linear algebra has one thread: more of them round otherwise, and the workers take all cores.
    """
    with threadpool_limits(1, user_api="blas"):
        results = [(key, _run_with_time_limit(key, trial, timeout_s)) for key, trial in work]
        return WorkReport(results, _worker_provenance())


def run_in_worker(work: Work, timeout_s: float | None = None) -> WorkReport:
    """`run_work` in a process of its own; a trial fails if its key was made with other code than this process has."""
    strangers = [
        (key, trial) for key, trial in work if trial.key(_code_fingerprint(trial.algorithm, trial.problem)) != key
    ]
    if strangers:
        return WorkReport(
            [(key, Failure(trial, _other_code_message())) for key, trial in strangers], _worker_provenance()
        )
    return run_work(work, timeout_s)


def _run_with_time_limit(key: str, trial: Trial, timeout_s: float | None) -> Outcome | Failure:
    with _time_limit(timeout_s):
        ((_, result),) = run_batch([(key, trial)])
    return result


@contextmanager
def _time_limit(timeout_s: float | None) -> Iterator[None]:
    """End the process if the block takes longer.

    The watchdog is a thread in C with a monotonic clock. It needs neither the interpreter's lock nor the main thread,
    so it also ends a loop in compiled code.
    """
    if timeout_s is None:
        yield
        return
    with open(os.devnull, "w") as nowhere:
        faulthandler.dump_traceback_later(timeout_s, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


@lru_cache(maxsize=512)
def _code_fingerprint(algorithm: str, problem: ProblemSettings) -> str:
    return fingerprint(load_algorithm(algorithm), problem)


def _other_code_message() -> str:
    return (
        f"OtherCodeError: the worker on {platform.node()} has other code or files, another release of a package, or "
        "(for an algorithm that calls LAPACK) another kernel of it, than the process that started the run"
    )


@lru_cache
def _worker_provenance() -> str:
    return provenance()


class ExecutorSettings(Settings):
    """backend: the executor. address: of a running cluster; without one, processes on this machine are started.

    Dask: `tcp://HOST:PORT` of the scheduler. Ray: `HOST:PORT` of the head, or `auto`.
    """

    backend: Literal["loky", "dask", "ray"] = "loky"
    address: Annotated[str, Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _address_of_a_cluster(self) -> Self:
        if self.backend == "loky" and self.address:
            raise ValueError("'address' should stand beside backend 'dask' or 'ray': loky works on this machine alone")
        return self


class BatchExecutor(Protocol):
    """Takes batches and returns futures of their reports.

    slots: how many batches keep all workers busy; no more are submitted at a time. crashes: errors that a future raises
    if its worker died.
    """

    @property
    def slots(self) -> int: ...

    @property
    def crashes(self) -> tuple[type[BaseException], ...]: ...

    def submit(self, work: Work) -> "Future[WorkReport]":
        """A future of the report; it may raise one of `crashes`."""
        ...
