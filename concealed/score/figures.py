"""Figures of a score: detection curves, confusion, names by effect, the gap that was closed."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from concealed.score.measures import by_effect, confusion, detection
from concealed.score.rows import Rows

COLOURS = {"clean": "#0072B2", "realistic": "#D55E00"}  # Okabe and Ito 2008: told apart by everyone
MARKS = {"clean": "o", "realistic": "s"}


def draw_all(rows: Rows, folder: Path) -> list[Path]:
    """Draws every figure into a folder; returns the files."""
    import matplotlib

    matplotlib.use("Agg")
    tiers = sorted(set(rows.cases["tier"]))
    drawn = [_save(_detection(rows, tiers), folder / "detection.svg"), _save(_gap(rows, tiers), folder / "gap.svg")]
    for tier in tiers:
        drawn.append(_save(_confusion(confusion(rows, tier), tier), folder / f"confusion_{tier}.svg"))
        drawn.append(_save(_names(by_effect(rows, tier), tier), folder / f"names_{tier}.svg"))
    return drawn


def _detection(rows: Rows, tiers: list[str]) -> Any:
    figure, axes = _axes(6.4, 4.0)
    for tier in tiers:
        table = detection(rows, tier)
        table = table[(table["name"] == "named_class") & (table["number"] > 0)]
        middle = np.sqrt(np.maximum(table["from"], 0.25) * np.minimum(table["to"], 20.0))
        errors = [table["value"] - table["low"], table["high"] - table["value"]]
        style = {"color": COLOURS[tier], "marker": MARKS[tier], "capsize": 3, "label": tier}
        axes.errorbar(middle, table["value"], yerr=errors, **style)
    axes.axvline(3, color="0.5", linestyle=":")
    axes.set(xscale="log", ylim=(0, 1.02), xlabel="size, detection limits", ylabel="share with the right name or class")
    axes.legend(title="95 % Wilson intervals")
    return figure


def _gap(rows: Rows, tiers: list[str]) -> Any:
    figure, axes = _axes(6.4, 4.0)
    for tier in tiers:
        closed = rows.cases.loc[rows.cases["tier"] == tier, "gap_closed"].dropna().to_numpy(dtype=np.float64)
        if len(closed):
            share = np.arange(1, len(closed) + 1) / len(closed)
            axes.step(
                np.sort(np.clip(closed, -0.5, 1.1)), share, color=COLOURS[tier], label=f"{tier}, {len(closed)} cases"
            )
    axes.axvline(0.9, color="0.5", linestyle=":")
    axes.set(
        xlabel="gap closed on the held-out run (1: down to the true floor)", ylabel="share of cases", xlim=(-0.5, 1.1)
    )
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
    return figure


def _confusion(table: pd.DataFrame, tier: str) -> Any:
    figure, axes = _axes(1.8 + 0.3 * table.shape[1], 1.6 + 0.26 * table.shape[0])
    shares = table.div(table.sum(axis=1), axis=0).to_numpy(dtype=np.float64)
    axes.imshow(shares, cmap="cividis", vmin=0, vmax=1, aspect="auto")
    for (row, column), count in np.ndenumerate(table.to_numpy()):
        if count:
            colour = "black" if shares[row, column] > 0.5 else "white"
            axes.text(column, row, str(count), ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(range(table.shape[1]), list(table.columns), rotation=90, fontsize=7)
    axes.set_yticks(range(table.shape[0]), list(table.index), fontsize=7)
    axes.set(xlabel="said", ylabel="hidden", title=f"{tier} tier, number of effects")
    return figure


def _names(table: pd.DataFrame, tier: str) -> Any:
    table = table[table["above"] > 0]
    figure, axes = _axes(6.4, 1.2 + 0.24 * len(table))
    places = np.arange(len(table))
    axes.barh(places, table["above"], color="0.85", label="hidden above three limits")
    axes.barh(places, table["class"], color="#56B4E9", label="right class")
    axes.barh(places, table["first"], color="#0072B2", height=0.45, label="right first name")
    axes.set_yticks(places, list(table["effect"]), fontsize=7)
    axes.invert_yaxis()
    axes.set(xlabel="effects", title=f"{tier} tier")
    axes.legend(fontsize=7)
    return figure


def _axes(width: float, height: float) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots()


def _save(figure: Any, path: Path) -> Path:
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": path.stem}):
        figure.savefig(path, metadata={"Date": None})
    return path
