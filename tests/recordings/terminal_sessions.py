"""A command in a pseudo terminal, answered as a person answers it."""

import os
import pty
import re
import select
import signal
import sys
import time
from pathlib import Path

TIMEOUT_S = 120.0  # of one answer: generous, a slow machine is no failure
PATIENCE_S = 10.0  # of a person who pressed Ctrl-C
CODE = "import sys; from armlab.cli.main import main; main(sys.argv[1:], prog_name='armlab')"


class TerminalSession:
    """`armlab` with these words in a pseudo terminal, in a working folder of its own."""

    def __init__(self, words: list[str], folder: Path) -> None:
        self.text = ""
        self._shown = 0
        self._open = True
        path = os.pathsep.join(sys.path)
        self._process, self._terminal = pty.fork()
        if self._process == 0:
            os.chdir(folder)
            signal.signal(
                signal.SIGINT, signal.SIG_DFL
            )  # a job in the background ignores it, and so would its children
            environment = {**os.environ, "PYTHONPATH": path, "TERM": "dumb", "COLUMNS": "80"}
            os.execve(sys.executable, [sys.executable, "-c", CODE, *words], environment)

    def wait_for(self, pattern: str) -> str:
        """The new text up to the first match of a pattern; AssertionError where it does not come."""
        end = time.monotonic() + TIMEOUT_S
        while (match := re.search(pattern, self.text[self._shown :])) is None:
            if not self._open or time.monotonic() > end:
                raise AssertionError(f"{pattern!r} did not come after:\n{self.text}")
            self._read(end - time.monotonic())
        new = self.text[self._shown : self._shown + match.end()]
        self._shown += match.end()
        return new

    def answer(self, text: str) -> None:
        """Type a line."""
        os.write(self._terminal, f"{text}\n".encode())

    def interrupt(self) -> None:
        """Press Ctrl-C, and again where it was lost: between a prompt and its answer Python may miss one."""
        end = time.monotonic() + TIMEOUT_S
        while self._open and time.monotonic() < end:
            os.write(self._terminal, b"\x03")
            while self._read(PATIENCE_S):
                pass

    def finish(self) -> int:
        """The exit status, once the command has ended."""
        end = time.monotonic() + TIMEOUT_S
        while self._open and time.monotonic() < end:
            self._read(end - time.monotonic())
        os.close(self._terminal)
        return os.waitstatus_to_exitcode(os.waitpid(self._process, 0)[1])

    def _read(self, seconds: float) -> bool:
        """Whether something came in this time."""
        if not select.select([self._terminal], [], [], max(seconds, 0))[0]:
            return False
        try:
            new = os.read(self._terminal, 4096)
        except OSError:  # what Linux gives for a terminal whose other end is closed
            new = b""
        self.text += new.decode(errors="replace").replace("\r\n", "\n")
        self._open = bool(new)
        return self._open
