"""Figure 3: average convergence of the algorithms over the iterations."""

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from bench.figure import look, render
from bench.printed import display_name

_PANELS = {"best_so_far": "best so far", "present_best": "present best of the algorithm"}


def draw_convergence(table: pd.DataFrame) -> dict[str, bytes]:
    """Best so far and present best, averaged, from a convergence table; PNG and SVG bytes."""

    def draw(axes: Sequence[Axes]) -> None:
        for panel, (column, title) in zip(axes, _PANELS.items(), strict=True):
            for index, (label, rows) in enumerate(table.groupby("algorithm", sort=False)):
                color, linestyle, _ = look(index)
                name = display_name(str(label))
                panel.plot(rows["iteration"], rows[column], label=name, color=color, linestyle=linestyle)
            panel.set(title=title, xlabel="iteration (0: first population)", yscale="log")
        axes[0].yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))  # powers of ten alone may be out of range
        axes[0].yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes[0].yaxis.set_minor_formatter(NullFormatter())
        axes[0].set_ylabel("average condition number, feasible ends (-)")

    return render(2, draw)
