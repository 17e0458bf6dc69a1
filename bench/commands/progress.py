"""The progress bar of commands that work for long."""

from typing import Any


def trial_bar(total: int, done: int) -> Any:
    """A bar over trials with the time left; silent where no one watches."""
    from tqdm import tqdm

    return tqdm(total=total, initial=done, unit="trial", disable=None)  # None: only on a terminal
