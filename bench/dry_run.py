"""What a run would do: its trials, how many are done, and how long the others will take."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from bench.execute import Failure, run_batch
from bench.experiment import Options, load_experiment
from bench.plan import Plan, Series
from bench.runner import Failures, count_missing, trials_failed
from bench.store import open_store

_POPULATIONS_TIMED = 4


def describe(path: Path, options: Options) -> Iterator[str]:
    """Lines that list the trials of a configuration and estimate the time; nothing is run or kept."""
    entries = load_experiment(path).entries
    left = _left(entries, options)
    for series in entries.series:
        yield _line(series, entries.repetitions, left[series])
    total = sum(left.values())
    yield f"{len(entries)} trials, {len(entries) - total} done, {total} to do"
    seconds = _estimate(left) / options.workers
    yield f"about {seconds:.1f} s on {options.workers} cores, if otherwise idle, start not counted"


def _left(entries: Plan, options: Options) -> dict[Series, int]:
    """How many repetitions of each series are missing."""
    if not options.store.exists():
        return dict.fromkeys(entries.series, entries.repetitions)
    with open_store(options.store) as store:
        return {
            series: count_missing(map(series.entry, range(entries.repetitions)), store) for series in entries.series
        }


def _line(series: Series, repetitions: int, left: int) -> str:
    trial = series.first
    return (
        f"{series.problem}: {series.algorithm}, swarm size {trial.swarm_size}, {trial.evaluations} evaluations: "
        f"{repetitions} repetitions, {repetitions - left} done"
    )


def _estimate(left: Mapping[Series, int]) -> float:
    """Seconds on one core, from a few timed populations of each series."""
    seconds = 0.0
    for series, count in left.items():
        trial = series.first
        if not count:
            continue
        short = replace(trial, evaluations=min(trial.evaluations, _POPULATIONS_TIMED * trial.swarm_size))
        _, (_, outcome) = run_batch([("to warm the caches", short), ("to time", short)])
        if isinstance(outcome, Failure):
            raise trials_failed(Failures(1, [outcome]))
        seconds += outcome.seconds / outcome.evaluations * trial.evaluations * count
    return seconds
