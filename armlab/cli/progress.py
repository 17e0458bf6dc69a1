"""What a long command shows on the terminal's error stream: what is being done, for how long, and the time left.

The time left is t (1 - s) / s, where a share s of the work is done after t seconds. `step_shares.py` knows what share
of its command has passed when a message comes. Of a message with "2 of 5" in it that is unknown there, s is the share
of this step alone, and t counts from its first message.
"""

import re
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import monotonic

import click

from armlab.cli.step_shares import SHARES, USUAL_S

SHOWN_AFTER_S = 2.0  # of work: what is faster needs no line
TICK_S = 1.0  # from one line to the next
MIN_SHARE = 0.02  # of the work: less says nothing of the pace
COUNTED = re.compile(r"\b(\d+) of (\d+)\b")


@dataclass(frozen=True)
class StepShares:
    """How a command passes its time. usual_s: in all, s. shares: done when a message comes first, by its key."""

    usual_s: float | None = None
    shares: Mapping[str, float] = field(default_factory=dict)

    def end_of(self, key: str) -> float:
        """The share that is done when the step after this one begins."""
        own = self.shares.get(key, 0.0)
        return min((share for share in self.shares.values() if share > own), default=1.0)


def step_key(message: str) -> str:
    """A message without its numbers."""
    return re.sub(r"\d+", "#", message)


def known_steps(name: str) -> StepShares:
    """Of a command, or of a command and its first message where it does several things; empty where unknown."""
    return StepShares(USUAL_S.get(name), SHARES.get(name, {}))


class Progress:
    """Tells in one line what is being done, once a second; nothing where the error stream is no terminal."""

    def __init__(self, command: str, quiet: bool, clock: Callable[[], float] = monotonic) -> None:
        self.quiet = quiet
        self.shown = sys.stderr.isatty() and not quiet
        self._command, self._clock, self._start = command, clock, clock()
        self._message, self._steps = "", known_steps(command)
        self._step, self._since, self._share, self._share_at = "", self._start, 0.0, self._start
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._ticker: threading.Thread | None = None

    def start(self) -> None:
        """Show a line each second until `stop`."""
        if self.shown:
            self._ticker = threading.Thread(target=self._tick, daemon=True)
            self._ticker.start()

    def stop_ticking(self) -> None:
        """Show a line only when a message is told."""
        self._ended.set()
        if self._ticker is not None:
            self._ticker.join()
            self._ticker = None

    def stop(self) -> None:
        """Show nothing more, and take the line away."""
        self.stop_ticking()
        self.clear()
        self.shown = False

    def tell(self, message: str) -> None:
        """Show a message in place of the one before."""
        with self._lock:
            self._take(message)
            self._write(self.line())

    def take_line(self, line: str) -> None:
        """Learn from a line of the result with "2 of 5" in it how far the command is."""
        with self._lock:
            if COUNTED.search(line):
                self._take(line.strip())

    def _take(self, message: str) -> None:
        key, counted, now = step_key(message), COUNTED.search(message), self._clock()
        if not self._message:
            own = known_steps(f"{self._command}: {key}")
            self._steps = own if own.usual_s is not None else self._steps
        self._message = message
        within = (int(counted[1]) - 1) / max(int(counted[2]), 1) if counted else 0.0
        known = self._steps.shares.get(key)
        if known is not None:
            share = known + (self._steps.end_of(key) - known) * min(within, 1.0)
            if share > self._share:
                self._share, self._share_at = share, now
        elif counted and not self._steps.shares:
            step = key.partition(":")[0]
            if step != self._step:
                self._step, self._since = step, now
            self._share, self._share_at = min(within, 1.0), now

    def clear(self) -> None:
        """Take the line away."""
        with self._lock:
            self._write("")

    def line(self) -> str:
        """The message with the seconds that have passed and those that are left."""
        passed = self._clock() - self._start
        text = f"{self._message or self._command} ..."
        if passed < SHOWN_AFTER_S:
            return text
        return f"{text} {in_time_words(passed)}{self._left_in_words(passed)}"

    def _left_in_words(self, passed: float) -> str:
        if self._share >= MIN_SHARE:
            spent = self._share_at - self._since
            left = spent * (1 - self._share) / self._share - (self._clock() - self._share_at)
        elif self._steps.usual_s is not None:
            left = self._steps.usual_s - passed
        else:
            return ""
        return f", about {in_time_words(left)} left" if left > 0 else ", longer than usual"

    def _tick(self) -> None:
        while not self._ended.wait(TICK_S):
            with self._lock:
                if self._clock() - self._start >= SHOWN_AFTER_S:
                    self._write(self.line())

    def _write(self, text: str) -> None:
        if self.shown:
            click.echo(f"\r\033[K{text}", nl=False, err=True)


def in_time_words(seconds: float) -> str:
    """`35 s`, `4 min` or `2.5 h`."""
    if seconds < 100:
        return f"{max(round(seconds), 1)} s"
    return f"{seconds / 60:.0f} min" if seconds < 100 * 60 else f"{seconds / 3600:.1f} h"
