"""Dispatch of missing trials to an executor: the order in which several runners share them, batches, crashed workers,
and the outcomes as they come.
"""

import fcntl
import os
import random
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from armlab.common.errors import InputError
from bench.errors import StoppedError, TrialsFailedError
from bench.execute import Failure, Outcome, Trial
from bench.executors.contract import BatchExecutor, ExecutorSettings, Work, WorkReport
from bench.executors.local import local_executor
from bench.plan import Entry
from bench.store import RunStore

_TRIALS_PER_BLOCK = 50  # trials that stay together, since neighbours have their problem in common


@contextmanager
def claim_order(entries: Sequence[Entry], store: Path) -> Iterator[Iterator[Entry]]:
    """The entries in the order in which this runner should take them; the lock of a dead runner is no lock."""
    folder = os.open(store.parent, os.O_RDONLY)
    try:
        yield iter(entries) if _try_lock(folder) else _shuffle_blocks(entries)
    finally:
        os.close(folder)


def _try_lock(folder: int) -> bool:
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another has it, or the file system knows no locks
        return False
    return True


def _shuffle_blocks(entries: Sequence[Entry]) -> Iterator[Entry]:
    chance = random.Random()  # unlike that of every other runner; no outcome depends on it
    starts = range(0, len(entries), _TRIALS_PER_BLOCK)
    late = sorted(starts, key=lambda start: (2 * start < len(entries), chance.random()))  # where the first is not yet
    for start in late:
        block = entries[start : start + _TRIALS_PER_BLOCK]
        yield from chance.sample(block, len(block))  # two runners in one block are not in step either


@dataclass
class _BatchQueue:
    """What is left to submit: the batches of the plan and, first, those that must run alone.

    alone: keys of the first trials of batches with which a worker died once; shared: of those that were under way
    together with others, so that the worker may have died with another. Settled ones are taken out of both.
    """

    batches: Iterator[Work]
    suspects: deque[Work] = field(default_factory=deque)
    alone: set[str] = field(default_factory=set)
    shared: set[str] = field(default_factory=set)

    def next(self, under_way: Collection[Work]) -> Work | None:
        """None where nothing is left, or where a suspect has or waits for the workers."""
        if any(work[0][0] in self.alone for work in under_way):
            return None
        if self.suspects:
            return None if under_way else self.suspects.popleft()
        work = next(self.batches, None)
        if work and under_way:
            self.shared |= {one[0][0] for one in (work, *under_way)}
        return work

    def suspect(self, work: Work) -> None:
        self.alone.add(work[0][0])
        self.suspects.append(work)

    def mark_settled(self, work: Work) -> None:
        self.alone.discard(work[0][0])
        self.shared.discard(work[0][0])


def stream_reports(
    batches: Iterator[Work], engine: BatchExecutor, timeout_s: float | None = None
) -> Iterator[WorkReport]:
    """Reports in the order in which they come; no more than `engine.slots` batches are under way.

    Where a worker dies, all that may be the cause runs once more, one batch at a time; the batch that dies again is
    taken apart; and the trial that dies alone is reported as a failure. An innocent one gets its outcome.
    """
    trials = _BatchQueue(batches)
    under_way: dict[Future[WorkReport], Work] = {}
    while True:
        while len(under_way) < engine.slots and (work := trials.next(under_way.values())) is not None:
            under_way[engine.submit(work)] = work
        if not under_way:
            return
        for future in wait(under_way, return_when=FIRST_COMPLETED).done:
            work = under_way.pop(future)
            try:
                report = future.result()
            except engine.crashes:
                report = _handle_crash(work, trials, timeout_s)
            else:
                trials.mark_settled(work)
            yield report


def _handle_crash(work: Work, trials: _BatchQueue, timeout_s: float | None) -> WorkReport:
    """What is known now: nothing, unless a trial was alone."""
    first = work[0][0]
    if first not in trials.alone and (first in trials.shared or len(work) == 1):
        trials.suspect(work)
        return WorkReport([], "")
    trials.mark_settled(work)
    if len(work) == 1:
        ((key, trial),) = work
        return WorkReport([(key, Failure(trial, _worker_lost_message(timeout_s)))], "")
    for one in work:
        trials.suspect([one])
    return WorkReport([], "")


def _worker_lost_message(timeout_s: float | None) -> str:
    limit = "" if timeout_s is None else f", or it takes longer than trial_timeout_s = {timeout_s:g}"
    return f"WorkerLostError: twice the worker process died with this trial: something kills it{limit}"


_CLUSTER_EXECUTORS = {
    "dask": ("bench.executors.dask_cluster", "dask_executor"),
    "ray": ("bench.executors.ray_cluster", "ray_executor"),
}


@contextmanager
def open_executor(executor: ExecutorSettings, workers: int, timeout_s: float | None) -> Iterator[BatchExecutor]:
    """The engine of these settings, for the time of a run. workers: processes where no cluster is named.

    Raises InputError, in one line, for a missing package and for a cluster that does not answer.
    """
    if executor.backend == "loky":
        with local_executor(workers, timeout_s) as made:
            yield made
        return
    module, name = _CLUSTER_EXECUTORS[executor.backend]
    try:
        make = getattr(import_module(module), name)
    except ModuleNotFoundError as error:
        raise InputError(
            f"executor '{executor.backend}' needs the package '{error.name}': pip install 'armlab[cluster]'"
        ) from None
    with make(executor.address, workers, timeout_s) as made:
        yield made


EVALUATIONS_PER_BATCH = 20_000  # some tenths of a second: long beside a commit, short beside a lost batch
_MAX_FAILURES_LISTED = 100  # one by one


@dataclass
class Failures:
    """How many trials failed, and the first of them."""

    count: int = 0
    told: list[Failure] = field(default_factory=list)

    def add(self, failures: Sequence[Failure]) -> None:
        """Count failures; keep no more than can be read."""
        self.count += len(failures)
        self.told += failures[: _MAX_FAILURES_LISTED - len(self.told)]


def missing_entries(entries: Iterable[Entry], store: RunStore, under_way: Collection[str] = ()) -> Iterator[Entry]:
    """The entries without an outcome at the time when each is looked at, nor under way, in their order."""
    for entry in entries:
        if entry.key not in under_way and not store.has(entry.key):
            yield entry


def count_missing(entries: Iterable[Entry], store: RunStore) -> int:
    """How many entries have no outcome; a trial that stands there twice counts twice."""
    return sum(1 for _ in missing_entries(entries, store))


def run_missing(
    entries: Sequence[Entry],
    store: RunStore,
    workers: int,
    progress: Callable[[int], object] = lambda trials: None,
    executor: ExecutorSettings | None = None,
    timeout_s: float | None = None,
) -> None:
    """Run the entries that the store lacks; progress is told how many trials of each batch are over.

    workers: processes, where no cluster is named. timeout_s: after so long a trial is ended and counts as failed. On
    what trials are run changes no outcome.
    Raises StoppedError on Ctrl-C, and TrialsFailedError at the end if trials failed.
    """
    left, batches = _count_trials_and_batches(missing_entries(entries, store))
    try:
        chosen = open_executor(executor or ExecutorSettings(), min(workers, max(batches, 1)), timeout_s)
        with chosen as running, claim_order(entries, store.path) as ordered:
            failures = _run_batches(ordered, store, running, timeout_s, progress)
    except KeyboardInterrupt:
        still = count_missing(entries, store)
        raise StoppedError(
            f"stopped: {left - still} trials are finished and kept, {still} are left; "
            "the same command goes on from here"
        ) from None
    if failures.count:
        raise make_failure_error(failures)


def _count_trials_and_batches(waiting: Iterable[Entry]) -> tuple[int, int]:
    """How many trials, and how many batches they make."""
    trials = evaluations = 0
    for entry in waiting:
        trials += 1
        evaluations += entry.trial.evaluations
    return trials, -(-evaluations // EVALUATIONS_PER_BATCH)


def _run_batches(
    entries: Iterable[Entry],
    store: RunStore,
    running: BatchExecutor,
    timeout_s: float | None,
    progress: Callable[[int], object],
) -> Failures:
    """Keep the outcomes as they come; return the failures, which are never kept."""
    failures = Failures()
    under_way: set[str] = set()
    batches = _make_batches(missing_entries(entries, store, under_way), under_way)
    for report in stream_reports(batches, running, timeout_s):
        failures.add(_store_outcomes(report, store))
        under_way.difference_update(key for key, _ in report.results)
        progress(len(report.results))
    return failures


def _store_outcomes(report: WorkReport, store: RunStore) -> list[Failure]:
    outcomes = [(key, result) for key, result in report.results if isinstance(result, Outcome)]
    if outcomes:
        store.add(outcomes, report.origin)
    return [result for _, result in report.results if isinstance(result, Failure)]


def _make_batches(waiting: Iterable[Entry], under_way: set[str]) -> Iterator[Work]:
    """Trials in their order, cut where a batch has enough work to make up for its way to a worker."""
    batch: list[tuple[str, Trial]] = []
    evaluations = 0
    for entry in waiting:
        batch.append((entry.key, entry.trial))
        under_way.add(entry.key)
        evaluations += entry.trial.evaluations
        if evaluations >= EVALUATIONS_PER_BATCH:
            yield batch
            batch, evaluations = [], 0
    if batch:
        yield batch


def make_failure_error(failures: Failures) -> TrialsFailedError:
    """The error that lists failures, at least one, each with its trial."""
    first = failures.told[0]
    lines = [f"{failure.trial}: {failure.traceback.strip().splitlines()[-1]}" for failure in failures.told]
    lines += [f"and {failures.count - len(failures.told)} more"] if failures.count > len(failures.told) else []
    head = f"{failures.count} trials raised an error and are not kept; the first one:"
    return TrialsFailedError("\n".join([head, first.traceback, "all of them:", *lines]))
