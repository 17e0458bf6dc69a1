"""Errors that a user can cause, explained in one line; any other exception is a mistake in the program."""


class InputError(Exception):
    """A user's mistake; the message is one line that says what was wrong, where, and what would be right."""


class UndecidedError(InputError):
    """Several answers are possible, and the user has to choose one with an option of the command."""

    def __init__(self, message: str, option: str, choices: tuple[str, ...]) -> None:
        super().__init__(message)
        self.option = option
        self.choices = choices


class DataError(ValueError):
    """Data or settings that a computation cannot use; the message says why, without the place that the caller knows."""


class PlugInWarning(UserWarning):
    """A plug-in is left out."""


def in_one_line(error: BaseException) -> str:
    """The text of an error without the line ends that third parties put into it."""
    return " ".join(str(error).split())


def describe_failure(error: BaseException) -> str:
    """What went wrong in code of a third party, in one line."""
    kind = "it ends the program (sys.exit)" if isinstance(error, SystemExit) else type(error).__name__
    text = in_one_line(error)
    return f"{kind}: {text}" if text else kind
