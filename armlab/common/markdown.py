"""Tables as Markdown and LaTeX, and Markdown pages."""

from collections.abc import Collection, Iterable, Sequence


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[object]], numbers: Collection[int] = ()) -> str:
    """A Markdown table; a vertical bar in a cell is escaped. numbers: columns that stand on the right."""
    marks = ["---:" if place in numbers else "---" for place in range(len(headings))]
    return "\n".join(_table_line(line) for line in (headings, marks, *rows))


def markdown_page(title: str, *parts: str) -> str:
    """A page of paragraphs, tables and sections."""
    return "\n\n".join([f"# {title}", *parts]) + "\n"


_LATEX_ESCAPES = str.maketrans(
    {
        **{sign: f"\\{sign}" for sign in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
    }
)


def latex_table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """The same table as a `tabular` of LaTeX (package booktabs): the first column left, the others right."""
    head, *body = (_latex_line(line) for line in (headings, *rows))
    begin = rf"\begin{{tabular}}{{l{'r' * (len(headings) - 1)}}}"
    lines = [begin, r"\toprule", head, r"\midrule", *body, r"\bottomrule", r"\end{tabular}"]
    return "\n".join(lines) + "\n"


def _latex_line(cells: Sequence[object]) -> str:
    return " & ".join(str(cell).translate(_LATEX_ESCAPES) for cell in cells) + r" \\"


def _table_line(cells: Sequence[object]) -> str:
    escaped = [str(cell).replace("|", r"\|") for cell in cells]
    return f"| {' | '.join(escaped)} |"
