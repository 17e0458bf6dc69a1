"""The run store: finished trials in one SQLite file, safe against crashes and shared by several runners; and the
salvage of a damaged one.
"""

import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import fields
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armlab.common.errors import InputError
from bench.execute import Curves, Outcome

APPLICATION_ID = 0x41524D4C  # "ARML", in the header of the file: SQLite's own place for it
SCHEMA_VERSION = 1
_SCHEMA = """
CREATE TABLE trials (
    key TEXT PRIMARY KEY, value REAL, violation REAL, fitness REAL, evaluations INTEGER NOT NULL,
    seconds REAL NOT NULL, provenance INTEGER NOT NULL REFERENCES provenance (id)
) WITHOUT ROWID;
CREATE TABLE arrays (
    key TEXT NOT NULL REFERENCES trials (key), name TEXT NOT NULL, dtype TEXT NOT NULL, data BLOB NOT NULL,
    PRIMARY KEY (key, name)
) WITHOUT ROWID;
CREATE TABLE provenance (id INTEGER PRIMARY KEY, facts TEXT NOT NULL UNIQUE);
"""
_LATER_TABLES = (  # stores of older releases have none
    "CREATE TABLE IF NOT EXISTS failures (key TEXT PRIMARY KEY, reason TEXT NOT NULL) WITHOUT ROWID",
    "CREATE TABLE IF NOT EXISTS measured (key TEXT PRIMARY KEY, content TEXT NOT NULL) WITHOUT ROWID",
)
_BEST_X = "best_x"
_BYTES_PER_NUMBER = 8
_LOCK_TIMEOUT_S = 60.0
_LOCK_PAUSE_S = 0.02


class OutcomeFigures(NamedTuple):
    """The numbers of an `Outcome` without its arrays; dimension: of the search space."""

    value: float
    violation: float
    fitness: float
    evaluations: int
    seconds: float
    dimension: int


class RunStore:
    """Outcomes by trial key. A stored outcome is never replaced; a commit is on the disk when it returns."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self._connection = connection
        self.path = path

    def has(self, key: str) -> bool:
        """Whether the outcome of a key is stored."""
        with _errors_in_one_line(self.path):
            find = "SELECT 1 FROM trials WHERE key = ?"
            return self._connection.execute(find, (key,)).fetchone() is not None

    def add(self, outcomes: Sequence[tuple[str, Outcome]], provenance: str) -> None:
        """Write outcomes by key in one durable transaction; keys that another runner has written stay as they are."""
        with _errors_in_one_line(self.path), _transaction(self._connection) as sql:
            sql.execute("INSERT INTO provenance (facts) VALUES (?) ON CONFLICT DO NOTHING", (provenance,))
            (source,) = sql.execute("SELECT id FROM provenance WHERE facts = ?", (provenance,)).fetchone()
            for key, outcome in outcomes:
                _insert_outcome(sql, key, outcome, source)
                sql.execute("DELETE FROM failures WHERE key = ?", (key,))

    def note_failures(self, reasons: Iterable[tuple[str, str]]) -> None:
        """Remember by key why trials have no outcome, until they have one; they are run again all the same."""
        with _errors_in_one_line(self.path), _transaction(self._connection) as sql:
            sql.executemany("INSERT OR REPLACE INTO failures VALUES (?, ?)", reasons)

    def failure(self, key: str) -> str | None:
        """Why the last run of a trial gave no outcome; None where it was not run, or has one."""
        with _errors_in_one_line(self.path):
            row = self._connection.execute("SELECT reason FROM failures WHERE key = ?", (key,)).fetchone()
        return None if row is None else str(row[0])

    def get(self, key: str) -> Outcome:
        """The outcome of a key; raises KeyError if it is not stored."""
        figures = self.figures(key)
        with _errors_in_one_line(self.path):
            find = "SELECT name, dtype, data FROM arrays WHERE key = ?"
            blobs = self._connection.execute(find, (key,)).fetchall()
        arrays = {name: np.frombuffer(data, dtype) for name, dtype, data in blobs}
        best_x = arrays.pop(_BEST_X)
        return Outcome(*figures[:-1], best_x, Curves(**arrays))

    def figures(self, key: str) -> OutcomeFigures:
        """The numbers of an outcome without its arrays; raises KeyError if it is not stored."""
        find = (
            "SELECT value, violation, fitness, evaluations, seconds, length(data) FROM trials "
            f"JOIN arrays ON arrays.key = trials.key AND name = '{_BEST_X}' WHERE trials.key = ?"
        )
        with _errors_in_one_line(self.path):
            row = self._connection.execute(find, (key,)).fetchone()
        if row is None:
            raise KeyError(key)
        value, violation, fitness = (np.nan if number is None else number for number in row[:3])
        return OutcomeFigures(value, violation, fitness, row[3], row[4], row[5] // _BYTES_PER_NUMBER)

    def origins(self, keys: Iterable[str]) -> list[str]:
        """The provenance of the outcomes of these keys, each text once, in the order of their first use."""
        find = "SELECT facts FROM trials JOIN provenance ON provenance.id = trials.provenance WHERE key = ?"
        with _errors_in_one_line(self.path):
            found = (self._connection.execute(find, (key,)).fetchone() for key in keys)
            return list(dict.fromkeys(row[0] for row in found if row))

    def measured(self, key: str) -> str | None:
        """What was measured of some code and kept by its fingerprint, as text; None where it was not yet."""
        with _errors_in_one_line(self.path):
            row = self._connection.execute("SELECT content FROM measured WHERE key = ?", (key,)).fetchone()
        return None if row is None else str(row[0])

    def keep_measured(self, key: str, content: str) -> None:
        """Keep a measurement."""
        with _errors_in_one_line(self.path), _transaction(self._connection) as sql:
            sql.execute("INSERT OR REPLACE INTO measured VALUES (?, ?)", (key, content))

    def keys(self, prefix: str) -> list[str]:
        """The keys that begin with these hexadecimal digits."""
        find = "SELECT key FROM trials WHERE key >= ? AND key < ?"
        with _errors_in_one_line(self.path):
            return [key for (key,) in self._connection.execute(find, (prefix, f"{prefix}g")).fetchall()]

    def forget(self, keys: Iterable[str]) -> None:
        """Delete outcomes, so that they are computed again."""
        with _errors_in_one_line(self.path), _transaction(self._connection) as sql:
            for key in keys:
                sql.execute("DELETE FROM arrays WHERE key = ?", (key,))
                sql.execute("DELETE FROM trials WHERE key = ?", (key,))
                sql.execute("DELETE FROM failures WHERE key = ?", (key,))


@contextmanager
def open_store(path: Path) -> Iterator[RunStore]:
    """The store in a file, which is made if it does not exist.

    Raises InputError, in one line, for a folder or file that cannot be written, a corrupt file, another program's file,
    and a store of another version of the schema.
    """
    with _errors_in_one_line(path):
        connection = _connect(path)
    try:
        with _errors_in_one_line(path):
            _prepare_schema(connection, path)
        yield RunStore(connection, path)
    finally:
        connection.close()


def _connect(path: Path) -> sqlite3.Connection:
    path.parent.mkdir(parents=True, exist_ok=True)
    return sqlite3.connect(path, timeout=_LOCK_TIMEOUT_S, isolation_level=None)


def _prepare_schema(connection: sqlite3.Connection, path: Path) -> None:
    with _transaction(connection) as sql:
        (is_empty,) = sql.execute("SELECT count(*) = 0 FROM sqlite_master").fetchone()
        if is_empty:
            for statement in _SCHEMA.split(";"):
                sql.execute(statement)
            sql.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            sql.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        _check_header(sql, path)
        for statement in _LATER_TABLES:
            sql.execute(statement)
    _write_ahead(connection)
    connection.execute("PRAGMA synchronous = FULL")  # in WAL mode less would lose the last commits with the power


def _write_ahead(connection: sqlite3.Connection) -> None:
    """Turn the journal to WAL; SQLite does not wait for others that open a new store just then, so this does."""
    last = time.monotonic() + _LOCK_TIMEOUT_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > last:
                raise
        time.sleep(_LOCK_PAUSE_S)


def _check_header(sql: sqlite3.Connection, path: Path) -> None:
    (owner,) = sql.execute("PRAGMA application_id").fetchone()
    (version,) = sql.execute("PRAGMA user_version").fetchone()
    if owner != APPLICATION_ID:
        raise InputError(f"{path} is a database of another program: name another file with --store")
    if version != SCHEMA_VERSION:
        raise InputError(
            f"{path} is a run store of version {version}, this program writes version {SCHEMA_VERSION}: "
            f"delete it, or name another file with --store"
        )


def _insert_outcome(sql: sqlite3.Connection, key: str, outcome: Outcome, source: int) -> None:
    figures = (outcome.value, outcome.violation, outcome.fitness, outcome.evaluations, outcome.seconds)
    insert = "INSERT INTO trials VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT (key) DO NOTHING"
    cursor = sql.execute(insert, (key, *figures, source))
    if cursor.rowcount == 0:
        return
    curves = {field.name: getattr(outcome.curves, field.name) for field in fields(outcome.curves)}
    for name, array in {_BEST_X: outcome.best_x, **curves}.items():
        blob = (key, name, array.dtype.str, array.tobytes())
        sql.execute("INSERT INTO arrays VALUES (?, ?, ?, ?)", blob)


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    connection.execute("BEGIN IMMEDIATE")
    with connection:  # commits, or rolls back if anything is raised
        yield connection


@contextmanager
def _errors_in_one_line(path: Path) -> Iterator[None]:
    """Errors of the file system and of SQLite as InputError, in one line; mistakes in our own SQL stay as they are."""
    try:
        yield
    except OSError as error:
        raise InputError(f"cannot write the run store {path}: {error.strerror}") from None
    except (sqlite3.ProgrammingError, sqlite3.IntegrityError):
        raise
    except sqlite3.DatabaseError as error:
        raise InputError(f"cannot use the run store {path}: {error}{_advice_on_error(error, path)}") from None


def _advice_on_error(error: sqlite3.DatabaseError, path: Path) -> str:
    """What the user can do about an error."""
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # the rest says more than anyone wants to know
    if code in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR):
        return "; all outcomes stored before are safe: free some space, and the same command continues"
    if code == sqlite3.SQLITE_CORRUPT:
        return f"; `armlab bench salvage {path} --out NEW` takes what is readable into a new store"
    return ""


_KEY_PREFIXES = [f"{number:03x}" for number in range(16**3)]  # a damaged page costs those that lead over it
_OUTCOMES_PER_TRANSACTION = 1000  # outcomes a transaction
StoredOutcome = tuple[str, Outcome, str]


def salvage(damaged: Path, out: Path) -> int:
    """Copy every outcome that can be read into a new store; returns their number. The damaged file is not changed.

    Raises InputError if there is no such file, if nothing of it can be read, or if the new store exists.
    """
    if not damaged.is_file():
        raise InputError(f"there is no run store {damaged}")
    if out.exists():
        raise InputError(f"{out} exists already: name a new file with --out")
    with _open_to_read(damaged) as source:
        # else SQLite reads nothing of a file that is too short
        source._connection.execute("PRAGMA writable_schema = ON")
        found = _read_outcomes(source)
        first = next(found, None)
        if first is None:
            raise InputError(f"nothing of {damaged} can be read: it is no run store, or its beginning is damaged")
        with open_store(out) as store:
            return _write_outcomes(chain([first], found), store)


def copy_outcomes(part: Path, store: RunStore) -> int:
    """Copy the outcomes of another store that this one lacks, and why trials without one failed; returns their number.

    Raises InputError for a file that is no run store, and for a trial that has another end in each.
    """
    with _open_to_read(part) as source, _errors_in_one_line(part):
        keys = source.keys("")
        for key in keys:
            if store.has(key) and not _same_end(source.figures(key), store.figures(key)):
                raise InputError(f"trial {key[:12]} of {part} has another end in an earlier part")
        count = _write_outcomes(
            ((key, source.get(key), source.origins([key])[0]) for key in keys if not store.has(key)), store
        )
        with suppress(sqlite3.OperationalError):  # a store of an older release has no such table
            failed = source._connection.execute("SELECT key, reason FROM failures").fetchall()
            store.note_failures([(key, reason) for key, reason in failed if not store.has(key)])
    return count


def _same_end(one: OutcomeFigures, other: OutcomeFigures) -> bool:
    """Whether value and violation agree; two values that are not numbers do."""
    return bool(np.array_equal([one.value, one.violation], [other.value, other.violation], equal_nan=True))


def store_origins(path: Path) -> list[str]:
    """The provenance of all outcomes in a store; raises InputError for a file that is no run store."""
    with _open_to_read(path) as source, _errors_in_one_line(path):
        return [facts for (facts,) in source._connection.execute("SELECT facts FROM provenance").fetchall()]


@contextmanager
def _open_to_read(path: Path) -> Iterator[RunStore]:
    """A store that is not changed."""
    with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as connection:
        yield RunStore(connection, path)


def _write_outcomes(found: Iterator[StoredOutcome], store: RunStore) -> int:
    count = 0
    while piece := list(islice(found, _OUTCOMES_PER_TRANSACTION)):
        for origin in dict.fromkeys(origin for _, _, origin in piece):
            store.add([(key, outcome) for key, outcome, its in piece if its == origin], origin)
        count += len(piece)
    return count


def _read_outcomes(store: RunStore) -> Iterator[StoredOutcome]:
    for prefix in _KEY_PREFIXES:
        for key in _read_keys(store, prefix):
            with suppress(InputError, LookupError, TypeError, ValueError):  # whatever damage makes of a row
                yield key, store.get(key), store.origins([key])[0]


def _read_keys(store: RunStore, prefix: str) -> list[str]:
    """The keys with a prefix, or, where the prefix leads over a damaged page, those with the longer prefixes that can
    be read.
    """
    try:
        return store.keys(prefix)
    except InputError:
        longer = [f"{prefix}{digit:x}" for digit in range(16)] if len(prefix) == len(_KEY_PREFIXES[0]) else []
        return [key for one in longer for key in _read_keys(store, one)]
