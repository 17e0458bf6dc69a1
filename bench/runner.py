"""Runs what is missing in the store, on as many processes as asked, and keeps every outcome as it comes."""

import signal
from collections.abc import Callable, Iterable, Iterator, Sequence

from joblib import Parallel, delayed, parallel_config

from bench.errors import StoppedError, TrialsFailedError
from bench.execute import Failure, run_batch
from bench.outcome import Outcome
from bench.plan import Entry
from bench.provenance import provenance
from bench.store import RunStore
from bench.trial import Trial

EVALUATIONS_PER_BATCH = 20_000  # some tenths of a second: long beside a commit, short beside a lost batch


def missing(entries: Iterable[Entry], store: RunStore) -> list[Entry]:
    """The entries without an outcome; a trial that stands there twice comes once."""
    unique = {entry.key: entry for entry in entries}
    done = store.done(unique)
    return [entry for key, entry in unique.items() if key not in done]


def run_missing(
    entries: Sequence[Entry],
    store: RunStore,
    workers: int,
    progress: Callable[[int], object] = lambda trials: None,
) -> None:
    """Run the entries that the store lacks; progress is told how many trials of each batch are over.

    Raises StoppedError on Ctrl-C, and TrialsFailedError at the end if trials raised.
    """
    waiting = missing(entries, store)
    try:
        failures = _run(waiting, store, workers, progress)
    except KeyboardInterrupt:
        left = len(missing(waiting, store))
        raise StoppedError(
            f"stopped: {len(waiting) - left} trials are finished and kept, {left} are left; "
            "the same command goes on from here"
        ) from None
    if failures:
        raise trials_failed(failures)


def _run(waiting: Sequence[Entry], store: RunStore, workers: int, progress: Callable[[int], object]) -> list[Failure]:
    """Keep the outcomes as they come; return the failures, which are never kept."""
    source = provenance()
    failures: list[Failure] = []
    for results in _results(waiting, workers):
        outcomes = [(key, result) for key, result in results if isinstance(result, Outcome)]
        store.add(outcomes, source)
        failures += [result for _, result in results if isinstance(result, Failure)]
        progress(len(results))
    return failures


def _results(waiting: Sequence[Entry], workers: int) -> Iterator[list[tuple[str, Outcome | Failure]]]:
    """Results of batches in the order in which they are finished; one BLAS thread a worker."""
    batches = list(_batches(waiting))
    with parallel_config(backend="loky", inner_max_num_threads=1, initializer=_leave_ctrl_c_to_parent):
        parallel = Parallel(n_jobs=min(workers, max(len(batches), 1)), return_as="generator_unordered")
        yield from parallel(delayed(run_batch)(batch) for batch in batches)


def _leave_ctrl_c_to_parent() -> None:
    """In a worker: a terminal sends Ctrl-C to all processes, but it is for the parent to stop the work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _batches(waiting: Iterable[Entry]) -> Iterator[list[tuple[str, Trial]]]:
    """Trials in their order, cut where a batch has enough work to make up for its way to a worker."""
    batch: list[tuple[str, Trial]] = []
    for entry in waiting:
        batch.append((entry.key, entry.trial))
        if sum(trial.evaluations for _, trial in batch) >= EVALUATIONS_PER_BATCH:
            yield batch
            batch = []
    if batch:
        yield batch


def trials_failed(failures: Sequence[Failure]) -> TrialsFailedError:
    """The error that lists failures, at least one, each with its trial."""
    lines = [f"{failure.trial}: {failure.traceback.strip().splitlines()[-1]}" for failure in failures]
    head = f"{len(failures)} trials raised an error and are not kept; the first one:"
    return TrialsFailedError("\n".join([head, failures[0].traceback, "all of them:", *lines]))
