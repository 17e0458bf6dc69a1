"""One picture of the closed loop: how each kind of second motion ended, and whether that was foreseen."""

from collections.abc import Sequence
from io import BytesIO

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from concealed.loop.case import KINDS
from concealed.loop.reliability import Bin
from concealed.loop.table import ENDS, Share, Shares

TOLD = {"right": "decided rightly", "wrong": "decided wrongly", "open": "still open"}
NAMES = {"designed": "designed motion", "random": "random motion", "condition": "smallest condition number"}
READABLE = 0.04  # smaller shares carry no number
COLORS = {"right": "#0072B2", "wrong": "#D55E00", "open": "#C9CED4"}  # told apart with any colour vision


def picture(counted: Shares, bins: Sequence[Bin]) -> bytes:
    """PNG. Left: a bar for each kind of second motion, split by its ends, with the interval of right above it. Right:
    expected chances of a right end against what came."""
    with matplotlib.rc_context({"font.size": 10, "legend.frameon": False}):
        figure = Figure(figsize=(11.5, 3.4), layout="constrained")
        ends, foreseen = figure.subplots(1, 2, width_ratios=(2.6, 1))
        for place, kind in enumerate(reversed(KINDS)):
            _bar(ends, place, {end: counted[kind, end] for end in ("right", "open", "wrong")})
        ends.set(yticks=range(len(KINDS)), yticklabels=[NAMES[kind] for kind in reversed(KINDS)], xlim=(0, 1))
        cases = counted[KINDS[0], ENDS[0]].cases
        ends.set(xlabel="share of cases", title=f"{cases} ambiguous recordings, one second motion each way")
        ends.spines[["top", "right"]].set_visible(False)
        _foreseen(foreseen, bins)
        figure.legend(*ends.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=130, metadata={"Software": None})
    return buffer.getvalue()


def _bar(axis: Axes, place: int, ends: dict[str, Share]) -> None:
    left = 0.0
    for end, share in ends.items():
        label = TOLD[end] if place == 0 else None
        axis.barh(place, share.value, left=left, color=COLORS[end], label=label, height=0.6)
        if share.value > READABLE:
            ink = "black" if end == "open" else "white"
            axis.text(left + share.value / 2, place, f"{100 * share.value:.0f} %", ha="center", va="center", color=ink)
        left += share.value
    axis.plot(ends["right"].interval, [place + 0.36] * 2, color="black", linewidth=1.2)


def _foreseen(axis: Axes, bins: Sequence[Bin]) -> None:
    axis.plot([0, 1], [0, 1], color="0.6", linestyle="dashed", linewidth=1)
    for each in bins:
        axis.plot([each.expected] * 2, each.came.interval, color=COLORS["right"], linewidth=1.2)
        axis.plot(each.expected, each.came.value, "o", color=COLORS["right"], markersize=5)
        axis.annotate(
            f"{each.came.cases}", (each.expected, each.came.value), (5, -3), textcoords="offset points", fontsize=8
        )
    axis.set(xlim=(0, 1.02), ylim=(0, 1.02), xlabel="forecast: decided rightly", ylabel="came true")
    axis.set(title="was it foreseen? (motions)")
    axis.spines[["top", "right"]].set_visible(False)
