"""The command in a process of its own, with an eye on its memory and its clock."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_SECONDS_BETWEEN_LOOKS = 0.1
_BYTES_A_PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Watched:
    """A finished command: seconds by a clock that nobody sets, and its resident memory, MB, evenly spaced in time.

    memory: of the command itself, without its workers.
    """

    seconds: float
    memory: tuple[float, ...]

    @property
    def peak(self) -> float:
        """The most memory that was seen, MB."""
        return max(self.memory)

    def after(self, share: float) -> float:
        """Memory, MB, when that share of the time was over."""
        return self.memory[min(int(share * len(self.memory)), len(self.memory) - 1)]


def watch(arguments: Sequence[object], folder: Path) -> Watched:
    """Run `armlab` with arguments in a folder to its end; raises CalledProcessError if it fails."""
    began = time.monotonic()
    running = start(arguments, folder)
    memory = [_resident(running.pid)]
    while running.poll() is None:
        time.sleep(_SECONDS_BETWEEN_LOOKS)
        memory.append(_resident(running.pid) or memory[-1])
    seconds = time.monotonic() - began
    if running.returncode:
        raise subprocess.CalledProcessError(running.returncode, running.args)
    return Watched(seconds, tuple(memory))


def start(arguments: Sequence[object], folder: Path) -> "subprocess.Popen[bytes]":
    """Begin to run `armlab` with arguments in a folder, its files not listed."""
    command = [sys.executable, "-m", "bench.cli", *map(str, arguments)]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL)


def _resident(pid: int) -> float:
    """Resident memory of a process, MB; 0 if it is gone. Linux tells it in /proc."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * _BYTES_A_PAGE / 1e6
