"""What a command takes in a process of its own: seconds, processor seconds and memory."""

import os
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")  # of linear algebra


@dataclass(frozen=True)
class MeasuredRun:
    """A command that has ended. processor_seconds: of all its threads, user and system. complaint: its error stream."""

    status: int
    complaint: str
    seconds: float
    processor_seconds: float
    memory_bytes: int


def measure_run(command: Sequence[str], folder: Path) -> MeasuredRun:
    """Runs a command in a folder, with one thread for linear algebra; what it prints is lost."""
    start = time.monotonic()
    with TemporaryFile() as said:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env={**os.environ, **ONE_THREAD},
            stdout=subprocess.DEVNULL,
            stderr=said,
            stdin=subprocess.DEVNULL,
        )
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        complaint = said.read().decode(errors="replace").strip()
    return MeasuredRun(
        status=child.returncode,
        complaint=complaint,
        seconds=time.monotonic() - start,
        processor_seconds=usage.ru_utime + usage.ru_stime,
        memory_bytes=peak_memory_bytes(usage),
    )


def peak_memory_bytes(usage: resource.struct_rusage) -> int:
    """The most memory that a process had at once."""
    return usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)  # what the system counts in
