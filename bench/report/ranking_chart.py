"""The critical-difference chart as SVG, upright so that it can be read on a phone."""

from collections.abc import Iterator, Mapping

from markupsafe import Markup

from armlab.common.report import palette
from armlab.common.report.charts import svg_element, svg_picture, svg_text
from armlab.common.report.palette import SeriesStyle
from bench.statistics.critical_difference import CriticalDifference

_WIDTH, _ROW, _TOP, _NAME = 420, 26, 34, 130
_SIZE = 12  # px: of the letters
_BAR_SPACING = 9  # between group bars
_MIN_LABEL_SPACING = 24  # the least from one number of the axis to the next


def draw_critical_difference(found: CriticalDifference, looks: Mapping[str, SeriesStyle]) -> Markup:
    """The chart as SVG: average ranks as dots, and a bar on the right beside each group without a difference."""
    count = len(found.ranks)
    plot = _WIDTH - _NAME - 14 - _BAR_SPACING * (len(found.groups) + 1)
    height = _TOP + _ROW * count + 8
    parts = [*_draw_axis(count, plot, height), *_draw_dots(found, looks, plot), *_draw_bars(found, plot)]
    return svg_picture("".join(parts), _WIDTH, height, _describe_ranks(found))


def _describe_ranks(found: CriticalDifference) -> str:
    ranks = ", ".join(f"{name} {rank:.2f}" for name, rank in found.ranks.items())
    alike = "; ".join(" and ".join(group) for group in found.groups) or "none"
    bars = "Too few to tell any two apart" if found.has_too_few_blocks else f"Not told apart: {alike}"
    return f"Average ranks: {ranks}. {bars}."


def _draw_axis(count: int, plot: int, height: int) -> Iterator[str]:
    step = -(-_MIN_LABEL_SPACING * (count - 1) // plot) or 1
    for rank in range(1, count + 1):
        x = _rank_x(rank, count, plot)
        yield svg_element("line", x1=x, x2=x, y1=_TOP - 8, y2=height - 8, stroke=palette.GRID)
        if (rank - 1) % step == 0:
            yield svg_text(str(rank), x, _TOP - 14, _SIZE, "middle")


def _draw_dots(found: CriticalDifference, looks: Mapping[str, SeriesStyle], plot: int) -> Iterator[str]:
    for row, (name, rank) in enumerate(found.ranks.items()):
        x, y = _rank_x(rank, len(found.ranks), plot), _row_y(row)
        yield svg_text(name, _NAME - 8, y + 4, _SIZE, "end")
        yield svg_element("line", x1=_NAME, x2=x, y1=y, y2=y, stroke=palette.RULE)
        yield svg_element("circle", cx=x, cy=y, r=5, fill=looks[name].color)
        yield svg_text(f"{rank:.2f}", x + 8, y + 4, _SIZE, fill=palette.PALE)


def _draw_bars(found: CriticalDifference, plot: int) -> Iterator[str]:
    rows = {name: row for row, name in enumerate(found.ranks)}
    for place, group in enumerate(() if found.has_too_few_blocks else found.groups):
        x = _NAME + plot + 22 + place * _BAR_SPACING
        top, bottom = _row_y(rows[group[0]]) - 7, _row_y(rows[group[-1]]) + 7
        yield svg_element("line", x1=x, x2=x, y1=top, y2=bottom, stroke=palette.INK, stroke_width=4)


def _rank_x(rank: float, count: int, plot: int) -> float:
    return _NAME + 4 + (plot - 26) * (rank - 1) / max(count - 1, 1)


def _row_y(row: int) -> int:
    return _TOP + _ROW * row + 10
