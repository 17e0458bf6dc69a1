"""How a result shows itself in a notebook: a sentence and a small table as HTML, all text escaped."""

from collections.abc import Sequence
from html import escape

SHOWN_ROWS = 12


def notebook_html(title: str, text: str, headings: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A title, a sentence and the first rows of a table; the others are counted."""
    parts = [f"<p><strong>{escape(title)}</strong></p>", f"<p>{escape(text)}</p>" if text else ""]
    if rows:
        body = "".join(_table_row("td", row) for row in rows[:SHOWN_ROWS])
        parts.append(f"<table><thead>{_table_row('th', headings)}</thead><tbody>{body}</tbody></table>")
    if len(rows) > SHOWN_ROWS:
        parts.append(f"<p>and {len(rows) - SHOWN_ROWS} more</p>")
    return f"<div>{''.join(parts)}</div>"


def _table_row(tag: str, cells: Sequence[object]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"
