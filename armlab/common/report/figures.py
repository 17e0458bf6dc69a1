"""Figures of matplotlib for notebooks and scripts, with the looks of the charts on the pages."""

from collections.abc import Sequence
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from armlab.common.arrays import Array
from armlab.common.report import palette
from armlab.common.report.charts import FLOOR_LOOK, GIVEN_LOOK, REFITTED_LOOK, Chart, Level, Line, Look, Points
from armlab.common.report.palette import figure_style

CHART_SIZE_IN = (7.0, 3.2)
NOTEBOOK_DPI = 72  # as matplotlib has it in notebooks
MARKS = {GIVEN_LOOK: "s", REFITTED_LOOK: "o", FLOOR_LOOK: "|"}  # as on the pages; a disc for every other look


class ShownFigure(Figure):
    """A figure that every notebook shows as the value of a cell; `savefig` writes it."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png", dpi=NOTEBOOK_DPI)
        return buffer.getvalue()


def plot_chart(chart: Chart) -> ShownFigure:
    """The chart of a page as a figure."""
    with figure_style():
        figure = ShownFigure(CHART_SIZE_IN, layout="constrained")
        axes = figure.subplots()
        for layer in chart.layers:
            _plot_layer(axes, layer)
        axes.set(title=chart.title, xlabel=chart.x.label, ylabel=chart.y.label)
        axes.set_xlim(chart.x.low, chart.x.high)
        axes.set_ylim(chart.y.low, chart.y.high)
        figure.legend(loc="outside lower center", ncols=len(chart.layers))
    return figure


def _plot_layer(axes: Axes, layer: Line | Points | Level) -> None:
    look = layer.look
    if isinstance(layer, Points):
        axes.plot(layer.x, layer.y, ".", color=look.color, markersize=look.width, label=look.name)
        return
    dashes = tuple(float(length) / look.width for length in look.dash.split())
    style = (0, dashes) if dashes else "solid"
    if isinstance(layer, Level):
        axes.axhline(layer.y, color=look.color, linewidth=look.width, linestyle=style, label=look.name)
        return
    axes.plot(layer.x, layer.y, color=look.color, linewidth=look.width, linestyle=style, label=look.name)


def plot_by_joint(title: str, label: str, names: Sequence[str], series: Sequence[tuple[Look, Array]]) -> ShownFigure:
    """Marks on a logarithmic axis, a row a joint. label: of the axis. series: (joints,) each, NaN where unknown."""
    with figure_style():
        figure = ShownFigure((CHART_SIZE_IN[0], 1.4 + 0.28 * len(names)), layout="constrained")
        axes = figure.subplots()
        rows = np.arange(len(names))
        for look, values in series:
            mark, hollow = MARKS.get(look, "o"), look is REFITTED_LOOK
            face = palette.BACK if hollow else look.color
            axes.plot(values, rows, mark, color=look.color, markerfacecolor=face, markersize=8, label=look.name)
        axes.set(title=title, xlabel=f"{label}, logarithmic", xscale="log", yticks=rows, yticklabels=names)
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_ylim(len(names) - 0.5, -0.5)
        figure.legend(loc="outside lower center", ncols=len(series))
    return figure
