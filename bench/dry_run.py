"""What a run would do: its trials, how many are done, and how long the others will take."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from bench.execute import Failure, run_batch
from bench.experiment import Options, load_experiment
from bench.plan import Entry
from bench.runner import missing, trials_failed
from bench.store import open_store

_POPULATIONS_TIMED = 4


def describe(path: Path, options: Options) -> Iterator[str]:
    """Lines that list the trials of a configuration and estimate the time; nothing is run or kept."""
    entries = load_experiment(path).entries
    waiting = entries
    if options.store.exists():
        with open_store(options.store) as store:
            waiting = missing(entries, store)
    left = {entry.key for entry in waiting}
    for _, repetitions in groupby(entries, _cell):
        yield _line(list(repetitions), left)
    yield f"{len(entries)} trials, {len(entries) - len(left)} done, {len(left)} to do"
    yield f"about {_estimate(waiting) / options.workers:.1f} s on {options.workers} cores, start not counted"


def _cell(entry: Entry) -> tuple[str, str, int, int]:
    return entry.problem, entry.algorithm, entry.trial.swarm_size, entry.trial.evaluations


def _line(repetitions: Sequence[Entry], left: set[str]) -> str:
    problem, algorithm, swarm_size, evaluations = _cell(repetitions[0])
    done = sum(entry.key not in left for entry in repetitions)
    return (
        f"{problem}: {algorithm}, swarm size {swarm_size}, {evaluations} evaluations: "
        f"{len(repetitions)} repetitions, {done} done"
    )


def _estimate(waiting: Sequence[Entry]) -> float:
    """Seconds on one core, from a few timed populations of each problem, algorithm and swarm size."""
    seconds = 0.0
    for _, group in groupby(waiting, _cell):
        cell = list(group)
        trial = cell[0].trial
        short = replace(trial, evaluations=min(trial.evaluations, _POPULATIONS_TIMED * trial.swarm_size))
        _, (_, outcome) = run_batch([("to warm the caches", short), ("to time", short)])
        if isinstance(outcome, Failure):
            raise trials_failed([outcome])
        seconds += outcome.seconds / outcome.evaluations * sum(entry.trial.evaluations for entry in cell)
    return seconds
