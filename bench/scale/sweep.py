"""Sweeps of several sizes on one and two workers: memory, overhead of a trial, efficiency."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import yaml

from bench.experiment import load_experiment
from bench.scale.watched import Watched, watch
from bench.store import open_store
from problem.errors import InputError
from problem.yaml_input import read_yaml

Tell = Callable[[str], object]
ROUNDS = 3  # in which one and two workers take turns


@dataclass(frozen=True)
class Sweep:
    """One sweep. search_seconds: processor time of all searches alone. again: the same command on the finished store,
    which runs no trial: start, look-ups, table. report: the page about it.
    """

    trials: int
    workers: int
    run: Watched
    again: Watched
    report: Watched | None
    search_seconds: float

    @property
    def working(self) -> float:
        """Seconds for the trials alone, without start and table."""
        return self.run.seconds - self.again.seconds

    @property
    def overhead_ms(self) -> float:
        """What a trial costs beside its search, milliseconds of one core."""
        return 1e3 * (self.workers * self.working - self.search_seconds) / self.trials


@dataclass(frozen=True)
class Scale:
    """A tenth and the whole, both on two workers; and the tenth on one and on two workers in turns, median seconds.

    load: the machine's average load at the end of the turns.
    """

    tenth: Sweep
    whole: Sweep
    alone: float
    together: float
    load: float

    @property
    def efficiency(self) -> float:
        """Of two workers: 1 if they take half the time of one."""
        return self.alone / (2 * self.together)


def measure(config: Path, trials: int, tell: Tell) -> Scale:
    """Run everything, in a folder that is removed afterwards; tell: hears what is done."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        tell("one worker and two in turns")
        turns = [[_sweep(config, trials // 10, count, folder) for count in (1, 2)] for _ in range(ROUNDS)]
        load = os.getloadavg()[1]
        tell("a tenth")
        tenth = _sweep(config, trials // 10, 2, folder, with_report=True)
        tell("the whole")
        whole = _sweep(config, trials, 2, folder, with_report=True)
    alone, together = (median(turn[count].working for turn in turns) for count in range(2))
    return Scale(tenth, whole, alone, together, load)


def sized(config: Path, trials: int, folder: Path) -> Path:
    """The configuration with as many repetitions as make so many trials, in a folder."""
    content = read_yaml(config)
    series = len(load_experiment(config).entries.series)
    if trials % series:
        raise InputError(f"the number of trials should be a multiple of {series}, the series of {config}")
    content["repetitions"] = trials // series
    path = folder / f"{trials}.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def _sweep(config: Path, trials: int, workers: int, folder: Path, with_report: bool = False) -> Sweep:
    path, store = sized(config.resolve(), trials, folder), folder / "runs.sqlite"
    command = ["run", path, "--workers", workers, "--store", store, "--results", folder / f"{trials}"]
    run, again = watch(command, folder), watch(command, folder)
    page = ["report", path, "--store", store, "--out", folder / "page.html"]
    report = watch(page, folder) if with_report else None
    with open_store(store) as kept:
        search = sum(kept.figures(entry.key).seconds for entry in load_experiment(path).entries)
    for part in folder.glob("runs.sqlite*"):
        part.unlink()
    return Sweep(trials, workers, run, again, report, search)
