"""Figures in one style, the same bytes for the same data: cost and time against swarm size (Figure 2), and convergence
(Figure 3).
"""

from collections.abc import Callable, Sequence
from io import BytesIO
from typing import NamedTuple

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from armlab.common.report import palette
from bench.printed import display_name
from bench.statistics.ends import place_of_zero

# Okabe and Ito 2008: told apart by readers with any colour vision; yellow is left out, too pale for a line. Then grey
# and four of Tol's muted colours; with as many lines, the markers help.
_STYLES: tuple[tuple[str, str | tuple[int, tuple[int, ...]], str], ...] = (
    (palette.BLUE, "solid", "o"),
    (palette.VERMILION, "dashed", "s"),
    (palette.GREEN, "dashdot", "^"),
    (palette.PINK, "dotted", "D"),
    (palette.ORANGE, (0, (5, 1)), "v"),
    (palette.SKY, (0, (3, 1, 1, 1, 1, 1)), "P"),
    (palette.BLACK, (0, (1, 1)), "X"),
    (palette.GREY, "solid", "*"),
    (palette.WINE, "dashed", "<"),
    (palette.OLIVE, "dashdot", ">"),
    (palette.INDIGO, "dotted", "p"),
    (palette.MAGENTA, (0, (5, 1)), "h"),
)
DrawPanels = Callable[[Sequence[Axes]], None]
FORMATS = ("svg",)
BITMAP = ("png",)  # where an SVG is larger, or the committed picture cannot be drawn again


class LineStyle(NamedTuple):
    """How one algorithm is drawn in all panels of a figure."""

    color: str
    linestyle: str | tuple[int, tuple[int, ...]]
    marker: str


def line_style(index: int) -> LineStyle:
    """The style of the index-th algorithm."""
    return LineStyle(*_STYLES[index % len(_STYLES)])


def render_panels(panels: int, draw: DrawPanels, formats: Sequence[str] = FORMATS) -> dict[str, bytes]:
    """Bytes, by format, of a figure with a row of panels, which `draw` fills, and a legend below."""

    def fill(figure: Figure) -> None:
        axes = list(figure.subplots(1, panels, squeeze=False, sharey=True)[0])
        draw(axes)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4 * panels - 2)

    return render_figure((2 + 3.6 * panels, 3.8), fill, formats)


def render_figure(
    size: tuple[float, float], fill: Callable[[Figure], None], formats: Sequence[str] = FORMATS
) -> dict[str, bytes]:
    """Bytes, by format (png, svg, pdf), of a figure of that size, inches, which `fill` fills."""
    with matplotlib.rc_context():
        _set_style()
        figure = Figure(figsize=size, layout="constrained")
        fill(figure)
        return {suffix: _image_bytes(figure, suffix) for suffix in formats}


def _set_style() -> None:
    matplotlib.rcdefaults()  # a user's own style would change the bytes
    matplotlib.rc("figure", dpi=150)
    matplotlib.rc("font", size=9)
    matplotlib.rc("axes", grid=True)
    matplotlib.rc("axes.spines", top=False, right=False)
    matplotlib.rc("grid", alpha=0.3)
    matplotlib.rc("legend", frameon=False)
    matplotlib.rc("svg", hashsalt="armlab")  # else every SVG has random ids
    matplotlib.rc("pdf", fonttype=42)  # publishers refuse fonts of type 3


def _image_bytes(figure: Figure, suffix: str) -> bytes:
    buffer = BytesIO()
    names = {"png": ["Software"], "svg": ["Date", "Creator"], "pdf": ["CreationDate", "Creator", "Producer"]}[suffix]
    unsigned: dict[str, None] = dict.fromkeys(names)
    figure.savefig(buffer, format=suffix, metadata=unsigned)
    return buffer.getvalue()


def mark_zero(axes: Axes, place: float | None, *, upright: bool = False) -> None:
    """A dotted line where 0 stands on the logarithmic axis, with its number; upright: on the vertical axis."""
    if place is None:
        return
    draw_line = axes.axhline if upright else axes.axvline
    draw_line(place, color="black", linewidth=0.8, linestyle=":")
    transform = axes.get_yaxis_transform() if upright else axes.get_xaxis_transform()
    where = (1.01, place) if upright else (place, 1.01)
    sides = ("left", "center") if upright else ("center", "bottom")
    axes.text(*where, "0", transform=transform, ha=sides[0], va=sides[1], fontsize=8)


_SWARM_SIZE_LABEL = "swarm size (particles)"


def draw_cost(table: pd.DataFrame, value: str) -> dict[str, bytes]:
    """Median with quartiles, and minimum, of the repetitions, from a summary table; SVG bytes.

    value: what the problem's value is.
    """

    def draw(axes: Sequence[Axes]) -> None:
        for index, (label, rows) in enumerate(table.groupby("algorithm", sort=False)):
            name, drawn, sizes = display_name(str(label)), line_style(index), rows["swarm_size"]
            median = f"{name}, median and quartiles"
            axes[0].plot(sizes, rows["median"], label=median, color=drawn.color, marker=drawn.marker)
            quartiles = rows["lower_quartile"], rows["upper_quartile"]
            axes[0].fill_between(sizes, *quartiles, color=drawn.color, alpha=0.15, linewidth=0)
            axes[0].plot(sizes, rows["minimum"], label=f"{name}, minimum", color=drawn.color, linestyle=":")
        axes[0].set(xlabel=_SWARM_SIZE_LABEL, ylabel=f"{value}, best of a run")

    return render_panels(1, draw)


def draw_times(times: pd.DataFrame) -> dict[str, bytes]:
    """Computing time of a run, average and standard deviation, from a table of times; PNG bytes."""

    def draw(axes: Sequence[Axes]) -> None:
        for index, (label, rows) in enumerate(times.groupby("algorithm", sort=False)):
            drawn = line_style(index)
            axes[0].errorbar(
                rows["swarm_size"],
                rows["average_seconds"],
                yerr=rows["standard_deviation"],
                label=display_name(str(label)),
                color=drawn.color,
                marker=drawn.marker,
                capsize=2,
            )
        axes[0].set(xlabel=_SWARM_SIZE_LABEL, ylabel="computing time of a run on one core (s)")
        axes[0].set_ylim(bottom=0)

    return render_panels(1, draw, BITMAP)


_CONVERGENCE_PANELS = {
    "median_best_so_far": "best so far, median",
    "median_present_best": "present best of the algorithm, median",
    "best_so_far": "best so far, average as in the paper",
    "present_best": "present best, average as in the paper",
}


def draw_convergence(table: pd.DataFrame) -> dict[str, bytes]:
    """Best so far and present best from a convergence table, medians above and averages below; SVG bytes.

    Medians count an infeasible point as infinite, and such medians are not drawn. Averages leave such points out, so
    that a best so far may rise where a worse run becomes feasible.
    """

    def fill(figure: Figure) -> None:
        panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
        for panel, (column, title) in zip(panels, _CONVERGENCE_PANELS.items(), strict=True):
            zero = place_of_zero(table[column].to_numpy())
            mark_zero(panel, zero, upright=True)
            for index, (label, rows) in enumerate(table.groupby("algorithm", sort=False)):
                color, linestyle, _ = line_style(index)
                name = display_name(str(label))
                drawn = rows[column].where(np.isfinite(rows[column]))
                drawn = drawn.where(drawn != 0, zero)
                panel.plot(rows["iteration"], drawn, label=name, color=color, linestyle=linestyle)
            panel.set(title=title, yscale="log")
            panel.label_outer()
        panels[0].yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))  # powers of ten alone may be out of range
        panels[0].yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        panels[0].yaxis.set_minor_formatter(NullFormatter())
        for panel in panels[2:]:
            panel.set_xlabel("iteration (0: first population)")
        panels[0].set_ylabel("condition number (-)")
        panels[2].set_ylabel("condition number, feasible ends (-)")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=6)

    return render_figure((9.2, 7.0), fill)
