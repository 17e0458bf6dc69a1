"""Processor time and memory of this tree beside those of an earlier commit: `python -m tools.time_against COMMIT`.

What is timed is `armlab run configs/table3.yaml` in one process, or with `--diagnose RECORDING...` `armlab diagnose` of
each recording, whose two verdicts are compared, too, or with `--read RECORDING...` alone how it is to be read, and the
sum. Both trees take turns, with the libraries of this environment. The ratio is that of the least times, the start of
Python included (not that of `--read`), as other work on the machine only adds; its range is that of rounds.
"""

import argparse
import filecmp
import math
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from armlab.common.errors import InputError
from armlab.common.processes import MeasuredRun, measure_run
from armlab.common.settings import read_json
from tools.structure import ROOTS

ROOT = Path(__file__).resolve().parents[1]
ROUNDS = 3
VERDICT = "verdict.json"
RELATIVE, ABSOLUTE = 1e-6, 1e-9  # differences of numbers that sums in another order make


@dataclass(frozen=True)
class TimedCommand:
    """A command of armlab. words: what it is given, for the folder that it writes into. result: a file to compare."""

    name: str
    words: Callable[[Path], list[str]]
    result: str | None = None


def main(words: Sequence[str]) -> None:
    """Prints times, memory and ratios. Raises InputError where git, the build or a run fails."""
    options = parse_options(words)
    commands = [diagnosis_of(each, options.as_read) for each in options.diagnose] or [TABLE_3]
    with TemporaryDirectory() as folder, _tree_of(options.commit, Path(folder)) as earlier:
        for tree in (earlier, ROOT):  # so that no round compiles
            _run(tree, sys.executable, "-m", "compileall", "-q", *(each for each in ROOTS if (tree / each).is_dir()))
        compile_libraries()
        if options.read:
            commands = []
            for line in compare_reading(options.read, earlier, options.rounds):
                print(line, flush=True)
        for command in commands:
            for line in compare(command, earlier, Path(folder), options.rounds):
                print(line, flush=True)


def compile_libraries() -> None:
    """Compiles the libraries of this environment; some hold modules of other versions of Python, which fail."""
    measure_run([sys.executable, "-m", "compileall", "-q", sysconfig.get_path("purelib")], ROOT)


def parse_options(words: Sequence[str]) -> argparse.Namespace:
    """`commit`, `diagnose` and `read` (folders), `as_read` and `rounds`."""
    parser = argparse.ArgumentParser(prog="python -m tools.time_against", description=(__doc__ or "").split("\n\n")[1])
    parser.add_argument("commit", help="what this tree is compared with")
    parser.add_argument("--diagnose", metavar="RECORDING", nargs="+", type=Path, default=[])
    parser.add_argument("--read", metavar="RECORDING", nargs="+", type=Path, default=[])
    parser.add_argument("--as-read", action="store_true", help="of the diagnosis")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args(words)
    if options.as_read and not options.diagnose:
        parser.error("--as-read: only with --diagnose")
    if options.read and options.diagnose:
        parser.error("--read: not beside --diagnose")
    if options.rounds < 1:
        parser.error("--rounds: at least 1")
    return options


def _table3_words(out: Path) -> list[str]:
    return [
        "run",
        "configs/table3.yaml",
        "--workers",
        "1",
        "--store",
        str(out / "runs.sqlite"),
        "--results",
        str(out / "results"),
    ]


TABLE_3 = TimedCommand("Table 3", _table3_words)


def diagnosis_of(recording: Path, as_read: bool) -> TimedCommand:
    """`armlab diagnose` of a recording."""

    def words(out: Path) -> list[str]:
        return ["diagnose", str(recording.resolve()), "--out", str(out), *["--as-read"] * as_read]

    return TimedCommand(recording.resolve().name, words, VERDICT)


# both trees have these names
READ_CODE = """
import sys, time
from armlab.recordings.load import load_recording
from armlab.recordings.reading.answer import read_rightly
from armlab.recordings.reading.tuning import ReadingTuning
recording = load_recording(sys.argv[1])
links = None if recording.arm.links is None else recording.arm.parameters
start = time.process_time()
read_rightly(recording, links, ReadingTuning())
print(time.process_time() - start)
"""


def compare_reading(recordings: Sequence[Path], earlier: Path, rounds: int) -> Iterator[str]:
    """Lines about how long it takes in both trees to find how each recording is to be read, and about the sum."""
    least = []
    for recording in recordings:
        times = [tuple(_seconds_to_read(recording, tree) for tree in (earlier, ROOT)) for _ in range(rounds)]
        before, now = (min(each) for each in zip(*times, strict=True))
        least.append((before, now))
        yield f"{recording.resolve().name}: reading before {before:.2f} s, now {now:.2f} s, {describe_ratio(times)}"
    sums = tuple(sum(each) for each in zip(*least, strict=True))
    yield f"{len(least)} recordings: reading before {sums[0]:.2f} s, now {sums[1]:.2f} s, {describe_ratio([sums])}"


def _seconds_to_read(recording: Path, tree: Path) -> float:
    command = [sys.executable, "-c", READ_CODE, str(recording.resolve())]
    outcome = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)
    if outcome.returncode != 0:
        raise InputError(f"{recording}: {outcome.stderr.strip().splitlines()[-1]}")
    return float(outcome.stdout)


def compare(command: TimedCommand, earlier: Path, folder: Path, rounds: int) -> Iterator[str]:
    """Lines about a command in both trees, in turns: each round, then the ratio, then whether results are equal."""
    times, memory, difference = [], [], None
    for number in range(1, rounds + 1):
        with TemporaryDirectory(dir=folder) as out:
            outs = [Path(out) / "before", Path(out) / "now"]
            before, now = (_measure(command, *each) for each in zip((earlier, ROOT), outs, strict=True))
            if command.result and difference is None:
                difference = first_difference(*(read_json(each / command.result) for each in outs))
        times.append((before.processor_seconds, now.processor_seconds))
        memory.append((before.memory_bytes / 1e6, now.memory_bytes / 1e6))
        yield f"{command.name}, round {number}: before {_figures(before)}, now {_figures(now)}"
    yield f"{command.name}: processor time {describe_ratio(times)}; peak memory {describe_ratio(memory)}"
    if command.result:
        yield f"{command.name}: verdicts are equal" if difference is None else f"{command.name}: differs: {difference}"


def describe_ratio(pairs: Sequence[tuple[float, float]]) -> str:
    """The ratio of the least now to the least before, and the range over the rounds, each (before, now)."""
    ratios = [now / before for before, now in pairs]
    least = min(now for _, now in pairs) / min(before for before, _ in pairs)
    return f"{least:.2f} of before ({min(ratios):.2f} to {max(ratios):.2f})"


def first_difference(before: Any, now: Any, place: str = "") -> str | None:
    """Where two documents differ first, and in what; None where they are equal, numbers within a millionth."""
    if isinstance(before, dict) and isinstance(now, dict):
        if before.keys() != now.keys():
            return f"{place or 'the document'} has {', '.join(sorted(before.keys() ^ now.keys()))} on one side only"
        pairs = [(f"{place}.{key}".removeprefix("."), before[key], now[key]) for key in before]
    elif isinstance(before, list) and isinstance(now, list):
        pairs = [(f"{place}[{row}]", *each) for row, each in enumerate(zip(before, now, strict=False))]
        pairs.append((f"length of {place}", len(before), len(now)))
    else:
        return None if _is_equal(before, now) else f"{place}: {before!r} before, {now!r} now"
    found = (first_difference(one, other, where) for where, one, other in pairs)
    return next((each for each in found if each is not None), None)


def _is_equal(before: Any, now: Any) -> bool:
    if _is_number(before) and _is_number(now):
        return math.isclose(before, now, rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    return type(before) is type(now) and bool(before == now)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _figures(run: MeasuredRun) -> str:
    return f"{run.processor_seconds:.2f} s {run.memory_bytes / 1e6:.0f} MB"


def _measure(command: TimedCommand, tree: Path, out: Path) -> MeasuredRun:
    return _run(tree, sys.executable, "-m", "armlab.cli.main", *command.words(out))


def _run(tree: Path, *command: str) -> MeasuredRun:
    run = measure_run(command, tree)
    if run.status != 0:
        raise InputError(f"{' '.join(command)}: {run.complaint or f'ended with status {run.status}'}")
    return run


@contextmanager
def _tree_of(commit: str, folder: Path) -> Iterator[Path]:
    """A work tree of a commit, with its compiled extensions; it is taken away at the end."""
    tree = folder / "tree"
    _run(ROOT, "git", "worktree", "add", "--quiet", "--detach", str(tree), commit)
    try:
        if not take_over_extensions(ROOT, tree):
            _run(tree, sys.executable, "setup.py", "--quiet", "build_ext", "--inplace")
        yield tree
    finally:
        subprocess.run(["git", "worktree", "remove", "--force", str(tree)], cwd=ROOT, check=True)


def take_over_extensions(built: Path, tree: Path) -> bool:
    """Copies the compiled extensions of a built tree into another one; False where some are not of the same sources."""
    found = []
    for script in tree.rglob("*_build.py"):
        name, place = script.name.removesuffix("_build.py"), script.parent.relative_to(tree)
        extension = next((built / place).glob(f"_{name}.*.so"), None)
        _, other, missing = filecmp.cmpfiles(built / place, script.parent, [script.name, f"{name}.c"], shallow=False)
        if extension is None or other or missing:
            return False
        found.append((extension, script.parent))
    for extension, folder in found:
        shutil.copy2(extension, folder)
    return True


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        sys.exit(f"time_against: {error}")
