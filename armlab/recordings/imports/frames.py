"""Parquet, JSON, JSON lines and .npz as tables: nested names with points, lists as columns, stamps as seconds."""

import json
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.errors import InputError, in_one_line
from armlab.common.packages import MissingPackageError
from armlab.recordings.imports.matlab import table_of_arrays
from armlab.recordings.imports.time_columns import NO_STAMP, find_stamp_format, seconds_of
from armlab.recordings.table import HEADER_LINES, Table
from armlab.recordings.text_rows import open_lines

SAMPLE_CELLS = 200  # that tell how stamps are written
MIN_NUMBER_SHARE = 0.5  # of the cells of a column of text: else its numbers are chance


@dataclass(frozen=True, eq=False)
class FrameTable:
    """A table, and how columns that are stamps are written, by name; their numbers are seconds from the first one."""

    table: Table
    stamps: Mapping[str, str]


def read_parquet(path: Path) -> FrameTable:
    """The columns of a Parquet file; a column of lists of one length becomes several, NAME.0, NAME.1 and so on.

    Raises InputError for a file that is none.
    """
    try:
        from pyarrow import ArrowException, parquet
    except ImportError:
        raise MissingPackageError("pyarrow", f"{path}: Parquet") from None
    try:
        frame = parquet.read_table(path).to_pandas()
    except (ArrowException, OSError, ValueError) as error:
        raise InputError(f"cannot read {path} as Parquet: {in_one_line(error)[:200]}") from None
    return table_of_frame(frame, path)


def read_json(path: Path) -> FrameTable:
    """A list of rows, or columns by name, perhaps below other names; InputError for anything else."""
    with open_lines(path) as lines:
        text = "".join(line for _, line in lines)
    try:
        return table_of_frame(_frame_of(json.loads(text), path), path)
    except (ValueError, TypeError, RecursionError) as error:
        raise InputError(f"cannot read {path} as JSON: {in_one_line(error)[:200]}") from None


def read_json_lines(path: Path) -> FrameTable:
    """A row a line, each an object; a last line that is cut is left out. Raises InputError for anything else."""
    rows, broken = list[Any](), list[tuple[int, str]]()
    with open_lines(path) as lines:
        for number, line in lines:
            if not line.strip():
                continue
            try:
                rows.append(json.loads(line))
            except (ValueError, RecursionError) as error:
                broken.append((number, in_one_line(error)))
                rows.append(None)
    if broken and (len(broken) > 1 or rows[-1] is not None):
        raise InputError(f"{path}, line {broken[0][0]} is no JSON: {broken[0][1][:200]}")
    wrong = next((row for row in rows if row is not None and not isinstance(row, dict)), None)
    if wrong is not None:
        raise InputError(f'{path}: each line should be an object like {{"t": 0.0, "q1": 0.1}}, not {str(wrong)[:40]}')
    return table_of_frame(pd.json_normalize([row for row in rows if row is not None]), path)


def _frame_of(content: Any, path: Path) -> pd.DataFrame:
    """Rows or columns, wherever they stand below other names."""
    if isinstance(content, list) and content and all(isinstance(row, dict) for row in content):
        return pd.json_normalize(content)
    columns = dict(_columns(content)) if isinstance(content, dict) else {}
    rows = [value for value in columns.values() if value and all(isinstance(row, dict) for row in value)]
    if len(rows) == 1:
        return pd.json_normalize(rows[0])
    if not columns:
        raise InputError(
            f'{path} should hold a list of rows, [{{"t": 0.0, ...}}, ...], or lists by the names of columns'
        )
    while len({name.partition(".")[0] for name in columns}) == 1 and all("." in name for name in columns):
        columns = {name.partition(".")[2]: value for name, value in columns.items()}
    longest = max(len(value) for value in columns.values())
    return pd.DataFrame({name: value for name, value in columns.items() if len(value) == longest})


def _columns(content: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, list[Any]]]:
    for name, value in content.items():
        if isinstance(value, dict):
            yield from _columns(value, f"{prefix}{name}.")
        elif isinstance(value, list):
            yield f"{prefix}{name}", value


def table_of_frame(frame: pd.DataFrame, path: Path) -> FrameTable:
    """Columns of numbers; stamps and dates become seconds from the first one, other text becomes NaN.

    Raises InputError for a table without rows, and for lists of different lengths in one column.
    """
    if not len(frame):
        raise InputError(f"{path} holds no rows")
    columns, stamps = dict[str, Array](), dict[str, str]()
    for name, values in frame.items():
        for own, cells in _split_lists(str(name), values, path):
            columns[own], words = _numbers_of(cells)
            if words is not None:
                stamps[own] = words
    numbers = np.column_stack(list(columns.values()))
    numbers[np.isinf(numbers)] = np.nan
    return FrameTable(Table(path.name, tuple(columns), numbers, HEADER_LINES + 1 + np.arange(len(frame))), stamps)


def _split_lists(name: str, values: "pd.Series[Any]", path: Path) -> Iterator[tuple[str, "pd.Series[Any]"]]:
    """A column of lists as a column an entry."""
    first = next((each for each in values if each is not None), None)
    if not isinstance(first, list | tuple | np.ndarray):
        yield name, values
        return
    lengths = {len(each) for each in values if isinstance(each, list | tuple | np.ndarray)}
    if len(lengths) > 1:
        raise InputError(
            f"{path}: column {name} holds lists of {min(lengths)} to {max(lengths)} entries, not of one length"
        )
    for place in range(len(first)):
        entries = [each[place] if isinstance(each, list | tuple | np.ndarray) else None for each in values]
        yield from _split_lists(f"{name}.{place}", pd.Series(entries), path)


def _numbers_of(cells: "pd.Series[Any]") -> tuple[Array, str | None]:
    """Numbers, and how stamps are written where the cells are stamps."""
    if isinstance(cells.dtype, pd.DatetimeTZDtype) or cells.dtype.kind in "mM":
        plain = cells.dt.tz_convert(None) if isinstance(cells.dtype, pd.DatetimeTZDtype) else cells
        unit = "timedelta64[ns]" if plain.dtype.kind == "m" else "datetime64[ns]"
        return seconds_of(plain.to_numpy(dtype=unit).view(np.int64)), "time stamps"
    numbers = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan)
    if np.isfinite(numbers).mean() >= MIN_NUMBER_SHARE or not isinstance(next(iter(cells.dropna()), None), str):
        return numbers, None
    text = cells.fillna("").astype(str).tolist()
    known = find_stamp_format(text[:SAMPLE_CELLS])
    stamps = known.parse(text) if known is not None else np.full(len(text), NO_STAMP)
    return (seconds_of(stamps), known.words) if known is not None else (np.full(len(text), np.nan), None)


def read_npz(path: Path) -> Table:
    """Arrays of numbers of an .npz file as columns, as in a .mat file; InputError for a file that is none."""
    try:
        with np.load(path, allow_pickle=False) as content:
            arrays = [(str(name), np.asarray(content[name])) for name in content.files]
    except (OSError, ValueError, KeyError, EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile) as error:
        raise InputError(f"cannot read {path} as .npz: {in_one_line(error)[:200]}") from None
    numbers = [(name, array.astype(np.float64)) for name, array in arrays if array.dtype.kind in "fiub"]
    return table_of_arrays([each for each in numbers if each[1].ndim in (1, 2)], path)
