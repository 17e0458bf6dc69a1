"""The confusion matrix as a figure: what was hidden against what was said, in the order of the vocabulary."""

from typing import Any

import numpy as np
import pandas as pd

from concealed.outside import OUTSIDE
from concealed.score.style import BLACK, BLUE, LIGHT, ORANGE, figure_of
from concealed.score.tables import NOTHING
from recordings.vocabulary import EFFECTS

UNNAMED = {
    "unknown": "unknown",
    "missed": "missed beside others",
    "none": "nothing said",
    "inconclusive": "inconclusive",
    "invalid": "no verdict",
}
INSIDE = tuple(each.id for each in EFFECTS if each.id != "unknown")
ABROAD = tuple(each.effect for each in OUTSIDE)
EDGE = 0.35  # inches a cell


def confusion_figure(table: pd.DataFrame, title: str) -> Any:
    """Counts of a table of what was hidden (rows) and said (columns); right answers in blue, wrong names in orange.

    A cell is the darker the larger its share of what was hidden.
    """
    rows, columns = _rows(table), _columns(table)
    counts = table.reindex(index=rows, columns=columns, fill_value=0)
    shares = counts.div(counts.sum(axis=1), axis=0).to_numpy(dtype=np.float64)
    figure, axes = figure_of((2.6 + EDGE * len(columns), 2.4 + 0.75 * EDGE * len(rows)))
    picture = [[_shade(row, column, shares[i, j]) for j, column in enumerate(columns)] for i, row in enumerate(rows)]
    axes.imshow(np.array(picture).reshape(len(rows), len(columns), 3), aspect="auto")
    for (i, j), count in np.ndenumerate(counts.to_numpy()):
        if count:
            colour = "white" if shares[i, j] > 0.6 and _kind(rows[i], columns[j]) != "missed" else BLACK
            axes.text(j, i, str(count), ha="center", va="center", fontsize=7.5, color=colour)
    _lines(axes, rows, columns)
    axes.set_xticks(range(len(columns)), [UNNAMED.get(each, each).replace("_", " ") for each in columns], fontsize=7.5)
    axes.tick_params(axis="x", rotation=90, length=0)
    labels = [f"{each.replace('_', ' ')}  ({counts.loc[each].sum()})" for each in rows]
    axes.set_yticks(range(len(rows)), labels, fontsize=7.5)
    axes.set_xlabel("said", fontsize=8.5)
    axes.set_ylabel("hidden (how many)", fontsize=8.5)
    axes.set_title(f"{title}\nblue: right, orange: another name, grey: not named", fontsize=9, loc="left")
    return figure


def _rows(table: pd.DataFrame) -> list[str]:
    return [each for each in (*INSIDE, *ABROAD, NOTHING) if each in table.index]


def _columns(table: pd.DataFrame) -> list[str]:
    """The names that were hidden or said, so that right answers stand on a diagonal; then what is no name."""
    names = [each for each in INSIDE if each in table.index or each in table.columns]
    return [*names, *(each for each in UNNAMED if each in table.columns)]


def _kind(hidden: str, said: str) -> str:
    """right, wrong, or missed."""
    right = {NOTHING: "none"}.get(hidden, "unknown" if hidden in ABROAD else hidden)
    if said == right:
        return "right"
    return "wrong" if said in INSIDE or (said == "unknown" and hidden == NOTHING) else "missed"


def _shade(hidden: str, said: str, share: float) -> tuple[float, float, float]:
    """White for none, the full colour of the kind of answer for all."""
    from matplotlib.colors import to_rgb

    full = {"right": to_rgb(BLUE), "wrong": to_rgb(ORANGE), "missed": to_rgb("0.6")}[_kind(hidden, said)]
    strength = 0.0 if share == 0 or np.isnan(share) else 0.2 + 0.8 * share
    red, green, blue = (1 - strength * (1 - each) for each in full)
    return red, green, blue


def _lines(axes: Any, rows: list[str], columns: list[str]) -> None:
    """A faint grid, and bold lines between the library, what is outside, and nothing."""
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color=LIGHT, lw=0.6)
    axes.tick_params(which="minor", length=0)
    inside = sum(each in INSIDE for each in rows)
    for edge in (inside, inside + sum(each in ABROAD for each in rows)):
        axes.axhline(edge - 0.5, color=BLACK, lw=1)
    axes.axvline(sum(each in INSIDE for each in columns) - 0.5, color=BLACK, lw=1)
