"""The flow of one experiment, from its configuration to its results; and what a run would do, without doing it."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import yaml

from algorithms.registry import is_our_code
from armlab.common.documents import ResultLines
from bench.config import Configuration, Experiment, place_of, read_experiment
from bench.dispatch import claim_order, count_missing, count_missing_work, execute_missing, stream_reports
from bench.errors import StoppedError, TrialsFailedError
from bench.execute import Failure, Trial, stated_params
from bench.executors.choice import open_executor
from bench.executors.contract import BatchExecutor, ExecutorSettings
from bench.executors.local import local_executor
from bench.files import check_folder
from bench.plan import Entry, Plan, Series, plan_trials
from bench.store import RunStore, open_store
from problem.registry import is_plug_in as is_plug_in_problem


class Progress(Protocol):
    """Shows the user how far a run is, e.g. a tqdm bar."""

    def update(self, n: int) -> object: ...


ProgressBar = Callable[[int, int], AbstractContextManager[Progress]]
"""Makes a progress bar from the number of all trials and of those already done."""


@dataclass(frozen=True)
class RunOptions:
    """How an experiment is run; nothing here changes a result.

    store: file of the run store. results: folder of the result files. workers: processes, where no cluster is named.
    fresh: forget the stored outcomes and compute them again. overwrite: replace results of another configuration.
    executor: replaces the one of the configuration.
    """

    store: Path
    results: Path
    workers: int
    fresh: bool = False
    overwrite: bool = False
    executor: ExecutorSettings | None = None


def run_experiment(configuration: Configuration, options: RunOptions, bar: ProgressBar) -> list[Path]:
    """Run the missing trials of a configuration and write its results; returns the written files.

    Where trials failed, the results of all others are written, with the failed ones counted as losses, and
    TrialsFailedError names the files. Raises InputError and StoppedError; finished trials stay in the store in any
    case.
    """
    loaded = load_experiment(configuration)  # validate the configuration, plan its trials
    experiment, entries = loaded.experiment, loaded.entries
    check_folder(options.results, experiment.name, loaded.settings, options.overwrite)
    with open_store(options.store) as store:
        if options.fresh:
            store.forget(entry.key for entry in entries)
        missing = count_missing(entries, store)  # look up the finished ones
        failed: TrialsFailedError | None = None
        with bar(len(entries), len(entries) - missing) as progress:
            try:
                run_missing(  # execute and store
                    entries,
                    store,
                    options.workers,
                    progress=progress.update,
                    executor=options.executor or experiment.executor,
                    timeout_s=experiment.trial_timeout_s,
                    continued_by="the same command without --fresh" if options.fresh else "the same command",
                )
            except TrialsFailedError as error:
                failed = error
        from bench.results import write_results  # pandas takes longer to import than a small run

        written = write_results(experiment, entries, loaded.settings, store, options.results)  # tables and figures
    if failed is not None:
        raise TrialsFailedError(str(failed), tuple(written))
    return written


def report_run(path: Path, options: RunOptions, bar: ProgressBar) -> ResultLines:
    """Run a configuration; tells the table, who beats whom, and the written files.

    The document has the rows of the tables among the files.
    """
    failed: TrialsFailedError | None = None
    try:
        written = run_experiment(path, options, bar)
    except TrialsFailedError as error:
        failed, written = error, list(error.written)
    from bench.tables import tidy_frame
    from bench.terminal import describe_frame

    with open_store(options.store) as store:
        yield from describe_frame(tidy_frame(load_experiment(path).entries, store))
    yield from map(str, written)
    if failed is not None:
        raise failed
    from pandas import read_csv

    tables = {file.name: read_csv(file).to_dict("records") for file in written if file.suffix == ".csv"}
    return {"name": load_experiment(path).experiment.name, "files": written, "tables": tables}


@dataclass(frozen=True)
class LoadedExperiment:
    """A configuration, its trials, and its full settings with every default, as YAML text."""

    experiment: Experiment
    entries: Plan
    settings: str


def load_experiment(configuration: Configuration) -> LoadedExperiment:
    """Read and check a configuration and plan its trials; raises InputError, in one line, for any mistake in it."""
    experiment = read_experiment(configuration)
    entries = plan_trials(experiment, place_of(configuration))
    return LoadedExperiment(experiment, entries, _settings_text(experiment, entries))


def _settings_text(experiment: Experiment, entries: Plan) -> str:
    """Without what changes no outcome: results of a cluster and of a laptop are the same."""
    firsts = entries.first_entries()
    problems = {entry.problem: entry.trial.problem.model_dump(mode="json") for entry in firsts}
    algorithms = {
        entry.algorithm: {"name": entry.trial.algorithm, "params": stated_params(entry.trial.params)}
        for entry in firsts
    }
    settings = experiment.model_dump(
        mode="json",
        exclude_none=True,
        exclude={"executor": True, "trial_timeout_s": True, "problem": {"__all__": {"settings"}}},
    )
    settings |= {"problem": problems, "algorithms": algorithms}
    text: str = yaml.safe_dump(json.loads(json.dumps(settings)), sort_keys=False, allow_unicode=True)
    return text


def run_missing(
    entries: Sequence[Entry],
    store: RunStore,
    workers: int,
    *,
    progress: Callable[[int], object] = lambda trials: None,
    executor: ExecutorSettings | None = None,
    timeout_s: float | None = None,
    continued_by: str = "the same command",
) -> None:
    """Run the entries that the store lacks and store each outcome as it comes; a failure is never stored.

    workers: processes, where no cluster is named. progress: is called with the number of trials of each batch that is
    done. timeout_s: a trial that takes longer is ended and counts as failed. None of them changes an outcome.
    continued_by: what goes on after Ctrl-C.
    Raises StoppedError on Ctrl-C, and TrialsFailedError at the end if trials failed.
    """
    missing, batches = count_missing_work(entries, store)
    trials = [entry.trial for entry in (entries.first_entries() if isinstance(entries, Plan) else entries)]
    failures = _Failures()
    try:
        with (
            open_executor(
                executor or ExecutorSettings(), min(workers, max(batches, 1)), timeout_s, _needs_isolation(trials)
            ) as opened,
            claim_order(entries, store.path) as ordered,
        ):
            for report in execute_missing(ordered, store, opened, timeout_s):
                if report.outcomes:
                    store.add(report.outcomes, report.origin)
                if report.failures:
                    store.note_failures((key, failure.reason) for key, failure in report.failures)
                    failures.add([failure for _, failure in report.failures])
                progress(len(report.results))
    except KeyboardInterrupt:
        left = count_missing(entries, store)
        raise StoppedError(
            f"stopped: {missing - left} trials are finished and kept, {left} are left; {continued_by} goes on from here"
        ) from None
    if failures.count:
        raise failures.error()


def _needs_isolation(trials: Iterable[Trial]) -> bool:
    """Whether code of another package takes part, which may end its process: that is never the command's own."""
    return any(not is_our_code(trial.algorithm) or is_plug_in_problem(trial.problem) for trial in trials)


_MAX_REASONS_LISTED = 100


@dataclass
class _Failures:
    """How many trials failed, their repetitions by series and reason, and the first traceback."""

    count: int = 0
    repetitions: dict[tuple[str, str], list[int]] = field(default_factory=dict)
    traceback: str = ""

    def add(self, failures: Sequence[Failure]) -> None:
        """Count failures; those of one series with one reason are one line."""
        self.count += len(failures)
        for failure in failures:
            self.traceback = self.traceback or failure.traceback
            self.repetitions.setdefault((failure.trial.series_text, failure.reason), []).append(
                failure.trial.repetition
            )

    def error(self) -> TrialsFailedError:
        """The error that lists the failures, at least one; one line where all have one reason without a traceback."""
        lines = [
            f"{series}, repetition {', '.join(map(str, sorted(which)))}: {reason}"
            for (series, reason), which in self.repetitions.items()
        ]
        head = f"{self.count} {'trials' if self.count > 1 else 'trial'} failed, which count as losses and are not kept"
        if len(lines) == 1 and not self.traceback:
            return TrialsFailedError(f"{head}: {lines[0]}")
        more = len(lines) - _MAX_REASONS_LISTED
        lines[_MAX_REASONS_LISTED:] = [f"and {more} lines more"] if more > 0 else []
        first = ["the first traceback:", self.traceback] if self.traceback else []
        return TrialsFailedError("\n".join([f"{head}:", *first, *lines]))


_TIMED_POPULATIONS = 4


def describe_run(path: Path, options: RunOptions) -> ResultLines:
    """Lines that list the trials of a configuration and estimate the time; nothing is run or stored."""
    loaded = load_experiment(path)
    entries = loaded.entries
    missing = _count_missing_by_series(entries, options)
    for series in entries.series:
        yield _describe_series(series, entries.repetitions, missing[series])
    total = sum(missing.values())
    yield f"{len(entries)} trials, {len(entries) - total} done, {total} to do"
    seconds = _estimate_seconds(missing) / options.workers
    yield f"about {seconds:.1f} s on {options.workers} cores, if otherwise idle, start not counted"
    counts = {"trials": len(entries), "done": len(entries) - total, "to_do": total}
    return {"name": loaded.experiment.name, **counts, "seconds": seconds, "workers": options.workers}


def _count_missing_by_series(entries: Plan, options: RunOptions) -> dict[Series, int]:
    """How many repetitions of each series are missing."""
    if options.fresh or not options.store.exists():
        return dict.fromkeys(entries.series, entries.repetitions)
    with open_store(options.store) as store:
        return {
            series: count_missing(map(series.entry, range(entries.repetitions)), store) for series in entries.series
        }


def _describe_series(series: Series, repetitions: int, missing: int) -> str:
    trial = series.first
    return (
        f"{series.problem}: {series.algorithm}, swarm size {trial.swarm_size}, {trial.evaluations} evaluations: "
        f"{repetitions} repetitions, {repetitions - missing} done"
    )


def _estimate_seconds(missing: Mapping[Series, int]) -> float:
    """Seconds on one core, from a few timed populations of each series."""
    seconds = 0.0
    firsts = [series.first for series, count in missing.items() if count]
    with local_executor(1, None, _needs_isolation(firsts)) as executor:
        for series, count in missing.items():
            if count:
                seconds += count * _time_trial(series, executor)
    return seconds


def _time_trial(series: Series, executor: BatchExecutor) -> float:
    """Seconds of a trial; raises TrialsFailedError where it fails."""
    trial = series.first
    short = replace(trial, evaluations=min(trial.evaluations, _TIMED_POPULATIONS * trial.swarm_size))
    work = [(each.key(series.code), each) for each in (short, replace(short, repetition=1))]  # to warm, and to time
    reports = list(stream_reports(iter([work]), executor))
    failures = [failure for report in reports for _, failure in report.failures]
    if failures:
        found = _Failures()
        found.add(failures[:1])
        raise found.error()
    outcome = reports[-1].outcomes[-1][1]
    return outcome.seconds / outcome.evaluations * trial.evaluations
