"""Tables as Markdown and LaTeX, and Markdown pages."""

from collections.abc import Collection, Iterable, Sequence


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[object]], numbers: Collection[int] = ()) -> str:
    """A Markdown table; a vertical bar in a cell is escaped. numbers: columns that stand on the right."""
    marks = ["---:" if place in numbers else "---" for place in range(len(headings))]
    return "\n".join(_table_line(line) for line in (headings, marks, *rows))


def markdown_page(title: str, *parts: str) -> str:
    """A page of paragraphs, tables and sections."""
    return "\n\n".join([f"# {title}", *parts]) + "\n"


_MAX_UNBROKEN = 40  # characters of a cell of words that LaTeX need not break
_LATEX_ESCAPES = str.maketrans(
    {
        **{sign: f"\\{sign}" for sign in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "\N{NO-BREAK SPACE}": "~",
        "\N{MINUS SIGN}": "$-$",
        "\N{EN DASH}": "--",
        "\N{SUPERSCRIPT TWO}": "$^2$",
        "\N{RIGHTWARDS ARROW}": r"$\to$",
        "\N{INFINITY}": r"$\infty$",
        "\N{HORIZONTAL ELLIPSIS}": r"\ldots{}",
    }
)


def latex_table(headings: Sequence[str], rows: Iterable[Sequence[object]], texts: Collection[int] = ()) -> str:
    """The same table as a `tabular` of LaTeX (package booktabs): the first column left, the others right.

    texts: further columns that stand on the left; one with long cells becomes a paragraph of a third of the line.
    """
    lines = [headings, *rows]
    long = {place for place in texts if max(len(str(line[place])) for line in lines) > _MAX_UNBROKEN}
    paragraph = r"p{0.33\linewidth}"
    marks = [
        paragraph if place in long else "l" if place == 0 or place in texts else "r" for place in range(len(headings))
    ]
    head, *body = map(_latex_line, lines)
    begin = rf"\begin{{tabular}}{{{''.join(marks)}}}"
    return "\n".join([begin, r"\toprule", head, r"\midrule", *body, r"\bottomrule", r"\end{tabular}"]) + "\n"


def _latex_line(cells: Sequence[object]) -> str:
    return " & ".join(str(cell).translate(_LATEX_ESCAPES) for cell in cells) + r" \\"


def _table_line(cells: Sequence[object]) -> str:
    escaped = [str(cell).replace("|", r"\|") for cell in cells]
    return f"| {' | '.join(escaped)} |"
