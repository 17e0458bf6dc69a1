"""How a result shows itself in a notebook: a sentence and a small table as HTML, all text escaped."""

from collections.abc import Sequence

SHOWN_ROWS = 12


def notebook_html(title: str, text: str, headings: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A title, a sentence and the first rows of a table; the others are counted."""
    from armlab.common.report.page import render_part  # templates are loaded when something is shown

    return render_part(
        "armlab.common.report",
        "notebook.html",
        title=title,
        text=text,
        headings=headings,
        rows=rows[:SHOWN_ROWS],
        more=max(len(rows) - SHOWN_ROWS, 0),
    )
