"""All figures of a score: detection curves, confusion, names by effect, the gap that was closed, run time."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from concealed.score.curves import detection_figure, effects_figure
from concealed.score.matrix import confusion_figure
from concealed.score.measures import ABOVE
from concealed.score.rows import Rows
from concealed.score.style import BLUE, COLOURS, GREY, LIGHT, ORANGE, SKY, figure_of, save
from concealed.score.tables import by_effect, confusion

WHOLE = ("gap", "seconds", "detection", "detection_by_effect")  # both tiers in one figure
OF_A_TIER = ("confusion_{}", "confusion_{}_all", "names_{}")
LINES = {"clean": "-", "realistic": "--"}


def draw_all(rows: Rows, folder: Path) -> list[Path]:
    """Draws every figure that has something to show into a folder, in place of older ones; returns the files."""
    for name in (*WHOLE, *(each.format(tier) for each in OF_A_TIER for tier in COLOURS)):
        (folder / f"{name}.svg").unlink(missing_ok=True)
    tiers = sorted(set(rows.cases["tier"]))
    drawn = [save(_seconds(rows, tiers), folder / "seconds.svg")]
    if rows.cases["gap_closed"].notna().any():
        drawn.append(save(_gap(rows, tiers), folder / "gap.svg"))
    if len(rows.effects):
        drawn.append(save(detection_figure(rows, tiers), folder / "detection.svg"))
        drawn.append(save(effects_figure(rows), folder / "detection_by_effect.svg"))
    for tier in tiers:
        drawn += _of_tier(rows, tier, folder)
    return drawn


def _of_tier(rows: Rows, tier: str, folder: Path) -> list[Path]:
    large, drawn = f"{tier} tier, effects above {ABOVE:g} detection limits", []
    tables = {"": (confusion(rows, tier, ABOVE), large), "_all": (confusion(rows, tier), f"{tier} tier, all sizes")}
    for suffix, (counts, title) in tables.items():
        if len(counts):
            drawn.append(save(confusion_figure(counts, title), folder / f"confusion_{tier}{suffix}.svg"))
    names = by_effect(rows, tier)
    if len(names):
        drawn.append(save(_names(names, large), folder / f"names_{tier}.svg"))
    return drawn


def _gap(rows: Rows, tiers: list[str]) -> Any:
    figure, panels = figure_of((8.4, 3.4), columns=2, sharey=True)
    titles = {
        "gap_closed": "from rigid links, refitted",
        "gap_closed_beyond_friction": "from rigid links and plain friction, refitted",
    }
    for axes, (column, title) in zip(panels, titles.items(), strict=True):
        for tier in tiers:
            closed = rows.cases.loc[rows.cases["tier"] == tier, column].dropna().to_numpy(dtype=np.float64)
            _cumulative(axes, np.clip(closed, -0.5, 1.1), tier)
        axes.axvline(0.9, color=GREY, linestyle=":")
        axes.set(xlabel="share of the gap closed (1: true floor)", xlim=(-0.5, 1.1), ylim=(0, 1.02))
        axes.set_title(title, fontsize=9)
    panels[0].set_ylabel("share of cases, cumulative")
    return figure


def _seconds(rows: Rows, tiers: list[str]) -> Any:
    figure, axes = figure_of((5.4, 3.2))
    for tier in tiers:
        _cumulative(axes, rows.cases.loc[rows.cases["tier"] == tier, "seconds"].dropna().to_numpy(np.float64), tier)
    axes.set(xlabel="time of a diagnosis, s (one thread)", ylabel="share of cases, cumulative", ylim=(0, 1.02))
    axes.set_xlim(left=0)
    return figure


def _cumulative(axes: Any, values: Any, tier: str) -> None:
    if len(values):
        style = {"color": COLOURS[tier], "linestyle": LINES[tier], "label": f"{tier}, {len(values)} cases"}
        axes.ecdf(values, **style)
        axes.legend(fontsize=8, frameon=False)


def _names(table: pd.DataFrame, title: str) -> Any:
    table = table[(table["above"] > 0) | (table["wrong_claims"] > 0)]
    figure, axes = figure_of((6.8, 1.5 + 0.22 * len(table)))
    places = np.arange(len(table))
    axes.barh(places, table["above"], color=LIGHT, label="hidden")
    axes.barh(places, table["class"], color=SKY, label="right class (outside: unknown)")
    axes.barh(places, table["first"], color=BLUE, height=0.4, label="right first name")
    axes.barh(places, -table["wrong_claims"], color=ORANGE, hatch="///", edgecolor="white", label="claimed wrongly")
    axes.axvline(0, color="black", lw=0.8)
    axes.set_yticks(places, [each.replace("_", " ") for each in table["effect"]], fontsize=7.5)
    axes.invert_yaxis()
    axes.xaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("effects")
    axes.set_title(title, fontsize=9, loc="left")
    axes.legend(fontsize=7.5, frameon=False, loc="upper left", bbox_to_anchor=(1, 1))
    return figure
