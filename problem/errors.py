"""The one error that a person sees: a mistake in what they gave, said in one line."""


class InputError(Exception):
    """A user's mistake; the message is one line that says what was wrong, where, and what would be right."""
