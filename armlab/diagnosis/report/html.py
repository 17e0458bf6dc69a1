"""Parts of an HTML page: style, document, sections, tables and figures. Text from files is escaped here."""

from collections.abc import Iterable, Sequence
from html import escape

PAGE_STYLE = """
:root { --ink: #1b1f24; --pale: #5b6570; --line: #d5dae0; --back: #fff; --guilty: #c44e00; --good: #007a58; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--back); color: var(--ink); font: 16px/1.5 system-ui, "Segoe UI", sans-serif; }
main { max-width: 74rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.5rem; margin: 0.5rem 0; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 2.2rem 0 0.5rem; border-bottom: 1px solid var(--line); padding-bottom: 0.2rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 0.3rem; overflow-wrap: anywhere; }
p, li { max-width: 48rem; margin: 0.4rem 0; overflow-wrap: anywhere; }
ul { padding-left: 1.2rem; margin: 0.4rem 0; }
.verdict { font-size: 1.15rem; font-weight: 600; border-left: 5px solid var(--guilty); padding-left: 0.8rem; }
.verdict.none { border-color: var(--good); } .verdict.inconclusive { border-color: #7a7a7a; }
.verdict span { display: block; font-weight: 400; font-size: 1rem; }
.pale { color: var(--pale); font-size: 0.9rem; }
nav { font-size: 0.9rem; display: flex; flex-wrap: wrap; gap: 0.2rem 1rem; margin: 0.8rem 0; }
a { color: #0b5cad; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 21rem), 1fr)); gap: 1rem; }
.finding { border: 1px solid var(--line); border-radius: 0.4rem; padding: 0.2rem 1rem 0.8rem; margin: 1rem 0; }
.finding h3 { color: var(--guilty); font-size: 1.05rem; }
.pair { display: grid; grid-template-columns: minmax(0, 24rem) minmax(0, 1fr); gap: 0.5rem 1.5rem; align-items: start; }
figure { margin: 0; min-width: 0; }
svg { display: block; width: 100%; max-width: 27rem; height: auto; }
.wide { overflow-x: auto; margin: 0.6rem 0; }
.map { overflow-x: auto; margin: 1rem 0; } .map svg { width: auto; max-width: none; min-width: 34rem; height: 36rem; }
table { border-collapse: collapse; font-size: 0.88rem; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--line); padding: 0.25rem 0.7rem; text-align: right; vertical-align: top;
  white-space: nowrap; }
thead th { color: var(--pale); font-weight: 600; }
th:first-child, td:first-child, .text { text-align: left; }
td.text { white-space: normal; min-width: 7rem; }
code, pre { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 0.88em; }
code { background: #f3f5f7; padding: 0.05rem 0.3rem; overflow-wrap: anywhere; }
pre { background: #f3f5f7; border: 1px solid var(--line); padding: 0.6rem; overflow-x: auto; white-space: pre-wrap;
  overflow-wrap: anywhere; }
details { margin: 0.6rem 0; } summary { cursor: pointer; }
@media (max-width: 46rem) {
  .pair { grid-template-columns: minmax(0, 1fr); } .finding { padding: 0.2rem 0.6rem 0.6rem; }
  table { font-size: 0.75rem; } th, td { padding: 0.2rem 0.3rem; }
}
@media print {
  body { font-size: 10pt; } main { max-width: none; padding: 0; } nav { display: none; }
  .charts { grid-template-columns: repeat(2, 1fr); } .wide { overflow: visible; }
  figure, tr, .finding table { break-inside: avoid; } h2, h3 { break-after: avoid; }
}
"""


CONTENT_SECURITY_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def html_document(title: str, parts: Iterable[str]) -> str:
    """The whole page, which asks nothing of the network."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{CONTENT_SECURITY_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{escape(title)}</title>\n<link rel="icon" '
        f'href="data:,">\n<style>{PAGE_STYLE}</style>\n</head>\n<body>\n'
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
    return f"<ul>{''.join(f'<li>{_mark_code(text)}</li>' for text in texts)}</ul>" if texts else ""


def _mark_code(text: str) -> str:
    parts = escape(text).split("`")
    if len(parts) % 2 == 0:  # one without its partner
        return escape(text)
    return "".join(f"<code>{part}</code>" if index % 2 else part for index, part in enumerate(parts))


def figures(pictures: Sequence[str]) -> str:
    """Pictures side by side as far as there is room."""
    return f'<div class="charts">{"".join(f"<figure>{each}</figure>" for each in pictures)}</div>'


def html_table(headings: Sequence[str], rows: Sequence[Sequence[str]], texts: Sequence[int] = ()) -> str:
    """Escaped cells; texts: columns that hold words, not numbers."""
    classes = [' class="text"' if index in texts else "" for index in range(len(headings))]
    head = "".join(f"<th{kind}>{escape(each)}</th>" for kind, each in zip(classes, headings, strict=True))
    body = "".join(
        "<tr>" + "".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(classes, row, strict=True)) + "</tr>"
        for row in rows
    )
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def folded_details(summary: str, *parts: str) -> str:
    """What is shown on a click."""
    return f"<details><summary>{escape(summary)}</summary>{''.join(parts)}</details>"
