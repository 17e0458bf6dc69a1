"""Kill the command, or one of its workers, at random times; count the trials that are lost and computed again."""

import os
import signal
import sqlite3
import time
from contextlib import closing, suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.context import ForkProcess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from bench.run import RunOptions, load_experiment, run_experiment
from bench.studies.scale.sweeps import ReportProgress

Victim = Literal["driver", "worker"]
_WORKERS = 2
_BATCH_SECONDS = 0.1  # about: so that kills do not all come right after a commit


@dataclass(frozen=True)
class KillResult:
    """The result of one kill.

    kept: trials in the store right after it. lost: those of them that are missing or changed at the end. missing:
    trials that the restart had to run. computed: trials that it ran. store_and_table_intact: whether the store kept its
    integrity and the table its bytes.
    """

    kept: int
    lost: int
    missing: int
    computed: int
    store_and_table_intact: bool

    @property
    def exact(self) -> bool:
        """Whether no trial is lost, none is computed twice, and none is left undone."""
        return self.store_and_table_intact and not self.lost and self.computed == self.missing


class _CountingBar:
    """A progress bar that only counts, in a file."""

    def __init__(self, path: Path) -> None:
        self._path, self._count = path, 0

    def __enter__(self) -> "_CountingBar":
        return self

    def __exit__(self, *error: object) -> None:
        self._path.write_text(str(self._count))

    def update(self, n: int) -> None:
        self._count += n


def kill_repeatedly(
    config: Path, repetitions: int, victim: Victim, tell: ReportProgress, seed: int = 0
) -> list[KillResult]:
    """Kill that many times, each time in a run of its own, at a uniformly drawn share of stored trials.

    A killed driver is started again; a killed worker is replaced by the driver.
    """
    rng = np.random.default_rng(seed)
    import_module("bench.results")  # what is imported here need not be imported in every fork
    path, total = config.resolve(), len(load_experiment(config).entries)
    expected = _undisturbed_table(path)
    results = []
    for k in range(repetitions):
        kill = _kill_once(path, victim, rng.uniform(size=2), expected, total)
        results.append(kill)
        tell(f"{victim} {k + 1} of {repetitions}: {kill.kept} kept, {kill.lost} lost, {kill.computed} computed")
    return results


def _undisturbed_table(path: Path) -> bytes:
    """The table of a run without a kill."""
    with TemporaryDirectory() as place:
        run = _start_run(path, Path(place))
        run.join()
        return _read_table(Path(place))


def _kill_once(path: Path, victim: Victim, when: Array, expected: bytes, total: int) -> KillResult:
    with TemporaryDirectory() as place:
        folder = Path(place)
        run = _start_run(path, folder)
        while run.is_alive() and len(_kept_trials(folder)) < max(when[0] * total, 1):
            time.sleep(0.005)
        time.sleep(when[1] * _BATCH_SECONDS)
        _send_kill(victim, run)
        if victim == "driver":
            run.join()
        kept = _kept_trials(folder)
        if victim == "driver":
            run = _start_run(path, folder)
        run.join()
        missing = total - (len(kept) if victim == "driver" else 0)
        return KillResult(
            kept=len(kept),
            lost=len(kept.items() - _kept_trials(folder).items()),
            missing=missing,
            computed=int((folder / "count").read_text()),
            store_and_table_intact=_has_integrity(folder) and _read_table(folder) == expected,
        )


def _send_kill(victim: Victim, run: ForkProcess) -> None:
    target = run.pid if victim == "driver" else _find_worker(run.pid)
    if target is not None:
        with suppress(ProcessLookupError):  # it may have ended just now
            os.kill(target, signal.SIGKILL)


def _read_table(folder: Path) -> bytes:
    """The CSV of summaries; beside it stand times, which no two runs share."""
    (path,) = (path for path in folder.glob("*.csv") if not path.stem.endswith("_times"))
    return path.read_bytes()


def _has_integrity(folder: Path) -> bool:
    with closing(sqlite3.connect(folder / "runs.sqlite")) as connection:
        return bool(connection.execute("PRAGMA integrity_check").fetchone() == ("ok",))


def _start_run(path: Path, folder: Path) -> ForkProcess:
    process = ForkProcess(target=_run_in_fork, args=(path, folder))
    process.start()
    return process


def _run_in_fork(path: Path, folder: Path) -> None:
    options = RunOptions(folder / "runs.sqlite", folder, _WORKERS)
    run_experiment(path, options, lambda total, done: _CountingBar(folder / "count"))


def _kept_trials(folder: Path) -> dict[str, float]:
    """The seconds of each trial in the store: they differ when a trial is run again."""
    store = folder / "runs.sqlite"
    if not store.exists():
        return {}
    with closing(sqlite3.connect(store, timeout=30)) as connection:
        tables = connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'trials'").fetchall()
        return dict(connection.execute("SELECT key, seconds FROM trials").fetchall()) if tables else {}


def _find_worker(pid: int | None) -> int | None:
    """The process of one of the driver's workers."""
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            if parent == pid and b"popen_loky" in (entry / "cmdline").read_bytes():
                return int(entry.name)
    return None
