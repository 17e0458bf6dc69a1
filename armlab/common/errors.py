"""The error that a user sees: a mistake in their input, explained in one line."""


class InputError(Exception):
    """A user's mistake; the message is one line that says what was wrong, where, and what would be right."""
