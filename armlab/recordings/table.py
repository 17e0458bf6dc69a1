"""Run files, CSV or Parquet, as named columns of numbers; a cell without a number becomes NaN."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError, in_one_line
from armlab.common.packages import MissingPackageError
from armlab.common.settings import suggest_name
from armlab.recordings.recording import Finding
from armlab.recordings.text_rows import RowLayout, open_lines, read_rows, split_line

HEADER_LINES = 1
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

    def view(self, wanted: Sequence[str], signal: str) -> Array:
        """The same to look at, not to change: no copy where the columns stand in a row."""
        first = self.names.index(wanted[0]) if wanted[0] in self.names else 0
        if self.names[first : first + len(wanted)] == tuple(wanted):
            return self.values[:, first : first + len(wanted)]
        return self.columns(wanted, signal)


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
    with open_lines(path) as lines:
        header = next((line for _, line in lines if line.strip(', "\t\r\n')), "")
        if not header:
            raise InputError(f"{path} is empty: it should start with a row of column names")
        names = tuple(name.strip() for name in split_line(header, ",", str(path)))
        check_column_count(len(names), path)
        rows = read_rows(lines, RowLayout(",", len(names)), str(path))
    return Table(path.name, names, rows.values, rows.numbers, rows.findings)


def check_column_count(columns: int, path: Path) -> None:
    """Raises InputError for more columns than the log of an arm has."""
    if columns > MAX_COLUMNS:
        raise InputError(f"{path} has {columns} columns; at most {MAX_COLUMNS} can be read: is it transposed?")


def has_parquet() -> bool:
    """Whether Parquet can be read and written here."""
    return find_spec("pyarrow") is not None


def _read_parquet(path: Path) -> Table:
    """Column by column, so that memory holds the numbers once."""
    try:
        import pyarrow as arrow
        from pyarrow import parquet
    except ImportError:
        raise MissingPackageError("pyarrow", f"{path}: Parquet") from None
    try:
        with parquet.ParquetFile(path, pre_buffer=False) as file:
            names = tuple(file.schema_arrow.names)
            rows = file.metadata.num_rows
            values = np.empty((rows, len(names)))
            for place, name in enumerate(names):
                column = file.read(columns=[name], use_threads=False)
                values[:, place] = column.columns[0].cast(arrow.float64()).to_numpy(zero_copy_only=False)
                del column
                arrow.default_memory_pool().release_unused()
    except (arrow.ArrowException, OSError, IndexError) as error:
        raise InputError(f"cannot read {path} as Parquet: {in_one_line(error)[:200]}") from None
    return Table(path.name, names, values, HEADER_LINES + 1 + np.arange(rows))
