"""Figure 2: best cost and computing time against swarm size."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes

from bench.figure import look, render
from bench.printed import display_name

_SWARM_SIZE = "swarm size (particles)"


def draw_cost(table: pd.DataFrame) -> dict[str, bytes]:
    """Median with quartiles, and minimum, of the repetitions, from a summary table; PNG and SVG bytes."""

    def draw(axes: Sequence[Axes]) -> None:
        for index, (label, rows) in enumerate(table.groupby("algorithm", sort=False)):
            name, drawn, sizes = display_name(str(label)), look(index), rows["swarm_size"]
            median = f"{name}, median and quartiles"
            axes[0].plot(sizes, rows["median"], label=median, color=drawn.color, marker=drawn.marker)
            quartiles = rows["lower_quartile"], rows["upper_quartile"]
            axes[0].fill_between(sizes, *quartiles, color=drawn.color, alpha=0.15, linewidth=0)
            axes[0].plot(sizes, rows["minimum"], label=f"{name}, minimum", color=drawn.color, linestyle=":")
        axes[0].set(xlabel=_SWARM_SIZE, ylabel="condition number of the best trajectory (-)")

    return render(1, draw)


def draw_times(times: pd.DataFrame) -> dict[str, bytes]:
    """Computing time of a run, average and standard deviation, from a table of times; PNG and SVG bytes."""

    def draw(axes: Sequence[Axes]) -> None:
        for index, (label, rows) in enumerate(times.groupby("algorithm", sort=False)):
            drawn = look(index)
            axes[0].errorbar(
                rows["swarm_size"],
                rows["average_seconds"],
                yerr=rows["standard_deviation"],
                label=display_name(str(label)),
                color=drawn.color,
                marker=drawn.marker,
                capsize=2,
            )
        axes[0].set(xlabel=_SWARM_SIZE, ylabel="computing time of a run on one core (s)")
        axes[0].set_ylim(bottom=0)

    return render(1, draw)
