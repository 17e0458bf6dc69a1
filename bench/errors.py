"""Errors that end a run before its results are written."""


class StoppedError(Exception):
    """The user stopped the run; the message says what is kept and how to go on."""


class TrialsFailedError(Exception):
    """Some trials raised; the message lists each with its error. All others are kept."""
