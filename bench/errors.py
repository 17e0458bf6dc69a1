"""Errors that end a run before all of it is done."""

from pathlib import Path


class StoppedError(Exception):
    """The user stopped the run; the message says what is kept and how to go on."""


class TrialsFailedError(Exception):
    """Some trials failed; the message lists each with its reason. All others are kept.

    written: the results of what there is.
    """

    def __init__(self, message: str, written: tuple[Path, ...] = ()) -> None:
        super().__init__(message)
        self.written = written
