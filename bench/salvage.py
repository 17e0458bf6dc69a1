"""What is readable of a damaged run store, taken into a new one."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, suppress
from itertools import islice
from pathlib import Path

from bench.outcome import Outcome
from bench.store import RunStore, open_store
from problem.errors import InputError

_PREFIXES = [f"{number:03x}" for number in range(16**3)]  # a damaged page costs those that lead over it
_AT_A_TIME = 1000  # outcomes a transaction
Found = tuple[str, Outcome, str]


def salvage(damaged: Path, out: Path) -> int:
    """Take every outcome that can be read into a new store; returns how many those are. The damaged one stays as it is.

    Raises InputError if there is no such file, nothing of it can be read, or the new store exists.
    """
    if not damaged.is_file():
        raise InputError(f"there is no run store {damaged}")
    if out.exists():
        raise InputError(f"{out} is there already: name a new file with --out")
    with closing(sqlite3.connect(f"{damaged.resolve().as_uri()}?mode=ro", uri=True)) as connection:
        connection.execute("PRAGMA writable_schema = ON")  # else SQLite reads nothing of a file that is too short
        found = _readable(RunStore(connection, damaged))
        first = next(found, None)
        if first is None:
            raise InputError(f"nothing of {damaged} can be read: it, or its beginning, is no store's")
        return _write([first], found, out)


def _write(piece: list[Found], found: Iterator[Found], out: Path) -> int:
    count = 0
    with open_store(out) as store:
        while piece:
            for origin in dict.fromkeys(origin for _, _, origin in piece):
                store.add([(key, outcome) for key, outcome, its in piece if its == origin], origin)
            count += len(piece)
            piece = list(islice(found, _AT_A_TIME))
    return count


def _readable(store: RunStore) -> Iterator[Found]:
    for prefix in _PREFIXES:
        for key in _keys(store, prefix):
            with suppress(InputError, LookupError, TypeError, ValueError):  # whatever damage makes of a row
                yield key, store.get(key), store.origins([key])[0]


def _keys(store: RunStore, prefix: str) -> list[str]:
    """Of a prefix, or, where it leads over a damaged page, of those longer ones that do not."""
    try:
        return store.keys(prefix)
    except InputError:
        longer = [f"{prefix}{digit:x}" for digit in range(16)] if len(prefix) == len(_PREFIXES[0]) else []
        return [key for one in longer for key in _keys(store, one)]
