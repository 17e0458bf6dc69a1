"""CSV files of any layout: any separator, decimal comma, rows of units, comments, with or without a header."""

import re
from collections.abc import Iterator, Set
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.table import (
    Table,
    check_column_count,
    drop_broken_last_row,
    parse_numbers,
    read_text,
    split_rows,
)

SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", " ": "blank"}
DECIMALS = (".", ",")
COMMENT_START = re.compile(r"^\s*[#%!]+\s*")
SAMPLE_LINES = 200
MIN_DATA_ROWS = 2
NO_NUMBER = ("", "nan", "null", "none", "na", "n/a")  # cells that stand for a number that is missing, in lower case
NumberedRows = list[tuple[int, list[str]]]


@dataclass(frozen=True)
class Layout:
    """How a text file is written: cell separator and decimal sign."""

    separator: str
    decimal: str

    def __str__(self) -> str:
        """In words."""
        return f"separator {SEPARATORS.get(self.separator, self.separator)}, decimal '{self.decimal}'"


@dataclass(frozen=True, eq=False)
class TextTable:
    """A table with the layout of the file, and the units that the file names."""

    table: Table
    layout: Layout
    units: dict[str, str]


def read_odd_csv(path: Path, separator: str | None = None, decimal: str | None = None) -> TextTable:
    """The columns of a text file with numbers; without a header they are called c1, c2, ...

    A column without any number becomes NaN. separator, decimal: found in the file if left out. Raises InputError for a
    file without rows of numbers, and for rows of different length before the last.
    """
    if separator is not None and (len(separator) != 1 or separator in '\r\n"'):
        words = ", ".join(SEPARATORS.values())
        raise InputError(f"--separator {separator!r} should be one character, or one of the words {words}")
    text = read_text(path)
    layout = find_layout(text, separator, decimal, path)
    rows = _split_lines(text, layout, str(path))
    data = _data_rows(rows[:SAMPLE_LINES], layout)
    first = data[0] if data else len(rows)
    body = rows[first:]
    if len(body) < MIN_DATA_ROWS:
        raise InputError(f"{path} holds no rows of numbers with {layout}; give --separator and --decimal")
    width = len(body[0][1])
    check_column_count(width, path)
    names, units = _parse_header([cells for _, cells in rows[:first] if len(cells) == width], width)
    body, findings = drop_broken_last_row(body, width, text, str(path))
    values = np.array([_parse_cells(cells, layout) for _, cells in body]).reshape(len(body), width)
    values[np.isinf(values)] = np.nan  # an infinite number is no measurement
    table = Table(path.name, names, values, np.array([line for line, _ in body], dtype=np.intp), findings)
    return TextTable(table, layout, units)


def find_layout(text: str, separator: str | None, decimal: str | None, path: Path) -> Layout:
    """The layout in which most lines are numbers, in equal rows; InputError where none fits."""
    sample = "\n".join(text.splitlines()[:SAMPLE_LINES])
    tried = product([separator] if separator else SEPARATORS, [decimal] if decimal else DECIMALS)
    layouts = [Layout(*pair) for pair in tried if pair[0] != pair[1] or separator]
    best = max(layouts, key=lambda layout: _score_layout(sample, layout))
    if _score_layout(sample, best) < MIN_DATA_ROWS:
        raise InputError(
            f"{path} holds no rows of numbers that could be recognised; give --separator and --decimal, or leave out "
            "columns of text"
        )
    return best


def _score_layout(sample: str, layout: Layout) -> float:
    """Rows of numbers of the most frequent width; more columns decide between equals."""
    rows = _split_lines(sample, layout, "")
    widths = [len(rows[index][1]) for index in _data_rows(rows, layout)]
    if not widths:
        return 0.0
    common = max(set(widths), key=widths.count)
    return widths.count(common) + common / (common + 1) if common > 1 else 0.0


def _split_lines(text: str, layout: Layout, where: str) -> NumberedRows:
    lines = text.splitlines()
    comments = {number for number, line in enumerate(lines, 1) if COMMENT_START.match(line)}
    bare = "\n".join(COMMENT_START.sub("", line) for line in lines)
    if layout.separator == " ":
        bare = "\n".join(re.sub(r"[ \t]+", " ", line.strip()) for line in bare.split("\n"))
    rows = split_rows(bare, layout.separator, where)
    widths = {len(cells) for _, cells in rows if cells[-1].strip()}
    rows = [(line, _drop_empty_last_cell(cells, widths)) for line, cells in rows]
    in_comments = [(line, cells) for line, cells in rows if line in comments]
    numbers = {in_comments[index][0] for index in _data_rows(in_comments, layout)}
    return [each for each in rows if each[0] not in numbers]  # numbers in a comment are not measurements


def _drop_empty_last_cell(cells: list[str], widths: Set[int]) -> list[str]:
    """A separator at the end of a line starts another cell only where another line has something in that cell.

    widths: of the lines whose last cell holds something.
    """
    return cells[:-1] if len(cells) > 1 and not cells[-1].strip() and len(cells) not in widths else cells


def _data_rows(rows: NumberedRows, layout: Layout) -> list[int]:
    """Which rows (from 0) hold numbers: one in each column, but for columns that have none in any row."""
    parsed = {index: _numbers_or_holes(cells, layout) for index, (_, cells) in enumerate(rows)}
    held = dict[int, NDArray[np.bool_]]()  # by the width of the rows: columns with a number
    for values in parsed.values():
        if values is not None:
            held[len(values)] = held.get(len(values), False) | ~np.isnan(values)
    return [
        index
        for index, values in parsed.items()
        if values is not None and not np.any(np.isnan(values) & held[len(values)])
    ]


def _numbers_or_holes(cells: list[str], layout: Layout) -> Array | None:
    """Numbers of a row, NaN for those that are missing; None for a row without numbers or with other text."""
    values = _parse_cells(cells, layout)
    holes = np.isnan(values)
    if holes.all() or any(cells[index].strip().lower() not in NO_NUMBER for index in np.flatnonzero(holes)):
        return None
    return values


def _parse_cells(cells: list[str], layout: Layout) -> Array:
    point = cells if layout.decimal == "." else [_to_decimal_point(cell) for cell in cells]
    return np.array(parse_numbers(point))


def _to_decimal_point(cell: str) -> str:
    """A number with a decimal comma; a cell with a point is refused: the point may separate thousands."""
    return cell.replace(",", ".") if "." not in cell else "not a number"


def _parse_header(lines: list[list[str]], width: int) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names and units from the rows above the numbers: `q1 [deg]`, or a row of units below the names."""
    if not lines:
        return tuple(f"c{column + 1}" for column in range(width)), {}
    cells = [_split_unit(cell) for cell in lines[0]]
    names = tuple(name for name, _ in cells)
    units = tuple(unit for _, unit in cells)
    below = [_strip_brackets(cell) for cell in lines[1]] if len(lines) > 1 else [""] * width
    unique = tuple(_make_unique(names))
    return unique, {
        name: unit or lower for name, unit, lower in zip(unique, units, below, strict=True) if unit or lower
    }


def _split_unit(cell: str) -> tuple[str, str]:
    match = re.fullmatch(r"\s*(.*?)\s*[\[({]([^\[\](){}]*)[\])}]\s*", cell)
    is_unit = match is not None and match[1] and not match[2].strip().isdigit()  # q[0]: a joint
    return (match[1], _strip_brackets(match[2])) if match is not None and is_unit else (cell.strip(), "")


def _strip_brackets(cell: str) -> str:
    return cell.strip(" \t[](){}")


def _make_unique(names: tuple[str, ...]) -> Iterator[str]:
    """Names that differ: an empty one or a repeated one gets its column number."""
    for column, name in enumerate(names):
        repeated = name in names[:column]
        yield f"{name}_c{column + 1}" if repeated and name else name or f"c{column + 1}"
