"""The critical-difference chart as SVG, upright so that it can be read on a phone, and the style of each algorithm."""

from collections.abc import Iterator, Mapping
from html import escape
from typing import NamedTuple

from bench.statistics.critical_difference import CriticalDifference

# Okabe and Ito 2008 without yellow, then two of Tol's muted colours: told apart with any colour vision; and the dash,
# too, tells them apart on a grey print.
_CHART_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#882255", "#777777")
_CHART_DASHES = ("", "6 3", "2 2", "8 3 2 3", "12 3", "4 2 1 2", "1 3", "10 2 2 2 2 2", "3 6")


class ChartStyle(NamedTuple):
    """Colour, and dashes as SVG writes them."""

    color: str
    dash: str


def chart_style(index: int) -> ChartStyle:
    """The style of the index-th algorithm; where the colours repeat, the dashes differ."""
    turn, place = divmod(index, len(_CHART_COLORS))
    return ChartStyle(_CHART_COLORS[place], _CHART_DASHES[(place + turn) % len(_CHART_DASHES)])


_WIDTH, _ROW, _TOP, _NAME = 420, 26, 34, 130
_BAR_SPACING = 9  # between group bars
_MIN_LABEL_SPACING = 24  # the least from one number of the axis to the next


def draw_critical_difference(found: CriticalDifference, looks: Mapping[str, ChartStyle]) -> str:
    """The chart as SVG: average ranks as dots, and a bar on the right beside each group without a difference."""
    count = len(found.ranks)
    plot = _WIDTH - _NAME - 14 - _BAR_SPACING * (len(found.groups) + 1)
    height = _TOP + _ROW * count + 8
    parts = [*_draw_axis(count, plot, height), *_draw_dots(found, looks, plot), *_draw_bars(found, plot)]
    return (
        f'<svg class="critical" viewBox="0 0 {_WIDTH} {height}" role="img" '
        f'aria-label="{escape(_describe_ranks(found))}">'
        f"<title>Average ranks</title>{''.join(parts)}</svg>"
    )


def _describe_ranks(found: CriticalDifference) -> str:
    ranks = ", ".join(f"{name} {rank:.2f}" for name, rank in found.ranks.items())
    alike = "; ".join(" and ".join(group) for group in found.groups) or "none"
    return f"Average ranks: {ranks}. Not told apart: {alike}."


def _draw_axis(count: int, plot: int, height: int) -> Iterator[str]:
    step = -(-_MIN_LABEL_SPACING * (count - 1) // plot) or 1
    for rank in range(1, count + 1):
        x = _rank_x(rank, count, plot)
        yield f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{_TOP - 8}" y2="{height - 8}"/>'
        if (rank - 1) % step == 0:
            yield f'<text x="{x:.1f}" y="{_TOP - 14}" text-anchor="middle">{rank}</text>'


def _draw_dots(found: CriticalDifference, looks: Mapping[str, ChartStyle], plot: int) -> Iterator[str]:
    for row, (name, rank) in enumerate(found.ranks.items()):
        x, y = _rank_x(rank, len(found.ranks), plot), _row_y(row)
        yield f'<text x="{_NAME - 8}" y="{y + 4}" text-anchor="end">{escape(name)}</text>'
        yield f'<line class="stem" x1="{_NAME}" x2="{x:.1f}" y1="{y}" y2="{y}"/>'
        yield f'<circle cx="{x:.1f}" cy="{y}" r="5" fill="{looks[name].color}"/>'
        yield f'<text class="rank" x="{x + 8:.1f}" y="{y + 4}">{rank:.2f}</text>'


def _draw_bars(found: CriticalDifference, plot: int) -> Iterator[str]:
    rows = {name: row for row, name in enumerate(found.ranks)}
    for place, group in enumerate(found.groups):
        x = _NAME + plot + 22 + place * _BAR_SPACING
        top, bottom = _row_y(rows[group[0]]) - 7, _row_y(rows[group[-1]]) + 7
        yield f'<line class="group" x1="{x}" x2="{x}" y1="{top}" y2="{bottom}"/>'


def _rank_x(rank: float, count: int, plot: int) -> float:
    return _NAME + 4 + (plot - 26) * (rank - 1) / max(count - 1, 1)


def _row_y(row: int) -> int:
    return _TOP + _ROW * row + 10
