"""Tables for papers: LaTeX, PDF with as many pages as the rows need, and SVG; words stay text.

The pictures are ruled as in LaTeX's booktabs. Columns are as wide as their cells; where that is wider than the sheet,
words go on a new line, the widest columns first. A page is as large as what it holds.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from io import BytesIO
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from armlab.common.markdown import latex_table
from armlab.common.report.page import Table

if TYPE_CHECKING:  # matplotlib is loaded by those who draw
    from matplotlib.figure import Figure

_POINTS_PER_INCH = 72
_FONT_POINTS, _LINE_POINTS, _ROW_GAP_POINTS, _COLUMN_GAP_POINTS, _MARGIN_POINTS = 9.0, 11.5, 3.5, 14.0, 12.0
_SHEET_POINTS = (841.9, 595.3)  # A4 on its side: the most that a page takes, but for a single row that is larger
_MAX_WORD = 60  # characters that stay together; a longer word is broken
_RULES_POINTS = {"outer": 0.9, "inner": 0.5}
_Cell = tuple[str, ...]  # lines


class _Layout(NamedTuple):
    """Cells in lines, the heading first, and where the columns begin, points; the last edge is the end of the rules."""

    rows: list[tuple[_Cell, ...]]
    edges: list[float]
    texts: frozenset[int]


def table_pdf(table: Table) -> bytes:
    """The table as PDF, its heading on every page; the font is of Type 42, which publishers take."""
    import matplotlib
    from matplotlib.backends.backend_pdf import PdfPages

    layout, buffer = _lay_out(table), BytesIO()
    unsigned = dict.fromkeys(("CreationDate", "Creator", "Producer"))
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # a user's own style would change the bytes
        matplotlib.rc("pdf", fonttype=42)
        with PdfPages(buffer, metadata=unsigned) as pages:
            for rows in _pages(layout.rows):
                pages.savefig(_draw(layout._replace(rows=rows)))
    return buffer.getvalue()


def table_svg(table: Table) -> bytes:
    """The table as one SVG picture of all rows."""
    import matplotlib

    buffer = BytesIO()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rc("svg", fonttype="none", hashsalt="armlab")  # else every SVG has random ids
        _draw(_lay_out(table)).savefig(buffer, format="svg", metadata=dict.fromkeys(("Date", "Creator")))
    return buffer.getvalue()


def _lay_out(table: Table) -> _Layout:
    cells = [[re.sub(r"[^\S\N{NO-BREAK SPACE}]+", " ", str(cell)).strip() for cell in row] for row in table.rows]
    cells.insert(0, [str(heading) for heading in table.headings])
    columns = list(zip(*cells, strict=True))
    natural = [max(map(_width, column)) for column in columns]
    narrowest = [max(_width(word) for cell in column for word in _words(cell)) for column in columns]
    gaps = _COLUMN_GAP_POINTS * (len(columns) - 1)
    room = _SHEET_POINTS[0] - 2 * _MARGIN_POINTS - gaps
    widths = natural
    for cap in range(int(max(natural)), 0, -1):
        if sum(widths) <= room:
            break
        widths = [max(least, min(most, cap)) for least, most in zip(narrowest, natural, strict=True)]
    edges = [_MARGIN_POINTS]
    for width in widths:
        edges.append(edges[-1] + width + _COLUMN_GAP_POINTS)
    rows = [tuple(_wrapped(cell, width) for cell, width in zip(row, widths, strict=True)) for row in cells]
    return _Layout(rows, edges, frozenset({0, *table.texts}))


def _words(cell: str) -> list[str]:
    return re.findall(rf"[^ ]{{1,{_MAX_WORD}}}", cell) or [""]


def _wrapped(cell: str, width: float) -> _Cell:
    """The cell in lines, each no wider than the column, points."""
    if _width(cell) <= width:
        return (cell,)
    lines = [""]
    for word in _words(cell):
        longer = f"{lines[-1]} {word}".lstrip()
        if _width(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return tuple(line for line in lines if line)


@cache
def _width(text: str) -> float:
    """Points that a text takes in the font of the tables."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family="DejaVu Sans", size=_FONT_POINTS)
    width, _, _ = text_to_path.get_text_width_height_descent(text, font, ismath=False)
    return float(width)


def _height(row: tuple[_Cell, ...]) -> float:
    return _LINE_POINTS * max(map(len, row)) + _ROW_GAP_POINTS


def _pages(rows: list[tuple[_Cell, ...]]) -> list[list[tuple[_Cell, ...]]]:
    """The rows page by page, each with the heading."""
    head, *body = rows
    pages, free = [[head]], _SHEET_POINTS[1] - 2 * _MARGIN_POINTS - _height(head)
    left = free
    for row in body:
        if _height(row) > left and len(pages[-1]) > 1:
            pages.append([head])
            left = free
        pages[-1].append(row)
        left -= _height(row)
    return pages


def _draw(layout: _Layout) -> "Figure":
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    end = layout.edges[-1] - _COLUMN_GAP_POINTS
    width, height = end + _MARGIN_POINTS, sum(map(_height, layout.rows)) + 2 * _MARGIN_POINTS
    figure = Figure(figsize=(width / _POINTS_PER_INCH, height / _POINTS_PER_INCH))

    def rule(top: float, thickness: float) -> None:
        level = 1 - top / height
        ends = (_MARGIN_POINTS / width, end / width)
        figure.add_artist(Line2D(ends, (level, level), color="black", linewidth=thickness))

    top = _MARGIN_POINTS
    rule(top, _RULES_POINTS["outer"])
    for number, row in enumerate(layout.rows):
        for column, (cell, (left, after)) in enumerate(zip(row, pairwise(layout.edges), strict=True)):
            is_text = column in layout.texts
            place = left if is_text else after - _COLUMN_GAP_POINTS
            for line, text in enumerate(cell):
                figure.text(
                    place / width,
                    1 - (top + _LINE_POINTS * (line + 1) - 0.5 * (_LINE_POINTS - _FONT_POINTS)) / height,
                    text,
                    ha="left" if is_text else "right",
                    va="baseline",
                    fontsize=_FONT_POINTS,
                    family="DejaVu Sans",
                    parse_math=False,
                )
        top += _height(row)
        if number == 0:
            rule(top, _RULES_POINTS["inner"])
    rule(top, _RULES_POINTS["outer"])
    return figure


TABLE_FORMS: Mapping[str, tuple[str, Callable[[Table], str | bytes]]] = MappingProxyType(
    {
        "latex": ("tex", lambda table: latex_table(table.headings, table.rows, table.texts)),
        "pdf": ("pdf", table_pdf),
        "svg": ("svg", table_svg),
    }
)
"""The ending of the file and the writer, by the name of the form."""


def table_files(name: str, table: Table, forms: Sequence[str]) -> dict[str, str | bytes]:
    """The files of a table by their names, one for each form."""
    return {f"{name}.{suffix}": write(table) for suffix, write in map(TABLE_FORMS.__getitem__, forms)}
