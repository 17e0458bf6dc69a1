"""Run files, CSV or Parquet, as named columns of numbers; a cell without a number becomes NaN."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.recording import Finding

HEADER_LINES = 1
MAX_TEXT_BYTES = 2 * 10**9  # a text of this size needs about 20 GB of memory
MAX_COLUMNS = 5_000  # of a table: a header of more is no log of an arm


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one file.

    values: (rows, columns), NaN where a cell holds no number. row_numbers: (rows,), number of each row in the
    file; the header is row 1.
    """

    file: str
    names: tuple[str, ...]
    values: Array
    row_numbers: NDArray[np.intp]
    findings: tuple[Finding, ...] = ()

    @cached_property
    def empty(self) -> tuple[str, ...]:
        """Columns without any number."""
        return tuple(np.array(self.names)[np.isnan(self.values).all(axis=0)].tolist())

    @property
    def filled(self) -> tuple[str, ...]:
        """Columns with numbers, which may be signals."""
        empty = set(self.empty)
        return tuple(name for name in self.names if name not in empty)

    def columns(self, wanted: Sequence[str], signal: str) -> Array:
        """The wanted columns (rows, wanted); InputError names the first that is missing."""
        for name in wanted:
            if name not in self.names:
                hint = suggest_name(name, self.names)
                raise InputError(f"no column '{name}' (columns.{signal}) in {self.file}: {hint}")
        return self.values[:, [self.names.index(name) for name in wanted]]


def read_table(path: Path) -> Table:
    """The columns of a .csv or .parquet file.

    A last row that is cut short is left out, and a finding says so. Raises InputError for a file that cannot be read,
    has no rows, a column twice, or a row of the wrong length before the last.
    """
    readers = {".csv": _read_csv, ".parquet": _read_parquet}
    if path.suffix.lower() not in readers:
        raise InputError(f"run {path}: should be .csv or .parquet; `armlab recording import` reads other formats")
    table = readers[path.suffix.lower()](path)
    twice = sorted({name for name in table.names if table.names.count(name) > 1})
    if twice:
        raise InputError(f"{path}: column '{twice[0]}' appears twice")
    if not len(table.values):
        raise InputError(f"{path} holds no rows")
    return table


def _read_csv(path: Path) -> Table:
    text = read_text(path)
    rows = split_rows(text, ",", str(path))
    if not rows:
        raise InputError(f"{path} is empty: it should start with a row of column names")
    names = tuple(name.strip() for name in rows[0][1])
    check_column_count(len(names), path)
    body = rows[HEADER_LINES:]
    body, findings = drop_broken_last_row(body, len(names), text, str(path))
    values = np.array([parse_numbers(cells) for _, cells in body]).reshape(len(body), len(names))
    return Table(path.name, names, values, np.array([line for line, _ in body], dtype=np.intp), findings)


def check_column_count(columns: int, path: Path) -> None:
    """Raises InputError for more columns than the log of an arm has."""
    if columns > MAX_COLUMNS:
        raise InputError(f"{path} has {columns} columns; at most {MAX_COLUMNS} can be read: is it transposed?")


def read_text(path: Path) -> str:
    """The text of a file with its own line ends; InputError if it is missing or not UTF-8 text."""
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"cannot read {path}: it is no regular file")
        if path.stat().st_size > MAX_TEXT_BYTES:
            raise InputError(f"{path} is larger than {MAX_TEXT_BYTES // 10**9} GB: give Parquet or shorter runs")
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not UTF-8 text (byte {error.start}): is it a CSV file?") from None


def split_rows(text: str, separator: str, where: str) -> list[tuple[int, list[str]]]:
    """Line number and cells of each line that is not empty."""
    reader = csv.reader(text.splitlines(), delimiter=separator)
    try:
        return [(reader.line_num, cells) for cells in reader if any(cell.strip() for cell in cells)]
    except csv.Error as error:
        raise InputError(f"{where}, line {reader.line_num}: not valid CSV: {error}") from None


def drop_broken_last_row(
    body: list[tuple[int, list[str]]], width: int, text: str, where: str
) -> tuple[list[tuple[int, list[str]]], tuple[Finding, ...]]:
    """The rows without a last row that was cut off while it was written.

    Raises InputError for a row of the wrong length anywhere else.
    """
    for line, cells in islice(body, max(len(body) - 1, 0)):
        if len(cells) != width:
            raise InputError(f"{where}, line {line}: {len(cells)} cells where the header has {width}")
    if not body:
        return body, ()
    line, cells = body[-1]
    if len(cells) > width:
        raise InputError(f"{where}, line {line}: {len(cells)} cells where the header has {width}")
    if len(cells) == width and text[-1] in "\r\n":
        return body, ()
    lack = f"has {len(cells)} cells of {width}" if len(cells) < width else "has no line end: a number may be cut"
    return body[:-1], (Finding("broken_last_row", "repaired", f"the last row (line {line}) {lack}; left out"),)


def parse_numbers(cells: Sequence[str]) -> list[float]:
    """The cells as numbers, NaN for a cell that is not a number."""
    try:
        return [float(cell) for cell in cells] if "_" not in "".join(cells) else [_parse_number(cell) for cell in cells]
    except ValueError:
        return [_parse_number(cell) for cell in cells]


def _parse_number(cell: str) -> float:
    try:
        return float(cell) if "_" not in cell else float("nan")
    except ValueError:
        return float("nan")


def _read_parquet(path: Path) -> Table:
    try:
        import pyarrow as arrow
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: to read Parquet install pyarrow: pip install 'armlab[recordings]'") from None
    try:
        columns = parquet.read_table(path)
        names = tuple(str(name) for name in columns.column_names)
        values = [column.cast(arrow.float64()).to_numpy(zero_copy_only=False) for column in columns.columns]
    except (arrow.ArrowException, OSError) as error:
        raise InputError(f"cannot read {path} as Parquet: {' '.join(str(error).split())[:200]}") from None
    rows = columns.num_rows
    table = np.column_stack(values) if values else np.empty((rows, 0))
    return Table(path.name, names, table, HEADER_LINES + 1 + np.arange(rows))
