"""Figures of size against share named: over all effects, and for each."""

from typing import Any

import numpy as np
import pandas as pd

from concealed.score.measures import ABOVE
from concealed.score.rows import Rows
from concealed.score.style import BLACK, COLOURS, GREY, MARKS, figure_of
from concealed.score.tables import detection, detection_by_effect

CURVES = {
    "named_class": "right name or class of four",
    "named_first": "right first name",
    "called_unknown": "outside the library: called unknown",
}
LIMITS = (0.25, 25.0)  # of the axis of sizes, detection limits
ACROSS = 6  # panels a row


def detection_figure(rows: Rows, tiers: list[str]) -> Any:
    """Share named against size: a panel a kind of answer, a line a tier with its Wilson band."""
    figure, panels = figure_of((9.6, 3.8), columns=len(CURVES), sharey=True)
    for axes, (name, title) in zip(panels, CURVES.items(), strict=True):
        for tier in tiers:
            table = detection(rows, tier)
            _curve(axes, table[table["name"] == name], tier)
        axes.axvline(ABOVE, color=GREY, linestyle=":")
        axes.set_title(title, fontsize=9)
        axes.set(xscale="log", xlim=LIMITS, ylim=(-0.02, 1.02), xlabel="size, detection limits")
        axes.set_xticks([0.5, 1, 3, 10], ["0.5", "1", "3", "10"])
        axes.minorticks_off()
    panels[0].set_ylabel("share of hidden effects")
    marks = [_mark(panels[0], tier) for tier in tiers]
    labels = [f"{tier}, with 95 % band" for tier in tiers]
    figure.legend(marks, labels, loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return figure


def effects_figure(rows: Rows) -> Any:
    """A panel an effect: each case as a point (above: named, below: not), and the share in bins with Wilson's bars."""
    table = detection_by_effect(rows)
    names = list(dict.fromkeys(table["effect"]))
    down = max(-(-len(names) // ACROSS), 1)
    figure, panels = figure_of((11, 0.8 + 1.5 * down), down, ACROSS, sharey=True, squeeze=False)
    for axes, name in zip(panels.flat, names, strict=False):
        own = rows.effects[rows.effects["effect"] == name]
        _panel(axes, table[table["effect"] == name], own)
        outside = bool(own["outside"].any())
        title = name.replace("_", " ") + (" (outside)" if outside else "")
        axes.set_title(f"{title}\nn = {len(own)}", fontsize=7.5, style="italic" if outside else "normal")
    for axes in panels.flat[len(names) :]:
        axes.set_visible(False)
    for axes in panels.flat[max(len(names) - ACROSS, 0) : len(names)]:
        axes.tick_params(labelbottom=True)
    figure.supxlabel("size, detection limits (dotted: three)", fontsize=8.5)
    figure.supylabel("share with the right name or class, outside: called unknown", fontsize=8.5)
    marks = [_mark(panels.flat[0], tier) for tier in COLOURS]
    figure.legend(marks, list(COLOURS), loc="outside upper right", ncols=2, fontsize=8, frameon=False)
    return figure


def _curve(axes: Any, table: pd.DataFrame, tier: str) -> None:
    table = table[table["number"] > 0].astype(dict.fromkeys(("value", "low", "high"), float))
    if not len(table):
        return
    middle = _middles(table) * (0.97 if tier == "clean" else 1.03)  # side by side where they agree
    axes.fill_between(middle, table["low"], table["high"], color=COLOURS[tier], alpha=0.15, lw=0)
    axes.plot(middle, table["value"], color=COLOURS[tier], marker=MARKS[tier], ms=4.5)


def _panel(axes: Any, table: pd.DataFrame, effects: pd.DataFrame) -> None:
    for tier, own in effects.groupby("tier"):
        height = own["named_class"].astype(float) + (0.05 if tier == "clean" else -0.05)
        sizes = np.clip(own["multiple"], *LIMITS)
        axes.scatter(sizes, height, s=11, marker=MARKS[str(tier)], facecolors="none", edgecolors=COLOURS[str(tier)])
    table = table[table["number"] > 0].astype(dict.fromkeys(("value", "low", "high"), float))
    middle = _middles(table)
    across = [middle - np.maximum(table["from"], LIMITS[0]), np.minimum(table["to"], LIMITS[1]) - middle]
    errors = [table["value"] - table["low"], table["high"] - table["value"]]
    axes.errorbar(middle, table["value"], yerr=errors, xerr=across, color=BLACK, ls="none", lw=0.9, capsize=0)
    axes.axvline(ABOVE, color=GREY, linestyle=":", lw=1)
    axes.set(xscale="log", xlim=LIMITS, ylim=(-0.12, 1.12))
    axes.set_xticks([1, 10], ["1", "10"], fontsize=7)
    axes.set_yticks([0, 0.5, 1], ["0", "0.5", "1"], fontsize=7)
    axes.minorticks_off()


def _middles(table: pd.DataFrame) -> Any:
    """Where a bin is drawn: the geometric mean of its ends, within what is hidden at all."""
    return np.sqrt(np.maximum(table["from"], 0.25) * np.minimum(table["to"], 20.0))


def _mark(axes: Any, tier: str) -> Any:
    return axes.scatter([], [], s=20, marker=MARKS[tier], facecolors="none", edgecolors=COLOURS[tier])
