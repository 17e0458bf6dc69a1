"""Sweeps of several sizes on one and two workers, run by the command in a process of its own: memory, overhead of a
trial, efficiency.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import yaml

from armlab.common.errors import InputError
from armlab.common.settings import read_yaml
from bench.run import load_experiment
from bench.store import open_store

_POLL_INTERVAL_S = 0.1
_BYTES_PER_PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class WatchedCommand:
    """A finished command: seconds by a monotonic clock, and its resident memory, MB, evenly spaced in time.

    memory: of the command itself, without its workers.
    """

    seconds: float
    memory: tuple[float, ...]

    @property
    def peak(self) -> float:
        """The largest memory, MB."""
        return max(self.memory)

    def after(self, share: float) -> float:
        """Memory, MB, after that share of the time."""
        return self.memory[min(int(share * len(self.memory)), len(self.memory) - 1)]


def watch_command(arguments: Sequence[object], folder: Path) -> WatchedCommand:
    """Run `armlab` with arguments in a folder to its end; raises CalledProcessError if it fails."""
    began = time.monotonic()
    running = start_command(arguments, folder)
    memory = [resident_mb(running.pid)]
    while running.poll() is None:
        time.sleep(_POLL_INTERVAL_S)
        memory.append(resident_mb(running.pid) or memory[-1])
    seconds = time.monotonic() - began
    if running.returncode:
        raise subprocess.CalledProcessError(running.returncode, running.args)
    return WatchedCommand(seconds, tuple(memory))


def start_command(arguments: Sequence[object], folder: Path) -> "subprocess.Popen[bytes]":
    """Begin to run `armlab` with arguments in a folder, its files not listed."""
    command = [sys.executable, "-m", "armlab.cli.main", *map(str, arguments)]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL)


def resident_mb(pid: int) -> float:
    """Resident memory of a process, MB; 0 if it is gone. On Linux /proc has it."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * _BYTES_PER_PAGE / 1e6


ReportProgress = Callable[[str], object]
TURNS_OF_WORKERS = 3  # in which one and two workers take turns


@dataclass(frozen=True)
class SweepCost:
    """The cost of one sweep.

    search_seconds: processor time of all searches alone. repeated: the same command on the finished store, which runs
    no trial: start, look-ups, table. report: the page about it.
    """

    trials: int
    workers: int
    run: WatchedCommand
    repeated: WatchedCommand
    report: WatchedCommand | None
    search_seconds: float

    @property
    def trial_seconds(self) -> float:
        """Seconds for the trials alone, without start and table."""
        return self.run.seconds - self.repeated.seconds

    @property
    def overhead_ms(self) -> float:
        """What a trial costs beside its search, milliseconds of one core."""
        return 1e3 * (self.workers * self.trial_seconds - self.search_seconds) / self.trials


@dataclass(frozen=True)
class ScaleCost:
    """A tenth and the whole, both on two workers; and the tenth on one and on two workers in turns, median seconds.

    load: the machine's average load at the end of the turns.
    """

    tenth_sweep: SweepCost
    whole_sweep: SweepCost
    alone: float
    together: float
    load: float

    @property
    def efficiency(self) -> float:
        """Efficiency of two workers: 1 if they take half the time of one."""
        return self.alone / (2 * self.together)


def measure_scale(config: Path, trials: int, tell: ReportProgress) -> ScaleCost:
    """Run all sweeps in a folder that is removed afterwards; tell: is called with a line about each step."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        for size in (trials // 10, trials):
            write_sized_config(config, size, folder)  # refuses a size before the first sweep
        tell("one worker and two in turns")
        turns = [
            [_measure_sweep(config, trials // 10, count, folder) for count in (1, 2)] for _ in range(TURNS_OF_WORKERS)
        ]
        load = os.getloadavg()[1]
        tell("a tenth")
        tenth = _measure_sweep(config, trials // 10, 2, folder, with_report=True)
        tell("the whole")
        whole = _measure_sweep(config, trials, 2, folder, with_report=True)
    alone, together = (median(turn[count].trial_seconds for turn in turns) for count in range(2))
    return ScaleCost(tenth, whole, alone, together, load)


def write_sized_config(config: Path, trials: int, folder: Path) -> Path:
    """Write the configuration with the repetitions that give that many trials into a folder; returns the file."""
    content = read_yaml(config)
    series = len(load_experiment(config).entries.series)
    if trials % series:
        raise InputError(f"the number of trials should be a multiple of {series}, the series of {config}")
    content["repetitions"] = trials // series
    path = folder / f"{trials}.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def _measure_sweep(config: Path, trials: int, workers: int, folder: Path, with_report: bool = False) -> SweepCost:
    path, store = write_sized_config(config.resolve(), trials, folder), folder / "runs.sqlite"
    command = ["run", path, "--workers", workers, "--store", store, "--results", folder / f"{trials}"]
    run, again = watch_command(command, folder), watch_command(command, folder)
    page = ["report", path, "--store", store, "--out", folder / "page.html"]
    report = watch_command(page, folder) if with_report else None
    with open_store(store) as kept:
        search = sum(kept.figures(entry.key).seconds for entry in load_experiment(path).entries)
    for part in folder.glob("runs.sqlite*"):
        part.unlink()
    return SweepCost(trials, workers, run, again, report, search)
