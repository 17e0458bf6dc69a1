"""Two runners on one store: the first goes in order, every other one in an order of its own, and few trials run twice.

What is finished is looked up right before a batch goes out, so all that two runners can do twice is under way in both.
"""

import fcntl
import os
import random
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from bench.plan import Entry

_BLOCK = 50  # trials that stay together, since neighbours have their problem in common


@contextmanager
def shared_out(entries: Sequence[Entry], store: Path) -> Iterator[Iterator[Entry]]:
    """The entries in the order in which this runner should take them; the lock of a dead runner is no lock."""
    folder = os.open(store.parent, os.O_RDONLY)
    try:
        yield iter(entries) if _is_first(folder) else _scattered(entries)
    finally:
        os.close(folder)


def _is_first(folder: int) -> bool:
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another has it, or the file system knows no locks
        return False
    return True


def _scattered(entries: Sequence[Entry]) -> Iterator[Entry]:
    chance = random.Random()  # unlike that of every other runner; no outcome depends on it
    starts = range(0, len(entries), _BLOCK)
    late = sorted(starts, key=lambda start: (2 * start < len(entries), chance.random()))  # where the first is not yet
    for start in late:
        block = entries[start : start + _BLOCK]
        yield from chance.sample(block, len(block))  # two runners in one block are not in step either
