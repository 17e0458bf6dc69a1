"""Figures of the study beyond the paper."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.figures import line_style, render_figure, render_panels
from bench.printed import display_name
from bench.tables import summary_table


def draw_ingredients(table: pd.DataFrame) -> dict[str, bytes]:
    """Chance that each variant ends better than MuPSO as published, with intervals; a panel a problem and budget."""
    cells = list(table.groupby(["problem", "budget"], sort=False))

    def fill(figure: Figure) -> None:
        panels = figure.subplots(1, len(cells), sharey=True, squeeze=False)[0]
        for axes, ((problem, budget), rows) in zip(panels, cells, strict=True):
            _draw_intervals(axes, rows)
            axes.set_title(f"{problem}\n{budget} evaluations", fontsize=9)
        panels[0].invert_yaxis()
        figure.supxlabel(
            "chance that the variant ends better than MuPSO (A12, 95 % interval; filled: p < 0.05)", fontsize=9
        )

    return render_figure((2.6 + 2.1 * len(cells), 6.4), fill)


def _draw_intervals(axes: Axes, rows: pd.DataFrame) -> None:
    places = np.arange(len(rows))
    axes.axvline(0.5, color="black", linewidth=0.8)
    axes.hlines(places, rows["low"], rows["high"], color=line_style(0).color, linewidth=1.2)
    clear = (rows["p_holm"] < 0.05).to_numpy()
    for chosen, face in ((clear, line_style(0).color), (~clear, "white")):
        middle = rows["superiority"].to_numpy()[chosen]
        axes.plot(middle, places[chosen], "o", color=line_style(0).color, markerfacecolor=face, markersize=5, zorder=3)
    axes.set(xlim=(-0.03, 1.03), xticks=[0, 0.25, 0.5, 0.75, 1], yticks=places)
    axes.set_xticklabels(["0", "", "0.5", "", "1"])
    axes.set_yticklabels([display_name(str(label)) for label in rows["subject"]])


def draw_swarm_sizes(frame: pd.DataFrame) -> dict[str, bytes]:
    """Median against swarm size at equal evaluations; SVG bytes."""
    table = summary_table(frame)

    def draw(axes: Sequence[Axes]) -> None:
        for index, (label, rows) in enumerate(table.groupby("algorithm", sort=False)):
            color, linestyle, marker = line_style(index)
            name = display_name(str(label))
            axes[0].plot(
                rows["swarm_size"], rows["median"], label=name, color=color, linestyle=linestyle, marker=marker
            )
        axes[0].set(xlabel="swarm size (particles)", ylabel="median condition number (-)")

    return render_panels(1, draw)
