"""The picture: rank correlations of features and standings, and the ends of the descents on each landscape."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from armlab.common.report import palette
from bench.figures import render_figure
from bench.printed import display_name
from bench.studies.landscape.standing import CANNOT_TELL, FEATURES

_SHADES = "PuOr"  # a diverging scale that readers with any colour vision can read
_TICKS = (1, 1.1, 1.2, 1.5, 2, 3, 5, 10)
_TEXT_ON_DARK = 0.7  # size of a correlation above which text is white


def draw_landscape(features: pd.DataFrame, correlations: pd.DataFrame, ends: pd.DataFrame) -> dict[str, bytes]:
    """SVG bytes; tables as `feature_table`, `correlation_table` and `ends_table` make them."""
    landscapes = features.drop_duplicates("landscape").sort_values("dimension", kind="stable")
    algorithms = list(correlations["algorithm"].unique())

    def fill(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1.1, 1.0))
        _draw_correlations(left, correlations, algorithms)
        _draw_ends(right, landscapes, ends)

    return render_figure((13.0, 2.2 + 0.2 * max(len(landscapes), 2 * len(algorithms))), fill)


def _draw_correlations(axes: Axes, correlations: pd.DataFrame, algorithms: list[str]) -> None:
    axes.grid(visible=False)
    table = correlations.pivot(index="algorithm", columns="feature", values="correlation")
    table = table.loc[algorithms, list(FEATURES)]
    axes.imshow(table.to_numpy(), cmap=_SHADES, vmin=-1, vmax=1, aspect="auto")
    columns = list(FEATURES)
    for row in correlations.to_dict("records"):
        place = columns.index(row["feature"]), algorithms.index(row["algorithm"])
        if np.isnan(row["correlation"]):
            continue
        mark = "*" if row["confirmed"] else ""
        colour = "white" if abs(row["correlation"]) > _TEXT_ON_DARK else palette.BLACK
        axes.annotate(f"{row['correlation']:.2f}{mark}", place, ha="center", va="center", fontsize=7, color=colour)
        if row["verdict"] != CANNOT_TELL:
            corner = place[0] - 0.46, place[1] - 0.46
            axes.add_patch(Rectangle(corner, 0.92, 0.92, fill=False, edgecolor=palette.BLACK, linewidth=1.6))
    axes.set_xticks(range(len(columns)), list(FEATURES.values()), rotation=40, ha="right")
    axes.set_yticks(range(len(algorithms)), [display_name(name) for name in algorithms])
    axes.set_title(
        "rank correlation with the standing (-1: best where the feature is large)\nframe: told, *: found again"
    )


def _draw_ends(axes: Axes, landscapes: pd.DataFrame, ends: pd.DataFrame) -> None:
    names = list(landscapes["landscape"])
    best = landscapes.set_index("landscape")["best"]
    for row, name in enumerate(names):
        found = ends[(ends["landscape"] == name) & ends["feasible"]]
        excess = found["value"] / best[name]
        axes.plot(excess, np.full(len(excess), row), "o", color=palette.BLUE, markersize=3.5, alpha=0.6)
    labels = [
        f"{name.split('/', 1)[1].removesuffix('-origin').removesuffix('-shifted')}, {dimension}"
        for name, dimension in zip(names, landscapes["dimension"], strict=True)
    ]
    axes.set_yticks(range(len(names)), labels, fontsize=7)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    widest = (ends.loc[ends["feasible"], "value"] / ends.loc[ends["feasible"], "landscape"].map(best)).max()
    axes.set_xticks([tick for tick in _TICKS if tick < 1.1 * widest])
    axes.xaxis.set_minor_formatter("")
    axes.set(xlabel="condition number of a descent's end, relative to the best (-)", ylim=(len(names) - 0.5, -0.5))
    axes.set_title("where descents with derivatives end (landscape, dimension)")
