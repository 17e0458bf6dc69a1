"""Runs what is missing in the store, on the engine that is asked for, and keeps every outcome as it comes."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from bench.engines.choice import engine
from bench.engines.contract import Engine, Executor
from bench.engines.work import Report, Work
from bench.errors import StoppedError, TrialsFailedError
from bench.execute import Failure
from bench.outcome import Outcome
from bench.plan import Entry
from bench.shared_work import shared_out
from bench.store import RunStore
from bench.stream import stream
from bench.trial import Trial

EVALUATIONS_PER_BATCH = 20_000  # some tenths of a second: long beside a commit, short beside a lost batch
_FAILURES_TOLD = 100  # one by one


@dataclass
class Failures:
    """How many trials failed, and the first of them."""

    count: int = 0
    told: list[Failure] = field(default_factory=list)

    def add(self, failures: Sequence[Failure]) -> None:
        """Count failures; keep no more than can be read."""
        self.count += len(failures)
        self.told += failures[: _FAILURES_TOLD - len(self.told)]


def missing(entries: Iterable[Entry], store: RunStore, under_way: Collection[str] = ()) -> Iterator[Entry]:
    """The entries without an outcome at the time when each is looked at, nor under way, in their order."""
    for entry in entries:
        if entry.key not in under_way and not store.has(entry.key):
            yield entry


def count_missing(entries: Iterable[Entry], store: RunStore) -> int:
    """How many entries have no outcome; a trial that stands there twice counts twice."""
    return sum(1 for _ in missing(entries, store))


def run_missing(
    entries: Sequence[Entry],
    store: RunStore,
    workers: int,
    progress: Callable[[int], object] = lambda trials: None,
    executor: Executor | None = None,
    timeout_s: float | None = None,
) -> None:
    """Run the entries that the store lacks; progress is told how many trials of each batch are over.

    workers: processes, where no cluster is named. timeout_s: after so long a trial is ended and counts as failed. On
    what trials are run changes no outcome.
    Raises StoppedError on Ctrl-C, and TrialsFailedError at the end if trials failed.
    """
    left, batches = _amount(missing(entries, store))
    try:
        chosen = engine(executor or Executor(), min(workers, max(batches, 1)), timeout_s)
        with chosen as running, shared_out(entries, store.path) as ordered:
            failures = _run(ordered, store, running, timeout_s, progress)
    except KeyboardInterrupt:
        still = count_missing(entries, store)
        raise StoppedError(
            f"stopped: {left - still} trials are finished and kept, {still} are left; "
            "the same command goes on from here"
        ) from None
    if failures.count:
        raise trials_failed(failures)


def _amount(waiting: Iterable[Entry]) -> tuple[int, int]:
    """How many trials, and how many batches they make."""
    trials = evaluations = 0
    for entry in waiting:
        trials += 1
        evaluations += entry.trial.evaluations
    return trials, -(-evaluations // EVALUATIONS_PER_BATCH)


def _run(
    entries: Iterable[Entry],
    store: RunStore,
    running: Engine,
    timeout_s: float | None,
    progress: Callable[[int], object],
) -> Failures:
    """Keep the outcomes as they come; return the failures, which are never kept."""
    failures = Failures()
    under_way: set[str] = set()
    batches = _batches(missing(entries, store, under_way), under_way)
    for report in stream(batches, running, timeout_s):
        failures.add(_keep(report, store))
        under_way.difference_update(key for key, _ in report.results)
        progress(len(report.results))
    return failures


def _keep(report: Report, store: RunStore) -> list[Failure]:
    outcomes = [(key, result) for key, result in report.results if isinstance(result, Outcome)]
    if outcomes:
        store.add(outcomes, report.origin)
    return [result for _, result in report.results if isinstance(result, Failure)]


def _batches(waiting: Iterable[Entry], under_way: set[str]) -> Iterator[Work]:
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


def trials_failed(failures: Failures) -> TrialsFailedError:
    """The error that lists failures, at least one, each with its trial."""
    first = failures.told[0]
    lines = [f"{failure.trial}: {failure.traceback.strip().splitlines()[-1]}" for failure in failures.told]
    lines += [f"and {failures.count - len(failures.told)} more"] if failures.count > len(failures.told) else []
    head = f"{failures.count} trials raised an error and are not kept; the first one:"
    return TrialsFailedError("\n".join([head, first.traceback, "all of them:", *lines]))
