"""Markdown tables and pages."""

from collections.abc import Iterable, Sequence


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; a vertical bar in a cell is escaped."""
    return "\n".join(_table_line(line) for line in (headings, ["---"] * len(headings), *rows))


def markdown_page(title: str, *parts: str) -> str:
    """A page of paragraphs, tables and sections."""
    return "\n\n".join([f"# {title}", *parts]) + "\n"


def _table_line(cells: Sequence[object]) -> str:
    escaped = [str(cell).replace("|", r"\|") for cell in cells]
    return f"| {' | '.join(escaped)} |"
