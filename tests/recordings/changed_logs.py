"""Logs that chance makes of clean runs: cut, joined, shuffled, doubled, thinned, on other clocks, in other formats.

`python tests/recordings/changed_logs.py --logs 2000` tries as many and prints what became of them; `--first` continues
where another call ended. Each should come to the numbers of the same runs read plainly, or be refused in one line.

Numbers agree if none of 2,000 logs is further off than chance may bring it (`largest_by_chance`): 2.5 half widths of
the 95 % intervals of both fits. The limit follows from the number of comparisons alone.
"""

import argparse
import gzip
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from odd_logs import coarse, fit, largest_by_chance, largest_deviation
from recording_folders import IMPORT_OPTIONS, POSITION, RATE_HZ, TORQUE, frame

from armlab.common.errors import InputError
from armlab.recordings.imports.files import import_files
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Run

LOGS = 2000
SECONDS = 8.0
EPISODES = 4
MAX_CHANGES = 3
COARSE_HZ = (100, 70, 150)  # of clocks: as fast as rows or slower
COUNTED_LOGS = 250  # after as many the counts are printed
MAX_LOST = 0.1  # of the rows that are measurements
FORMATS = ("csv", "semicolon", "csv.gz", "utf-16", "json", "jsonl", "parquet")
CLOCKS = ("seconds", "milliseconds", "epoch", "iso", "sec and nanosec")
CHANGES = (
    *("nothing", "swap rows", "reverse a block", "shuffle", "turn round", "double rows", "double the file"),
    *("drop rows", "drop a third", "drop a stretch", "leap", "step back", "coarse stamps", "two rates", "in turn"),
    *("zeros", "spikes", "empty cells", "cut the last row"),
)


@dataclass(frozen=True, eq=False)
class ChangedLog:
    """A table that was changed, and the clean runs that it comes from.

    table: with the time t in s. origin: episodes, clock and rate. changes: names of CHANGES in their order. runs: the
    same measurements, run by run. rows: of the table, that are whole measurements. form, clock: of FORMATS, of CLOCKS.
    """

    table: pd.DataFrame
    origin: str
    changes: tuple[str, ...]
    runs: tuple[pd.DataFrame, ...]
    rows: int
    form: str
    clock: str

    def __str__(self) -> str:
        """What was done, in words."""
        return ", ".join((self.origin, *self.changes, self.clock, self.form))


def draw_log(seed: int) -> ChangedLog:
    """The log of a seed."""
    rng = np.random.default_rng(seed)
    step = int(rng.choice([1, 2]))
    count = int(rng.integers(1, EPISODES + 1))
    equal = rng.random() < 0.5
    length = int(rng.integers(900, 1600))
    runs = []
    for number in range(count):
        rows = length if equal else int(rng.integers(600, 1600))
        start = int(rng.integers(0, 1600 - rows + 1))
        run = frame(number, SECONDS, coulomb=0.0).iloc[start : start + rows : step].reset_index(drop=True)
        runs.append(run.assign(t=run["t"] - run["t"].iloc[0]))
    anew = rng.random() < 0.6
    starts = np.zeros(count) if anew else np.cumsum([0.0, *(run["t"].iloc[-1] + 3.0 for run in runs[:-1])])
    table = pd.concat(
        [run.assign(t=run["t"] + start) for run, start in zip(runs, starts, strict=True)], ignore_index=True
    )
    origin = f"{count} episode(s), {'clock from 0 each' if anew else 'one clock'}, {RATE_HZ / step:g} Hz"
    rows = len(table)
    changes = [str(each) for each in rng.choice(CHANGES, size=int(rng.integers(0, MAX_CHANGES + 1)), replace=False)]
    for change in changes:
        table, rows = change_table(table, rows, change, rng)
    form, clock = str(rng.choice(FORMATS)), str(rng.choice(CLOCKS))
    return ChangedLog(table, origin, tuple(changes), tuple(runs), rows, form, clock)


def change_table(table: pd.DataFrame, rows: int, change: str, rng: np.random.Generator) -> tuple[pd.DataFrame, int]:
    """The table after a change, and how many rows of measurement it then has."""
    out, size = table.copy(), len(table)
    order = np.arange(size)
    place = int(rng.integers(50, size - 60))
    if change == "swap rows":
        for at in rng.integers(1, size - 1, 5):
            order[[at, at - 1]] = order[[at - 1, at]]
    elif change == "reverse a block":
        order[place : place + 12] = order[place : place + 12][::-1]
    elif change == "shuffle":
        order = rng.permutation(size)
    elif change == "turn round":
        order = order[::-1]
    elif change == "double rows":
        order = np.sort(np.append(order, rng.integers(0, size, size // 5)))
    elif change == "double the file":
        order = np.append(order, order)
    elif change in ("drop rows", "drop a third"):
        order = order[rng.random(size) > (0.05 if change == "drop rows" else 0.33)]
    elif change == "drop a stretch":
        order = np.delete(order, np.arange(place, place + 40))
    out = out.iloc[order].reset_index(drop=True)
    if change.startswith("drop"):
        rows = rows * len(out) // size
    if change == "leap":
        out.loc[place:, "t"] += 7.5
    elif change == "step back":
        out.loc[place:, "t"] -= out["t"].iloc[place] - out["t"].iloc[0]
    elif change == "coarse stamps":
        out = coarse(out, float(rng.choice(COARSE_HZ)))
    elif change == "two rates":
        out.loc[out.index % 2 > 0, TORQUE] = np.nan
        rows //= 2
    elif change == "in turn":
        out.loc[out.index % 2 > 0, TORQUE] = np.nan
        out.loc[out.index % 2 == 0, POSITION] = np.nan
        rows //= 2
    elif change == "zeros":
        out.loc[out.index % 25 == 7, [*POSITION, *TORQUE]] = 0.0
    elif change == "spikes":
        out.loc[rng.integers(0, len(out), 4), "q2"] = 400.0
    elif change == "empty cells":
        out.loc[rng.random(len(out)) < 0.02, "tau3"] = np.nan
    elif change == "cut the last row":
        out = out.iloc[:-1]
    return out, rows


def write_log(log: ChangedLog, folder: Path) -> Path:
    """The file of a log."""
    table = log.table.rename(columns={"q1": "q1_rad", "q2": "q2_rad", "q3": "q3_rad"})
    table = table.rename(columns={f"tau{joint}": f"tau{joint}_Nm" for joint in (1, 2, 3)})
    time = table.pop("t").to_numpy()
    ns = 1_767_225_600 * 10**9 + np.rint(time * 1e9).astype(np.int64)
    if log.clock == "seconds":
        table.insert(0, "time", time)
    elif log.clock == "milliseconds":
        table.insert(0, "time_ms", np.round(time * 1e3, 3))
    elif log.clock == "epoch":
        table.insert(0, "time", ns / 1e9)
    elif log.clock == "iso":
        table.insert(0, "time", pd.to_datetime(ns, unit="ns").strftime("%Y-%m-%dT%H:%M:%S.%f"))
    else:
        table.insert(0, "sec", ns // 10**9)
        table.insert(1, "nanosec", ns % 10**9)
    path = folder / f"log.{log.form if '.' in log.form or log.form.startswith(('js', 'pa')) else 'csv'}"
    if log.form == "json":
        table.to_json(path, orient="records", double_precision=15)
    elif log.form == "jsonl":
        table.to_json(path, orient="records", lines=True, double_precision=15)
    elif log.form == "parquet":
        table.to_parquet(path)
    elif log.form == "csv.gz":
        path.write_bytes(gzip.compress(table.to_csv(index=False).encode(), 1))
    elif log.form == "semicolon":
        table.to_csv(path, index=False, sep=";", decimal=",")
    else:
        table.to_csv(path, index=False, encoding="utf-16" if log.form == "utf-16" else "utf-8")
    return path


@dataclass(frozen=True)
class Judged:
    """outcome: agrees, refused, or what is broken. line: the refusal, or the numbers that say it."""

    outcome: str
    line: str

    @property
    def is_broken(self) -> bool:
        """Whether the log is neither read rightly nor refused in one line."""
        return self.outcome.startswith("broken")


def judge_log(log: ChangedLog, folder: Path) -> Judged:
    """What becomes of a log. Raises what the import or the fit raises, but for a refusal."""
    units = ("time=s",) if log.clock in ("seconds", "epoch") else ()
    try:
        import_files([write_log(log, folder)], folder / "recording", {**IMPORT_OPTIONS, "units": units})
        runs = load_recording(folder / "recording").runs
        model = fit(runs)
    except InputError as error:
        return Judged("refused" if "\n" not in str(error) else "broken: lines", str(error))
    kept = sum(run.samples for run in runs)
    if kept < (1 - MAX_LOST) * log.rows - 2 * len(log.runs):
        return Judged("broken: rows lost", f"{kept} of {log.rows}")
    worst = largest_deviation(model, fit(tuple(_plain_run(table) for table in log.runs)))
    return Judged("agrees" if worst < largest_by_chance(LOGS) else "broken: other numbers", f"{worst:.2f} half widths")


def _plain_run(table: pd.DataFrame) -> Run:
    return Run("run.csv", "identify", table["t"].to_numpy(), table[POSITION].to_numpy(), table[TORQUE].to_numpy())


def judge_seed(seed: int) -> Judged:
    """What becomes of the log of a seed."""
    with tempfile.TemporaryDirectory() as folder:
        return judge_log(draw_log(seed), Path(folder))


def main(arguments: list[str]) -> int:
    """Tries logs, and prints counts and what is broken; 1 if anything is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=LOGS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--refusals", action="store_true", help="print each refusal, too")
    options = parser.parse_args(arguments)
    counts, started = Counter[str](), time.monotonic()
    for seed in range(options.first, options.first + options.logs):
        if counts.total() % COUNTED_LOGS == COUNTED_LOGS - 1:
            print(f"{counts.total() + 1} logs: {dict(counts)}", flush=True)
        try:
            judged = judge_seed(seed)
        except Exception as error:  # a trial goes on, and says where it broke
            traceback.print_exc()
            judged = Judged("broken: traceback", repr(error))
        counts[judged.outcome] += 1
        if judged.is_broken or (options.refusals and judged.outcome == "refused"):
            print(f"{seed}: {judged.outcome}: {draw_log(seed)}: {judged.line}", flush=True)
    listed = ", ".join(f"{number} {outcome}" for outcome, number in sorted(counts.items()))
    print(f"{counts.total()} logs in {time.monotonic() - started:.0f} s: {listed}")
    return 1 if any(outcome.startswith("broken") for outcome in counts) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
