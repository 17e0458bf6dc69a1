"""Writes `armlab/cli/step_shares.py`: what share of its time a command has passed when each of its messages comes.

    python tools/step_shares.py RECORDING ... [--results CONFIG]

Runs the long commands on each recording (of torque, or of motion only) and takes the mean. One core, nothing beside it.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

import numpy as np

from armlab.cli import output
from armlab.cli.main import main
from armlab.cli.progress import Progress, step_key
from armlab.recordings.motion import is_motion_only
from armlab.recordings.recording_file import read_recording_file

TARGET = Path(__file__).parents[1] / "armlab/cli/step_shares.py"
HEAD = '''"""How long commands take, and what share has passed when a message comes: written by tools/step_shares.py.

By command, or by command and first message; means over the recordings that were given. Do not edit.
"""

from collections.abc import Mapping
'''
Told = dict[str, list[list[tuple[float, str]]]]


def commands_of(recording: Path, work: Path) -> Iterator[list[str]]:
    """The long commands on a recording, in the order in which one needs what another wrote."""
    yield ["recording", "check", str(recording), "--out", str(work / "check.html")]
    yield ["diagnose", str(recording), "--out", str(work / "verdict")]
    if is_motion_only(recording):
        return
    yield ["identify", str(recording), "--out", str(work / "model")]
    yield ["identify", str(recording), "--select", "--as-read", "--out", str(work / "selected")]
    yield ["predict", str(work / "selected" / "model.yaml"), str(recording)]
    yield ["payload", str(recording)]
    name = read_recording_file(recording).robot
    robot = str(recording / name) if (recording / name).is_file() else name
    verdict = str(work / "verdict" / "verdict.json")
    yield ["next", verdict, "--robot", robot, "--recording", str(recording), "--out", str(work / "next")]
    yield ["model", "confusability", robot, str(recording)]


def measure(words: list[str], told: Told) -> None:
    """Runs a command, and keeps its messages with their seconds under its name."""
    messages: list[tuple[float, str]] = []
    start = monotonic()

    class Recorder(Progress):
        def tell(self, message: str) -> None:
            messages.append((monotonic() - start, message))

    usual, output.Progress = output.Progress, Recorder
    try:
        code = main(words, standalone_mode=False)
    finally:
        output.Progress = usual
    if code:
        print(f"left out: {' '.join(words)}", file=sys.stderr)
        return
    messages.append((monotonic() - start, ""))
    noun = " ".join(words[: 2 if words[0] in ("recording", "model") else 1])
    name = f"{noun}: {step_key(messages[0][1])}" if len(messages) > 1 else noun
    told.setdefault(name, []).append(messages)
    told.setdefault(noun, []).append([messages[-1]])
    print(f"{noun}: {messages[-1][0]:.1f} s", file=sys.stderr)


def module_text(told: Told) -> str:
    """The module: USUAL_S and SHARES."""
    usual, shares = list[str](), list[str]()
    for name, runs in sorted(told.items()):
        usual.append(f'    "{name}": {np.mean([run[-1][0] for run in runs]):.1f},')
        passed: dict[str, list[float]] = {}
        for run in runs:
            first = dict(reversed([(step_key(message), seconds) for seconds, message in run[:-1]]))
            for key, seconds in first.items():
                passed.setdefault(key, []).append(seconds / run[-1][0])
        means = sorted((float(np.mean(values)), key) for key, values in passed.items())
        if means:
            shares += [f'    "{name}": {{', *(f'        "{key}": {mean:.3f},' for mean, key in means), "    },"]
    typed = "SHARES: Mapping[str, Mapping[str, float]] = {"
    return "\n".join([HEAD, "USUAL_S: Mapping[str, float] = {", *usual, "}", typed, *shares, "}", ""])


def run() -> None:
    """Measures all commands and writes the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", nargs="+", type=Path)
    parser.add_argument("--results", type=Path)
    given = parser.parse_args()
    told: Told = {}
    for recording in given.recordings:
        with TemporaryDirectory() as work:
            for words in commands_of(recording, Path(work)):
                measure(words, told)
    if given.results:
        measure(["report", str(given.results)], told)
    TARGET.write_text(module_text(told), encoding="utf-8")


if __name__ == "__main__":
    run()
