"""Dispatch of missing trials to an executor: the order in which several runners share them, batches, crashed workers,
and the reports as they come.
"""

import fcntl
import os
import random
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue

from bench.execute import Failure, Trial
from bench.executors.contract import BatchExecutor, Work, WorkReport
from bench.plan import Entry
from bench.store import RunStore

EVALUATIONS_PER_BATCH = 20_000  # some tenths of a second: long beside a commit, short beside a lost batch
_TRIALS_PER_BLOCK = 50  # trials that stay together, since neighbours have their problem in common


@contextmanager
def claim_order(entries: Sequence[Entry], store: Path) -> Iterator[Iterator[Entry]]:
    """The entries in the order in which this runner should take them.

    The first runner on a store takes them in their order and locks the folder; every other runner shuffles them. The
    operating system takes the lock from a dead runner.
    """
    folder = os.open(store.parent, os.O_RDONLY)
    try:
        yield iter(entries) if _try_lock(folder) else _shuffle_blocks(entries)
    finally:
        os.close(folder)


def _try_lock(folder: int) -> bool:
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another runner has it, or the file system has no locks
        return False
    return True


def _shuffle_blocks(entries: Sequence[Entry]) -> Iterator[Entry]:
    """The second half of the blocks first, which the first runner reaches last."""
    chance = random.Random()  # differs between runners; no outcome depends on it
    starts = range(0, len(entries), _TRIALS_PER_BLOCK)
    for start in sorted(starts, key=lambda start: (2 * start < len(entries), chance.random())):
        block = entries[start : start + _TRIALS_PER_BLOCK]
        yield from chance.sample(block, len(block))  # two runners in one block do not compute the same trial


def missing_entries(entries: Iterable[Entry], store: RunStore, under_way: Collection[str] = ()) -> Iterator[Entry]:
    """The entries that have no outcome in the store and are not under way, each looked up when its turn comes."""
    for entry in entries:
        if entry.key not in under_way and not store.has(entry.key):
            yield entry


def count_missing(entries: Iterable[Entry], store: RunStore) -> int:
    """How many entries have no outcome; an entry that is listed twice counts twice."""
    return sum(1 for _ in missing_entries(entries, store))


def count_missing_work(entries: Iterable[Entry], store: RunStore) -> tuple[int, int]:
    """How many entries have no outcome, and how many batches they make."""
    trials = evaluations = 0
    for entry in missing_entries(entries, store):
        trials += 1
        evaluations += entry.trial.evaluations
    return trials, -(-evaluations // EVALUATIONS_PER_BATCH)


def execute_missing(
    entries: Iterable[Entry], store: RunStore, executor: BatchExecutor, timeout_s: float | None
) -> Iterator[WorkReport]:
    """Run the entries that the store lacks; yields the report of each batch when it is done.

    The caller stores the outcomes of a report before it asks for the next one. timeout_s: the limit that the executor
    sets each trial, for the message about a lost worker.
    """
    under_way: set[str] = set()
    batches = _make_batches(missing_entries(entries, store, under_way), under_way)
    for report in stream_reports(batches, executor, timeout_s):
        yield report
        under_way.difference_update(key for key, _ in report.results)


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


@dataclass
class _BatchQueue:
    """What is left to submit: the batches of the plan and, before them, the suspects, which must run alone.

    A batch is known by the key of its first trial. alone: batches with which a worker died once. shared: batches that
    were under way together with others, so that the worker may have died of another one. A settled batch leaves both.
    """

    batches: Iterator[Work]
    suspects: deque[Work] = field(default_factory=deque)
    alone: set[str] = field(default_factory=set)
    shared: set[str] = field(default_factory=set)

    def next(self, under_way: Collection[Work]) -> Work | None:
        """None where nothing is left, or where a suspect occupies the executor or waits until it is empty."""
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
    batches: Iterator[Work], executor: BatchExecutor, timeout_s: float | None = None
) -> Iterator[WorkReport]:
    """Reports in the order in which they come; no more than `executor.slots` batches are under way.

    If a worker dies, every batch that may be the cause runs once more, alone. A batch with which a worker dies again
    is split into its trials. A trial with which a worker dies alone is reported as a failure; all others get their
    outcome.
    """
    queue, done = _BatchQueue(batches), SimpleQueue[Future[WorkReport]]()  # in order; a wait for all looks at each
    under_way: dict[Future[WorkReport], Work] = {}
    while True:
        while len(under_way) < executor.slots and (work := queue.next(under_way.values())) is not None:
            future = executor.submit(work)
            under_way[future] = work
            future.add_done_callback(done.put)
        if not under_way:
            return
        future = done.get()
        work = under_way.pop(future)
        try:
            report = future.result()
        except executor.crashes:
            report = _handle_crash(work, queue, timeout_s)
        else:
            queue.mark_settled(work)
        yield report


def _handle_crash(work: Work, queue: _BatchQueue, timeout_s: float | None) -> WorkReport:
    """The report of a batch with which a worker died: empty, unless the batch was one trial and ran alone."""
    first = work[0][0]
    if first not in queue.alone and (first in queue.shared or len(work) == 1):
        queue.suspect(work)
        return WorkReport([], "")
    queue.mark_settled(work)
    if len(work) == 1:
        ((key, trial),) = work
        return WorkReport([(key, Failure(trial, _worker_lost_message(timeout_s)))], "")
    for one in work:
        queue.suspect([one])
    return WorkReport([], "")


def _worker_lost_message(timeout_s: float | None) -> str:
    limit = "" if timeout_s is None else f", or it takes longer than trial_timeout_s = {timeout_s:g}"
    return f"WorkerLostError: the worker process died twice with this trial: something kills it{limit}"
