"""CSV files of any layout: any separator, decimal comma, rows of units, comments, stamps as text, without a header."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice, product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.errors import InputError
from armlab.recordings.imports.time_columns import StampFormat, find_stamp_format, seconds_of
from armlab.recordings.repair import MAX_LOST_SHARE
from armlab.recordings.table import Table, check_column_count
from armlab.recordings.text_rows import (
    NO_NUMBER,
    NumberedLine,
    Progress,
    RowLayout,
    open_lines,
    parse_numbers,
    read_rows,
    silent,
    split_line,
    tell_lines,
)

SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", " ": "blank"}
DECIMALS = (".", ",")
COMMENT_START = re.compile(r"^\s*[#%!]+\s*")
SAMPLE_LINES = 200
MIN_DATA_ROWS = 2


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
    """A table with the layout of the file, and the units that the file names.

    stamps: how columns of text that are stamps are written, by name; their numbers are seconds from the first one.
    texts: names of columns of other text, which hold no signal.
    """

    table: Table
    layout: Layout
    units: dict[str, str]
    stamps: dict[str, str]
    texts: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Sample:
    """The first lines of a file as cells in a layout. width: of most rows. data: which rows, from 0, hold numbers.

    texts: columns whose cells are text in these rows. has_end: whether rows end with a separator that starts no cell.
    """

    rows: list[tuple[int, list[str]]]
    width: int = 0
    data: tuple[int, ...] = ()
    texts: frozenset[int] = field(default_factory=frozenset)
    has_end: bool = False

    @property
    def score(self) -> float:
        """Rows of numbers; more columns of numbers, and fewer of text, decide between equals."""
        return len(self.data) + (self.width - len(self.texts)) / (self.width + 1) if self.width > 1 else 0.0


def read_odd_csv(
    path: Path, separator: str | None = None, decimal: str | None = None, progress: Progress = silent
) -> TextTable:
    """The columns of a text file with numbers; without a header they are called c1, c2, ...

    A column without any number becomes NaN, but for stamps as text, which become seconds. separator, decimal: found in
    the file if left out. Raises InputError for a file without rows of numbers, and for rows of different length before
    the last.
    """
    if separator is not None and (len(separator) != 1 or separator in '\r\n"'):
        words = ", ".join(SEPARATORS.values())
        raise InputError(f"--separator {separator!r} should be one character, or one of the words {words}")
    with open_lines(path) as lines:
        head = list(islice(lines, SAMPLE_LINES))
        layout, sample = _find_layout(head, separator, decimal, path)
        check_column_count(sample.width, path)
        above = [cells for _, cells in sample.rows[: sample.data[0]] if len(cells) == sample.width]
        names, units = _parse_header(above, sample.width)
        formats = _stamp_formats(sample)
        first = sample.rows[sample.data[0]][0]
        rows = read_rows(
            tell_lines(chain((each for each in head if each[0] >= first), lines), path.name, progress),
            RowLayout(
                layout.separator,
                sample.width,
                layout.decimal,
                sample.has_end,
                COMMENT_START,
                {column: _converter(formats.get(column)) for column in sample.texts},
            ),
            str(path),
        )
    worst = int(np.argmax(rows.words))
    if rows.words[worst] > MAX_LOST_SHARE * len(rows.values):
        line = int(rows.numbers[np.isnan(rows.values[:, worst])][0])
        raise InputError(
            f"{path}: column {names[worst]} holds text in {rows.words[worst]} of {len(rows.values)} rows (line {line} "
            "or later), numbers in others: is its separator or decimal sign another one there?"
        )
    values = rows.values
    values[np.isinf(values)] = np.nan  # an infinite number is no measurement
    for column in formats:
        values[:, column] = seconds_of(rows.texts[column].astype(np.int64))
    stamps = {names[column]: known.words for column, known in formats.items()}
    table = Table(path.name, names, values, rows.numbers, rows.findings)
    texts = tuple(names[column] for column in sorted(sample.texts - set(formats)))
    return TextTable(table, layout, units | dict.fromkeys(stamps, "s"), stamps, texts)


def _converter(known: StampFormat | None) -> Callable[[Sequence[str]], NDArray[np.generic]]:
    return known.parse if known is not None else lambda cells: np.zeros(len(cells), dtype=np.int8)


def _stamp_formats(sample: Sample) -> dict[int, StampFormat]:
    """Formats of the columns of text that are stamps."""
    found = {column: find_stamp_format([sample.rows[row][1][column] for row in sample.data]) for column in sample.texts}
    return {column: known for column, known in found.items() if known is not None}


def _find_layout(
    head: list[NumberedLine], separator: str | None, decimal: str | None, path: Path
) -> tuple[Layout, Sample]:
    """The layout in which most lines are numbers, in equal rows, and the lines in it; InputError where none fits."""
    tried = product([separator] if separator else SEPARATORS, [decimal] if decimal else DECIMALS)
    layouts = [Layout(*pair) for pair in tried if pair[0] != pair[1] or separator]
    samples = {layout: take_sample(head, layout, str(path)) for layout in layouts}
    best = max(layouts, key=lambda layout: samples[layout].score)
    if len(samples[best].data) < MIN_DATA_ROWS or samples[best].score < MIN_DATA_ROWS:
        raise InputError(f"{path} holds no rows of numbers{_reason_no_rows(head, samples[best])}")
    return best, samples[best]


def _reason_no_rows(head: list[NumberedLine], sample: Sample) -> str:
    """What stands there instead."""
    if not any(line.strip() for _, line in head):
        return ": the file is empty"
    for number, cells in reversed(sample.rows):
        text = next((cell for cell in cells if cell.strip() and _is_text(cell, ".")), None)
        if text is not None and len(cells) > 1:
            return (
                f": line {number} has '{text.strip()[:40]}' in column {cells.index(text) + 1}; a row should hold "
                "numbers, and stamps like 2026-01-31T12:00:00.004; are --separator and --decimal others?"
            )
    return " in columns; give --separator and --decimal"


def take_sample(head: list[NumberedLine], layout: Layout, where: str) -> Sample:
    """Cells of the first lines, and which of them are rows of numbers."""
    rows = list[tuple[int, list[str]]]()
    comments = set[int]()
    for number, line in head:
        bare = COMMENT_START.sub("", line)
        cells = split_line(bare, layout.separator, f"{where}, line {number}")
        if any(cell.strip() for cell in cells):
            comments |= {number} if COMMENT_START.match(line) else set()
            rows.append((number, cells))
    has_end = _has_end(rows)
    if has_end:
        rows = [(number, cells[:-1] if not cells[-1].strip() else cells) for number, cells in rows]
    holding = [(number, cells) for number, cells in rows if number not in comments and _holds_number(cells, layout)]
    widths = [len(cells) for _, cells in holding]
    if not widths:
        return Sample(rows)
    width = max(set(widths), key=lambda each: (widths.count(each), each))
    body = [cells for _, cells in holding if len(cells) == width]
    last = body[len(body) // 2 :]  # the first rows may be units or settings
    is_text = [sum(_is_text(cells[column], layout.decimal) for cells in last) for column in range(width)]
    texts = frozenset(column for column, count in enumerate(is_text) if count > len(last) / 2)
    numbers = [column for column in range(width) if column not in texts]
    data = tuple(
        index
        for index, (number, cells) in enumerate(rows)
        if len(cells) == width
        and number not in comments
        and _holds_number([cells[column] for column in numbers], layout)
        and not any(_is_text(cells[column], layout.decimal) for column in numbers)
    )
    return Sample(
        [each for each in rows if each[0] not in comments or each[0] < holding[0][0]], width, data, texts, has_end
    )


def _has_end(rows: list[tuple[int, list[str]]]) -> bool:
    """Whether a separator at the end of lines starts no cell: no line of that width has something in it."""
    widths = [len(cells) for _, cells in rows if len(cells) > 1 and not cells[-1].strip()]
    if not widths:
        return False
    width = max(set(widths), key=widths.count)
    return all(not cells[-1].strip() for _, cells in rows if len(cells) == width)


def _holds_number(cells: Sequence[str], layout: Layout) -> bool:
    return not np.isnan(parse_numbers(cells, layout.decimal)).all()


def _is_text(cell: str, decimal: str) -> bool:
    """Whether a cell holds neither a number nor a word for one that is missing."""
    return cell.strip().lower() not in NO_NUMBER and bool(np.isnan(parse_numbers([cell], decimal)[0]))


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
