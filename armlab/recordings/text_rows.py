"""Text files line by line, and their rows of numbers, in pieces: memory holds numbers and one piece of the text."""

import codecs
import csv
import re
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.recordings.recording import Finding

MAX_TEXT_BYTES = 10 * 10**9  # a text of this size is read for minutes
NO_NUMBER = ("", "nan", "null", "none", "na", "n/a")  # cells that stand for a number that is missing, in lower case
PIECE_BYTES, PIECE_LINES = 1 << 20, 4_000
PROGRESS_LINES = 100_000  # from one line of progress to the next
Progress = Callable[[str], None]
NumberedLine = tuple[int, str]  # number in the file, from 1, and text with its line end


def silent(message: str) -> None:
    """For readers whom nobody watches."""


def tell_lines(lines: Iterable[NumberedLine], name: str, progress: Progress) -> Iterator[NumberedLine]:
    """The lines; progress is told how many were read."""
    for number, line in lines:
        if number % PROGRESS_LINES == 0:
            progress(f"{name}: {number:,} rows read")
        yield number, line


@contextmanager
def open_lines(path: Path) -> Iterator[Iterator[NumberedLine]]:
    """The lines of a text file; InputError if it is missing, no text, or too large."""
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"cannot read {path}: it is no regular file")
        if path.stat().st_size > MAX_TEXT_BYTES:
            raise InputError(f"{path} is larger than {MAX_TEXT_BYTES // 10**9} GB: give Parquet or shorter runs")
        with path.open(encoding=_find_encoding(path), errors="strict") as stream:
            yield enumerate(stream, 1)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not text (byte {error.start}): is it a CSV file?") from None


def _find_encoding(path: Path) -> str:
    """UTF-8, UTF-16 by its mark or its zeros, else Windows-1252; InputError for what is no text."""
    with path.open("rb") as stream:
        head = stream.read(PIECE_BYTES)
        if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return "utf-16"
        if b"\0" in head[:2] and len(head) > 3:
            return "utf-16-le" if head[1] == 0 else "utf-16-be"
        decoder = codecs.getincrementaldecoder("utf-8-sig")()
        piece, done = head, 0
        try:
            while piece:
                decoder.decode(piece)
                done += len(piece)
                piece = stream.read(PIECE_BYTES)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError as error:
            if re.search(rb"[\x00-\x08\x0e-\x1a\x7f\x81\x8d\x8f\x90\x9d]", head):
                message = f"{path} is not UTF-8 text (byte {done + error.start}): is it a CSV file?"
                raise InputError(message) from None
            return "cp1252"
    return "utf-8-sig"


@dataclass(frozen=True, eq=False)
class RowLayout:
    """How the rows of numbers are written.

    width: cells a row. has_end: whether each row ends with a separator that starts no cell. comment: what starts a line
    without measurements. texts: columns that hold no numbers as such, with what makes numbers of their cells.
    """

    separator: str
    width: int
    decimal: str = "."
    has_end: bool = False
    comment: re.Pattern[str] | None = None
    texts: Mapping[int, Callable[[Sequence[str]], NDArray[np.generic]]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Rows:
    """values: (rows, columns), NaN where a cell holds no number. texts: of the columns of text. numbers: of the lines.

    words: (columns,), how many cells hold text where others hold numbers. findings: about a last row that was cut.
    """

    values: Array
    texts: Mapping[int, NDArray[np.generic]]
    numbers: NDArray[np.intp]
    words: NDArray[np.intp]
    findings: tuple[Finding, ...] = ()


def read_rows(lines: Iterable[NumberedLine], layout: RowLayout, where: str) -> Rows:
    """The rows of numbers; a last row that is cut short is left out, and a finding says so.

    Raises InputError for a row of the wrong length before the last.
    """
    kept, findings = iter(lines), tuple[Finding, ...]()
    values, numbers, words = np.empty((0, layout.width)), array("q"), np.zeros(layout.width, dtype=np.intp)
    texts: dict[int, list[NDArray[np.generic]]] = {column: [] for column in layout.texts}
    piece, count = list(islice(kept, PIECE_LINES)), 0
    while piece:
        following = list(islice(kept, PIECE_LINES))
        rows = [(number, line) for number, line in piece if not _is_void(line, layout)]
        if not following:
            rows, findings = _drop_broken_last(rows, layout, where)
        piece = following
        if not rows:
            continue
        part = _parse_piece(rows, layout, where)
        if count + len(part.values) > len(values):  # in place, where numbers that were copied would stand twice
            values.resize((count + len(part.values) + len(values) // 8, layout.width), refcheck=False)
        values[count : count + len(part.values)] = part.values
        count += len(part.values)
        numbers.frombytes(part.numbers.astype(np.int64).tobytes())
        words += part.words
        for column, cells in texts.items():
            cells.append(part.texts[column])
    values.resize((count, layout.width), refcheck=False)
    joined = {column: np.concatenate(cells) for column, cells in texts.items() if cells}
    return Rows(values, joined, np.frombuffer(numbers, dtype=np.int64).astype(np.intp, copy=False), words, findings)


def _is_void(line: str, layout: RowLayout) -> bool:
    is_comment = layout.comment is not None and layout.comment.match(line) is not None
    return is_comment or not line.strip(f'{layout.separator}" \t\r\n\x0b\x0c\x1c\x1d\x1e\x1f\xa0')


def _drop_broken_last(
    rows: list[NumberedLine], layout: RowLayout, where: str
) -> tuple[list[NumberedLine], tuple[Finding, ...]]:
    """The rows without a last one that was cut off while it was written."""
    if not rows:
        return rows, ()
    number, line = rows[-1]
    cells = len(split_line(line, layout.separator, f"{where}, line {number}")) - layout.has_end
    if cells > layout.width:
        raise InputError(f"{where}, line {number}: {cells} cells where the header has {layout.width}")
    if cells == layout.width and line.endswith("\n"):
        return rows, ()
    lack = f"has {cells} cells of {layout.width}"
    lack = lack if cells < layout.width else "has no line end: a number may be cut"
    return rows[:-1], (Finding("broken_last_row", "repaired", f"the last row (line {number}) {lack}; left out"),)


def split_line(line: str, separator: str, where: str) -> list[str]:
    """The cells of a line; several blanks are one separator."""
    text = line.rstrip("\n")
    try:
        return next(csv.reader([" ".join(text.split())] if separator == " " else [text], delimiter=separator), [])
    except csv.Error as error:
        raise InputError(f"{where}: not valid CSV: {error}") from None


def _parse_piece(rows: list[NumberedLine], layout: RowLayout, where: str) -> Rows:
    lines = [" ".join(line.split()) if layout.separator == " " else line.rstrip("\n") for _, line in rows]
    numbers = np.array([number for number, _ in rows], dtype=np.intp)
    wanted = layout.width - 1 + layout.has_end
    if all(line.count(layout.separator) == wanted and '"' not in line for line in lines):
        parsed = _parse_at_once(lines, layout)
        if parsed is not None:
            return Rows(*parsed, numbers, np.zeros(layout.width, dtype=np.intp))
    return _parse_slowly(lines, numbers, layout, where)


def _parse_at_once(lines: list[str], layout: RowLayout) -> tuple[Array, dict[int, NDArray[np.generic]]] | None:
    """The numbers of lines of equal length; None where a cell is no number."""
    whole = layout.separator.join(lines)
    if "_" in whole or (layout.decimal == "," and "." in whole):
        return None
    cells = (whole if layout.decimal == "." else whole.replace(",", ".")).split(layout.separator)
    width = layout.width + layout.has_end
    values = np.full((len(lines), layout.width), np.nan)
    try:
        for column in range(layout.width):
            if column not in layout.texts:
                values[:, column] = np.fromiter(map(float, cells[column::width]), np.float64, len(lines))
    except (ValueError, OverflowError):
        return None
    return values, {column: make(cells[column::width]) for column, make in layout.texts.items()}


def _parse_slowly(lines: list[str], numbers: NDArray[np.intp], layout: RowLayout, where: str) -> Rows:
    """Cell by cell: what is no number becomes NaN, and a row of the wrong length is named."""
    reader = csv.reader(lines, delimiter=layout.separator)
    cells, kept = list[list[str]](), list[int]()
    try:
        for row in reader:
            number = int(numbers[len(kept)])
            if reader.line_num > len(kept) + 1:
                raise InputError(f"{where}, line {number}: a quote opens there and does not close in its line")
            row = (
                row[: layout.width] if layout.has_end and len(row) == layout.width + 1 and not row[-1].strip() else row
            )
            if len(row) != layout.width:
                raise InputError(f"{where}, line {number}: {len(row)} cells where the header has {layout.width}")
            cells.append(row)
            kept.append(number)
    except csv.Error as error:
        odd = next((place for place, line in enumerate(lines) if line.count('"') % 2), None)
        if odd is not None:
            said = f"{where}, line {numbers[odd]}: a quote opens there and does not close in its line"
            raise InputError(said) from None
        raise InputError(f"{where}, line {numbers[len(kept)]}: not valid CSV: {error}") from None
    texts = {column: make([row[column] for row in cells]) for column, make in layout.texts.items()}
    values = np.array([parse_numbers(row, layout.decimal) for row in cells]).reshape(len(cells), layout.width)
    values[:, list(layout.texts)] = np.nan
    words = np.zeros(layout.width, dtype=np.intp)
    for row, column in np.argwhere(np.isnan(values)):
        words[column] += column not in layout.texts and cells[row][column].strip().lower() not in NO_NUMBER
    return Rows(values, texts, np.array(kept, dtype=np.intp), words)


def parse_numbers(cells: Sequence[str], decimal: str = ".") -> list[float]:
    """The cells as numbers, NaN for a cell that is not a number.

    With a decimal comma a cell with a point is none: the point may separate thousands.
    """
    point = cells
    if decimal == ",":
        point = [cell.replace(",", ".") if "." not in cell else "not a number" for cell in cells]
    try:
        return [float(cell) for cell in point] if "_" not in "".join(point) else [_parse_number(each) for each in point]
    except ValueError:
        return [_parse_number(cell) for cell in point]


def _parse_number(cell: str) -> float:
    try:
        return float(cell) if "_" not in cell else float("nan")
    except ValueError:
        return float("nan")
