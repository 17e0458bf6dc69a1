"""Where the seconds of a diagnosis go: `python -m tools.profile_diagnosis RECORDING [--as-read]`.

The recording is diagnosed twice. The first run tells the processor seconds of each stage, and the most memory until its
end. The second one, in a process of its own, tells those of each function: they hold what the profiler takes, most in
small functions, and are to be compared with each other alone.
"""

import argparse
import os
import pstats
import resource
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from armlab.common.errors import InputError
from armlab.common.processes import ONE_THREAD, measure_run, peak_memory_bytes
from tools.structure import ROOTS

ROOT = Path(__file__).resolve().parents[1]
FUNCTIONS = 20  # that are shown, by each order
COMMAND_LINE = "armlab/cli/"  # holds all that it calls
FIRST_STAGE, SECOND_STAGE = "imports", "loading"
STAGES = {  # by the progress that begins them
    "reading the recording rightly": "reading",
    "filtering": "filtering and columns",
    "fitting links and friction": "background",
    "searching, round": "search",
    "testing claims": "tests of names",
    "fitting the model that predicts": "prediction",
    "stating numbers": "numbers",
    "writing the report": "report",
}


class StageClock:
    """Seconds and the most memory, bytes, of each stage, from the start of the process."""

    def __init__(self, clock: Callable[[], float] = time.process_time) -> None:
        self.seconds: dict[str, float] = {}
        self.memory: dict[str, int] = {}
        self._clock, self._stage, self._since = clock, FIRST_STAGE, 0.0

    def begin(self, stage: str) -> None:
        """Ends the stage that runs."""
        now = self._clock()
        self.seconds[self._stage] = self.seconds.get(self._stage, 0.0) + now - self._since
        self.memory[self._stage] = peak_memory_bytes(resource.getrusage(resource.RUSAGE_SELF))
        self._stage, self._since = stage, now

    def tell(self, message: str) -> None:
        """Progress of a diagnosis: begins a stage, or belongs to the one that runs."""
        self.begin(next((stage for start, stage in STAGES.items() if message.startswith(start)), self._stage))

    def lines(self) -> Iterator[str]:
        """A table of the stages that have ended."""
        total = sum(self.seconds.values())
        yield f"{'stage':<24}{'processor s':>12}{'share':>8}{'peak MB':>10}"
        for stage, seconds in self.seconds.items():
            yield f"{stage:<24}{seconds:>12.2f}{seconds / total:>8.0%}{self.memory[stage] / 1e6:>10.0f}"
        yield f"{'all':<24}{total:>12.2f}{1:>8.0%}{max(self.memory.values()) / 1e6:>10.0f}"


@dataclass(frozen=True)
class FunctionTime:
    """Seconds of a function: own ones, and cumulative ones with all that it calls."""

    place: str
    calls: int
    own: float
    cumulative: float


def time_stages(recording: Path, out: Path, as_read: bool) -> StageClock:
    """Diagnoses a recording. Raises InputError where it cannot be used."""
    os.environ.update(ONE_THREAD)  # read when numpy is imported, which comes now
    clock = StageClock()
    from armlab.report.torque.write import diagnose_recording

    clock.begin(SECOND_STAGE)
    list(diagnose_recording(recording, out, baseline=None, seed=0, as_read=as_read, progress=clock.tell))
    clock.begin("")
    return clock


def time_functions(recording: Path, folder: Path, as_read: bool) -> list[FunctionTime]:
    """The functions of a diagnosis by the command line."""
    profile = folder / "profile"
    words = ["diagnose", str(recording), "--out", str(folder / "profiled"), *["--as-read"] * as_read]
    measure_run([sys.executable, "-m", "cProfile", "-o", str(profile), "-m", "armlab.cli.main", *words], ROOT)
    rows = pstats.Stats(str(profile)).stats.items()  # type: ignore[attr-defined]
    return [FunctionTime(_place(*where), calls, own, whole) for where, (_, calls, own, whole, _) in rows]


def _place(file: str, line: int, name: str) -> str:
    """A function in few words: without the folders of the environment and of this tree."""
    short = file.removeprefix(f"{ROOT}/").rpartition("site-packages/")[2]
    return name if file == "~" else f"{short}:{line} {name}"


def function_lines(functions: Sequence[FunctionTime], order: str) -> Iterator[str]:
    """A table of the functions that take most by an order: `own` or `cumulative`."""
    yield f"{'own s':>8}{'cumulative s':>14}{'calls':>10}  function, by {order} seconds"
    for each in sorted(functions, key=lambda each: -getattr(each, order))[:FUNCTIONS]:
        yield f"{each.own:>8.2f}{each.cumulative:>14.2f}{each.calls:>10}  {each.place}"


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(prog="python -m tools.profile_diagnosis")
    parser.add_argument("recording", type=Path)
    parser.add_argument("--as-read", action="store_true", help="do not ask how the recording is to be read")
    options = parser.parse_args()
    recording = options.recording.resolve()
    with TemporaryDirectory() as folder:
        try:
            print(*time_stages(recording, Path(folder) / "out", options.as_read).lines(), sep="\n", flush=True)
        except InputError as error:
            sys.exit(f"profile_diagnosis: {error}")
        functions = time_functions(recording, Path(folder), options.as_read)
    ours = [each for each in functions if each.place.startswith(ROOTS) and not each.place.startswith(COMMAND_LINE)]
    print("", *function_lines(functions, "own"), "", *function_lines(ours, "cumulative"), sep="\n")


if __name__ == "__main__":
    main()
