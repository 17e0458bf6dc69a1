"""The page itself: sections, style, scripts and data in one file that asks nothing of the network."""

from collections.abc import Sequence
from html import escape
from importlib.resources import files

from bench.properties.facts import Facts
from bench.report import sections
from bench.report.analysis import Cell, block_losses
from bench.report.data import page_data
from bench.report.looks import look
from bench.sharing.result_set import ResultSet
from bench.statistics.critical import critical_difference

_SCRIPTS = ("scales.js", "lines.js", "boxes.js", "page.js")


def report_page(results: ResultSet, cells: Sequence[Cell], facts: Sequence[Facts]) -> str:
    """HTML text; facts: of the algorithms that took part, as far as they are known here."""
    looks = {name: look(index) for index, name in enumerate(results.algorithms)}
    found = critical_difference(block_losses(list(cells)))
    parts = [
        sections.head(results, cells, found),
        sections.buttons(looks),
        sections.ranking(found, cells, results.algorithms, looks),
        sections.overall(),
        sections.problem(cells),
        sections.power(cells),
        sections.properties(facts),
        sections.origin(results),
    ]
    style = _asset("page.css")
    scripts = "\n".join(_asset(name) for name in _SCRIPTS)
    data = page_data(cells, results.algorithms).replace("<", "\\u003c")  # a label must not end the script
    title = escape(results.name)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{title}</title>\n<link rel="icon" href="data:,">\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n'
        + "\n".join(parts)
        + f'\n</main>\n<script type="application/json" id="data">{data}</script>\n<script>\n{scripts}</script>\n'
        "</body>\n</html>\n"
    )


def _asset(name: str) -> str:
    return (files("bench.report") / "assets" / name).read_text(encoding="utf-8")
