"""Pieces of the page: sections, tables, figures; every word that comes from a file is escaped here."""

from collections.abc import Iterable, Sequence
from html import escape

from diagnosis.report.style import STYLE

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def document(title: str, parts: Iterable[str]) -> str:
    """The whole page, which asks nothing of the network."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{escape(title)}</title>\n<link rel="icon" href="data:,">\n<style>{STYLE}</style>\n</head>\n<body>\n'
        "<main>\n" + "\n".join(part for part in parts if part) + "\n</main>\n</body>\n</html>\n"
    )


def section(name: str, title: str, *parts: str) -> str:
    """A section with its heading; parts are HTML."""
    return f'<section id="{escape(name)}"><h2>{escape(title)}</h2>{"".join(parts)}</section>'


def paragraph(text: str, kind: str = "") -> str:
    """Escaped text."""
    chosen = f' class="{escape(kind)}"' if kind else ""
    return f"<p{chosen}>{escape(text)}</p>" if text else ""


def bullets(texts: Sequence[str]) -> str:
    """A list of escaped texts; what stands between backticks is code."""
    return f"<ul>{''.join(f'<li>{_coded(text)}</li>' for text in texts)}</ul>" if texts else ""


def _coded(text: str) -> str:
    parts = escape(text).split("`")
    if len(parts) % 2 == 0:  # one without its partner
        return escape(text)
    return "".join(f"<code>{part}</code>" if index % 2 else part for index, part in enumerate(parts))


def figures(pictures: Sequence[str]) -> str:
    """Pictures side by side as far as there is room."""
    return f'<div class="charts">{"".join(f"<figure>{each}</figure>" for each in pictures)}</div>'


def table(headings: Sequence[str], rows: Sequence[Sequence[str]], texts: Sequence[int] = ()) -> str:
    """Escaped cells; texts: columns that hold words, not numbers."""
    classes = [' class="text"' if index in texts else "" for index in range(len(headings))]
    head = "".join(f"<th{kind}>{escape(each)}</th>" for kind, each in zip(classes, headings, strict=True))
    body = "".join(
        "<tr>" + "".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(classes, row, strict=True)) + "</tr>"
        for row in rows
    )
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def folded(summary: str, *parts: str) -> str:
    """What is shown on a click."""
    return f"<details><summary>{escape(summary)}</summary>{''.join(parts)}</details>"
