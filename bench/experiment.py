"""One experiment from its configuration to its results: check, run what is missing, write."""

import dataclasses
import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import yaml

from bench.config import Experiment, read_experiment
from bench.engines.contract import Executor
from bench.files import check_folder
from bench.plan import Plan, plan
from bench.rival_pairs import rival_pairs
from bench.runner import count_missing, run_missing
from bench.store import open_store
from problem.errors import InputError


class Progress(Protocol):
    """What tells the user how far a run is, e.g. a tqdm bar."""

    def update(self, n: int) -> object: ...


ProgressBar = Callable[[int, int], AbstractContextManager[Progress]]


@dataclass(frozen=True)
class Options:
    """How an experiment is run; nothing here changes a result.

    fresh: forget the outcomes that are kept and compute them again.
    overwrite: replace results of another configuration. executor: instead of the configuration's.
    """

    store: Path
    results: Path
    workers: int
    fresh: bool = False
    overwrite: bool = False
    executor: Executor | None = None


@dataclass(frozen=True)
class Loaded:
    """A configuration, its trials, and its full settings with every default, as YAML text."""

    experiment: Experiment
    entries: Plan
    settings: str


def load_experiment(path: Path) -> Loaded:
    """Read and check a configuration; raises InputError, in one line, for any mistake in it."""
    experiment = read_experiment(path)
    entries = plan(experiment, str(path))
    if experiment.output == "rivals" and not rival_pairs(entries.firsts()):
        raise InputError(
            f"output 'rivals' of {path} should have a peer and, in 'algorithms', the one that it stands beside"
        )
    return Loaded(experiment, entries, _full_settings(experiment, entries))


def run_experiment(path: Path, options: Options, bar: ProgressBar) -> list[Path]:
    """Run the missing trials of a configuration and write its results; returns the written files.

    bar: makes a progress bar for the number of all trials and of those already done.
    Raises InputError, StoppedError, TrialsFailedError; finished trials are kept in any case.
    """
    return run_loaded(load_experiment(path), options, bar)


def run_loaded(loaded: Loaded, options: Options, bar: ProgressBar) -> list[Path]:
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


def _full_settings(experiment: Experiment, entries: Plan) -> str:
    """Without what changes no outcome: results of a cluster and of a laptop are the same."""
    firsts = entries.firsts()
    problems = {entry.problem: entry.trial.problem.model_dump(mode="json") for entry in firsts}
    algorithms = {
        entry.algorithm: {"name": entry.trial.algorithm, "params": dataclasses.asdict(entry.trial.params)}
        for entry in firsts
    }
    settings = experiment.model_dump(mode="json", exclude_none=True, exclude={"executor", "trial_timeout_s"})
    settings |= {"problem": problems, "algorithms": algorithms}
    text: str = yaml.safe_dump(json.loads(json.dumps(settings)), sort_keys=False, allow_unicode=True)
    return text
