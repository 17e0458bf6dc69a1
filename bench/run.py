"""One experiment from its configuration to its results: check, run what is missing, write; or only list what a run
would do.
"""

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import yaml

from armlab.common.errors import InputError
from bench.config import Experiment, read_experiment
from bench.dispatch import Failures, count_missing, make_failure_error, run_missing
from bench.execute import Failure, run_batch
from bench.executors.contract import ExecutorSettings
from bench.files import check_folder
from bench.plan import Plan, Series, plan_trials, rival_pairs
from bench.store import open_store


class Progress(Protocol):
    """What tells the user how far a run is, e.g. a tqdm bar."""

    def update(self, n: int) -> object: ...


ProgressBar = Callable[[int, int], AbstractContextManager[Progress]]


@dataclass(frozen=True)
class RunOptions:
    """How an experiment is run; nothing here changes a result.

    fresh: forget the outcomes that are kept and compute them again.
    overwrite: replace results of another configuration. executor: instead of the configuration's.
    """

    store: Path
    results: Path
    workers: int
    fresh: bool = False
    overwrite: bool = False
    executor: ExecutorSettings | None = None


@dataclass(frozen=True)
class LoadedExperiment:
    """A configuration, its trials, and its full settings with every default, as YAML text."""

    experiment: Experiment
    entries: Plan
    settings: str


def load_experiment(path: Path) -> LoadedExperiment:
    """Read and check a configuration; raises InputError, in one line, for any mistake in it."""
    experiment = read_experiment(path)
    entries = plan_trials(experiment, str(path))
    if experiment.output == "rivals" and not rival_pairs(entries.first_entries()):
        raise InputError(
            f"output 'rivals' of {path} should have a peer and, in 'algorithms', the one that it stands beside"
        )
    return LoadedExperiment(experiment, entries, _settings_text(experiment, entries))


def run_experiment(path: Path, options: RunOptions, bar: ProgressBar) -> list[Path]:
    """Run the missing trials of a configuration and write its results; returns the written files.

    bar: makes a progress bar for the number of all trials and of those already done.
    Raises InputError, StoppedError, TrialsFailedError; finished trials are kept in any case.
    """
    return run_loaded_experiment(load_experiment(path), options, bar)


def run_loaded_experiment(loaded: LoadedExperiment, options: RunOptions, bar: ProgressBar) -> list[Path]:
    """`run_experiment` for a configuration that is read already."""
    if not options.overwrite:
        check_folder(options.results, loaded.experiment.name, loaded.settings)
    with open_store(options.store) as store:
        if options.fresh:
            store.forget(entry.key for entry in loaded.entries)
        left = count_missing(loaded.entries, store)
        with bar(len(loaded.entries), len(loaded.entries) - left) as progress:
            executor = options.executor or loaded.experiment.executor
            limit = loaded.experiment.trial_timeout_s
            run_missing(loaded.entries, store, options.workers, progress.update, executor, limit)
        from bench.results import (
            write_results,
        )  # pandas and matplotlib take longer to import than a small run

        return write_results(loaded.experiment, loaded.entries, loaded.settings, store, options.results)


def _settings_text(experiment: Experiment, entries: Plan) -> str:
    """Without what changes no outcome: results of a cluster and of a laptop are the same."""
    firsts = entries.first_entries()
    problems = {entry.problem: entry.trial.problem.model_dump(mode="json") for entry in firsts}
    algorithms = {
        entry.algorithm: {"name": entry.trial.algorithm, "params": dataclasses.asdict(entry.trial.params)}
        for entry in firsts
    }
    settings = experiment.model_dump(mode="json", exclude_none=True, exclude={"executor", "trial_timeout_s"})
    settings |= {"problem": problems, "algorithms": algorithms}
    text: str = yaml.safe_dump(json.loads(json.dumps(settings)), sort_keys=False, allow_unicode=True)
    return text


_TIMED_POPULATIONS = 4


def describe_run(path: Path, options: RunOptions) -> Iterator[str]:
    """Lines that list the trials of a configuration and estimate the time; nothing is run or kept."""
    entries = load_experiment(path).entries
    left = _count_missing_by_series(entries, options)
    for series in entries.series:
        yield _describe_series(series, entries.repetitions, left[series])
    total = sum(left.values())
    yield f"{len(entries)} trials, {len(entries) - total} done, {total} to do"
    seconds = _estimate_seconds(left) / options.workers
    yield f"about {seconds:.1f} s on {options.workers} cores, if otherwise idle, start not counted"


def _count_missing_by_series(entries: Plan, options: RunOptions) -> dict[Series, int]:
    """How many repetitions of each series are missing."""
    if not options.store.exists():
        return dict.fromkeys(entries.series, entries.repetitions)
    with open_store(options.store) as store:
        return {
            series: count_missing(map(series.entry, range(entries.repetitions)), store) for series in entries.series
        }


def _describe_series(series: Series, repetitions: int, left: int) -> str:
    trial = series.first
    return (
        f"{series.problem}: {series.algorithm}, swarm size {trial.swarm_size}, {trial.evaluations} evaluations: "
        f"{repetitions} repetitions, {repetitions - left} done"
    )


def _estimate_seconds(left: Mapping[Series, int]) -> float:
    """Seconds on one core, from a few timed populations of each series."""
    seconds = 0.0
    for series, count in left.items():
        trial = series.first
        if not count:
            continue
        short = replace(trial, evaluations=min(trial.evaluations, _TIMED_POPULATIONS * trial.swarm_size))
        _, (_, outcome) = run_batch([("to warm the caches", short), ("to time", short)])
        if isinstance(outcome, Failure):
            raise make_failure_error(Failures(1, [outcome]))
        seconds += outcome.seconds / outcome.evaluations * trial.evaluations * count
    return seconds
