"""The critical-difference picture, turned so that it is readable on a phone: a row an algorithm, a bar a group."""

from collections.abc import Iterator, Mapping
from html import escape

from bench.report.looks import Look
from bench.statistics.critical import CriticalDifference

_WIDTH, _ROW, _TOP, _NAME = 420, 26, 34, 130
_BAR = 9  # between group bars
_LABEL = 24  # the least from one number of the axis to the next


def critical_picture(found: CriticalDifference, looks: Mapping[str, Look]) -> str:
    """SVG text: average ranks as dots, and bars on the right beside those that cannot be told apart."""
    count = len(found.ranks)
    plot = _WIDTH - _NAME - 14 - _BAR * (len(found.groups) + 1)
    height = _TOP + _ROW * count + 8
    parts = [*_axis(count, plot, height), *_dots(found, looks, plot), *_bars(found, plot)]
    return (
        f'<svg class="critical" viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="{escape(_in_words(found))}">'
        f"<title>Average ranks</title>{''.join(parts)}</svg>"
    )


def _in_words(found: CriticalDifference) -> str:
    ranks = ", ".join(f"{name} {rank:.2f}" for name, rank in found.ranks.items())
    alike = "; ".join(" and ".join(group) for group in found.groups) or "none"
    return f"Average ranks: {ranks}. Not told apart: {alike}."


def _axis(count: int, plot: int, height: int) -> Iterator[str]:
    step = -(-_LABEL * (count - 1) // plot) or 1
    for rank in range(1, count + 1):
        x = _x(rank, count, plot)
        yield f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{_TOP - 8}" y2="{height - 8}"/>'
        if (rank - 1) % step == 0:
            yield f'<text x="{x:.1f}" y="{_TOP - 14}" text-anchor="middle">{rank}</text>'


def _dots(found: CriticalDifference, looks: Mapping[str, Look], plot: int) -> Iterator[str]:
    for row, (name, rank) in enumerate(found.ranks.items()):
        x, y = _x(rank, len(found.ranks), plot), _y(row)
        yield f'<text x="{_NAME - 8}" y="{y + 4}" text-anchor="end">{escape(name)}</text>'
        yield f'<line class="stem" x1="{_NAME}" x2="{x:.1f}" y1="{y}" y2="{y}"/>'
        yield f'<circle cx="{x:.1f}" cy="{y}" r="5" fill="{looks[name].color}"/>'
        yield f'<text class="rank" x="{x + 8:.1f}" y="{y + 4}">{rank:.2f}</text>'


def _bars(found: CriticalDifference, plot: int) -> Iterator[str]:
    rows = {name: row for row, name in enumerate(found.ranks)}
    for place, group in enumerate(found.groups):
        x = _NAME + plot + 22 + place * _BAR
        top, bottom = _y(rows[group[0]]) - 7, _y(rows[group[-1]]) + 7
        yield f'<line class="group" x1="{x}" x2="{x}" y1="{top}" y2="{bottom}"/>'


def _x(rank: float, count: int, plot: int) -> float:
    return _NAME + 4 + (plot - 26) * (rank - 1) / max(count - 1, 1)


def _y(row: int) -> int:
    return _TOP + _ROW * row + 10
