"""The figures of a score: detection curves, confusion matrix, names by effect, closed gap, run time."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from armlab.common.report import palette
from armlab.proof.blind.effects.library import LIBRARY
from armlab.proof.blind.outside import OUTSIDE
from armlab.proof.blind.score.measures import (
    MIN_NAMED_MULTIPLE,
    NOTHING_HIDDEN,
    confusion_table,
    detection_table,
    detection_table_by_effect,
    effect_table,
    reliability_table,
)
from armlab.proof.blind.score.rows import ScoreRows

# Okabe and Ito 2008
BLACK, BLUE, ORANGE, SKY, GREEN = palette.BLACK, palette.BLUE, palette.VERMILION, palette.SKY, palette.GREEN
GREY, LIGHT_GREY = "0.6", "0.88"
TIER_COLORS = {"clean": BLUE, "realistic": ORANGE}
TIER_MARKERS = {"clean": "o", "realistic": "s"}


def make_figure(size: tuple[float, float], rows: int = 1, columns: int = 1, **shared: Any) -> tuple[Any, Any]:
    """A figure of that size, inches, without a window, and its axes: one, or an array of them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    together = {"sharex": True, **shared} if rows * columns > 1 else shared
    axes = figure.subplots(rows, columns, **together)
    for each in figure.axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure, axes


def save_figure(figure: Any, path: Path) -> Path:
    """Writes an SVG."""
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": path.stem}):
        figure.savefig(path, metadata={"Date": None})
    return path


CURVE_TITLES = {
    "named_class": "right name or class of four",
    "named_first": "right first name",
    "called_unknown": "outside the library: called unknown",
}
SIZE_AXIS_LIMITS = (0.25, 25.0)  # of the axis of sizes, detection limits
PANELS_PER_ROW = 6  # panels a row


def draw_detection(rows: ScoreRows, tiers: list[str]) -> Any:
    """Share named against size: a panel a kind of answer, a line a tier with its Wilson band."""
    figure, panels = make_figure((9.6, 3.8), columns=len(CURVE_TITLES), sharey=True)
    for axes, (name, title) in zip(panels, CURVE_TITLES.items(), strict=True):
        for tier in tiers:
            table = detection_table(rows, tier)
            _draw_curve(axes, table[table["name"] == name], tier)
        axes.axvline(MIN_NAMED_MULTIPLE, color=GREY, linestyle=":")
        axes.set_title(title, fontsize=9)
        axes.set(xscale="log", xlim=SIZE_AXIS_LIMITS, ylim=(-0.02, 1.02), xlabel="size, detection limits")
        axes.set_xticks([0.5, 1, 3, 10], ["0.5", "1", "3", "10"])
        axes.minorticks_off()
    panels[0].set_ylabel("share of hidden effects")
    marks = [_legend_mark(panels[0], tier) for tier in tiers]
    labels = [f"{tier}, with 95 % band" for tier in tiers]
    figure.legend(marks, labels, loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return figure


def draw_detection_by_effect(rows: ScoreRows) -> Any:
    """A panel an effect: each case as a point (above: named, below: not), and the share in bins with Wilson's bars."""
    table = detection_table_by_effect(rows)
    names = list(dict.fromkeys(table["effect"]))
    down = max(-(-len(names) // PANELS_PER_ROW), 1)
    figure, panels = make_figure((11, 0.8 + 1.5 * down), down, PANELS_PER_ROW, sharey=True, squeeze=False)
    for axes, name in zip(panels.flat, names, strict=False):
        own = rows.effects[rows.effects["effect"] == name]
        _draw_panel(axes, table[table["effect"] == name], own)
        outside = bool(own["outside"].any())
        title = name.replace("_", " ") + (" (outside)" if outside else "")
        axes.set_title(f"{title}\nn = {len(own)}", fontsize=7.5, style="italic" if outside else "normal")
    for axes in panels.flat[len(names) :]:
        axes.set_visible(False)
    for axes in panels.flat[max(len(names) - PANELS_PER_ROW, 0) : len(names)]:
        axes.tick_params(labelbottom=True)
    figure.supxlabel("size, detection limits (dotted: three)", fontsize=8.5)
    figure.supylabel("share with the right name or class, outside: called unknown", fontsize=8.5)
    marks = [_legend_mark(panels.flat[0], tier) for tier in TIER_COLORS]
    figure.legend(marks, list(TIER_COLORS), loc="outside upper right", ncols=2, fontsize=8, frameon=False)
    return figure


def _draw_curve(axes: Any, table: pd.DataFrame, tier: str) -> None:
    table = table[table["number"] > 0].astype(dict.fromkeys(("value", "low", "high"), float))
    if not len(table):
        return
    middle = _bin_middles(table) * (0.97 if tier == "clean" else 1.03)  # side by side where they agree
    axes.fill_between(middle, table["low"], table["high"], color=TIER_COLORS[tier], alpha=0.15, lw=0)
    axes.plot(middle, table["value"], color=TIER_COLORS[tier], marker=TIER_MARKERS[tier], ms=4.5)


def _draw_panel(axes: Any, table: pd.DataFrame, effects: pd.DataFrame) -> None:
    for tier, own in effects.groupby("tier"):
        height = own["named_class"].astype(float) + (0.05 if tier == "clean" else -0.05)
        sizes = np.clip(own["multiple"], *SIZE_AXIS_LIMITS)
        axes.scatter(
            sizes, height, s=11, marker=TIER_MARKERS[str(tier)], facecolors="none", edgecolors=TIER_COLORS[str(tier)]
        )
    table = table[table["number"] > 0].astype(dict.fromkeys(("value", "low", "high"), float))
    middle = _bin_middles(table)
    across = [
        middle - np.maximum(table["from"], SIZE_AXIS_LIMITS[0]),
        np.minimum(table["to"], SIZE_AXIS_LIMITS[1]) - middle,
    ]
    errors = [table["value"] - table["low"], table["high"] - table["value"]]
    axes.errorbar(middle, table["value"], yerr=errors, xerr=across, color=BLACK, ls="none", lw=0.9, capsize=0)
    axes.axvline(MIN_NAMED_MULTIPLE, color=GREY, linestyle=":", lw=1)
    axes.set(xscale="log", xlim=SIZE_AXIS_LIMITS, ylim=(-0.12, 1.12))
    axes.set_xticks([1, 10], ["1", "10"], fontsize=7)
    axes.set_yticks([0, 0.5, 1], ["0", "0.5", "1"], fontsize=7)
    axes.minorticks_off()


def _bin_middles(table: pd.DataFrame) -> Any:
    """Where a bin is drawn: the geometric mean of its ends, within what is hidden at all."""
    return np.sqrt(np.maximum(table["from"], 0.25) * np.minimum(table["to"], 20.0))


def _legend_mark(axes: Any, tier: str) -> Any:
    return axes.scatter([], [], s=20, marker=TIER_MARKERS[tier], facecolors="none", edgecolors=TIER_COLORS[tier])


ANSWERS_WITHOUT_NAME = {
    "unknown": "unknown",
    "missed": "missed beside others",
    "none": "nothing said",
    "inconclusive": "inconclusive",
    "invalid": "no verdict",
}
LIBRARY_NAMES = tuple(each.effect for each in (*LIBRARY, *OUTSIDE) if not each.is_outside)
OUTSIDE_NAMES = tuple(each.effect for each in OUTSIDE if each.is_outside)
CELL_SIZE_IN = 0.35  # inches a cell


def draw_confusion(table: pd.DataFrame, title: str) -> Any:
    """Counts of a table of what was hidden (rows) and said (columns); right answers in blue, wrong names in orange.

    A cell is the darker the larger its share of what was hidden.
    """
    rows, columns = _row_names(table), _column_names(table)
    counts = table.reindex(index=rows, columns=columns, fill_value=0)
    shares = counts.div(counts.sum(axis=1), axis=0).to_numpy(dtype=np.float64)
    figure, axes = make_figure((2.6 + CELL_SIZE_IN * len(columns), 2.4 + 0.75 * CELL_SIZE_IN * len(rows)))
    picture = [
        [_cell_color(row, column, shares[i, j]) for j, column in enumerate(columns)] for i, row in enumerate(rows)
    ]
    axes.imshow(np.array(picture).reshape(len(rows), len(columns), 3), aspect="auto")
    for (i, j), count in np.ndenumerate(counts.to_numpy()):
        if count:
            colour = "white" if shares[i, j] > 0.6 and _answer_kind(rows[i], columns[j]) != "missed" else BLACK
            axes.text(j, i, str(count), ha="center", va="center", fontsize=7.5, color=colour)
    _draw_grid_lines(axes, rows, columns)
    axes.set_xticks(
        range(len(columns)), [ANSWERS_WITHOUT_NAME.get(each, each).replace("_", " ") for each in columns], fontsize=7.5
    )
    axes.tick_params(axis="x", rotation=90, length=0)
    labels = [f"{each.replace('_', ' ')}  ({counts.loc[each].sum()})" for each in rows]
    axes.set_yticks(range(len(rows)), labels, fontsize=7.5)
    axes.set_xlabel("said", fontsize=8.5)
    axes.set_ylabel("hidden (how many)", fontsize=8.5)
    axes.set_title(f"{title}\nblue: right, orange: another name, grey: not named", fontsize=9, loc="left")
    return figure


def _row_names(table: pd.DataFrame) -> list[str]:
    return [each for each in (*LIBRARY_NAMES, *OUTSIDE_NAMES, NOTHING_HIDDEN) if each in table.index]


def _column_names(table: pd.DataFrame) -> list[str]:
    """The names that were hidden or said, so that right answers stand on a diagonal; then what is no name."""
    names = [each for each in LIBRARY_NAMES if each in table.index or each in table.columns]
    return [*names, *(each for each in ANSWERS_WITHOUT_NAME if each in table.columns)]


def _answer_kind(hidden: str, said: str) -> str:
    """right, wrong, or missed."""
    right = {NOTHING_HIDDEN: "none"}.get(hidden, "unknown" if hidden in OUTSIDE_NAMES else hidden)
    if said == right:
        return "right"
    return "wrong" if said in LIBRARY_NAMES or (said == "unknown" and hidden == NOTHING_HIDDEN) else "missed"


def _cell_color(hidden: str, said: str, share: float) -> tuple[float, float, float]:
    """White for none, the full colour of the kind of answer for all."""
    from matplotlib.colors import to_rgb

    red, green, blue = to_rgb({"right": BLUE, "wrong": ORANGE, "missed": GREY}[_answer_kind(hidden, said)])
    strength = 0.0 if share == 0 or np.isnan(share) else 0.2 + 0.8 * share
    return 1 - strength * (1 - red), 1 - strength * (1 - green), 1 - strength * (1 - blue)


def _draw_grid_lines(axes: Any, rows: list[str], columns: list[str]) -> None:
    """A faint grid, and bold lines between the library, what is outside, and nothing."""
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color=LIGHT_GREY, lw=0.6)
    axes.tick_params(which="minor", length=0)
    inside = sum(each in LIBRARY_NAMES for each in rows)
    for edge in (inside, inside + sum(each in OUTSIDE_NAMES for each in rows)):
        axes.axhline(edge - 0.5, color=BLACK, lw=1)
    axes.axvline(sum(each in LIBRARY_NAMES for each in columns) - 0.5, color=BLACK, lw=1)


FIGURES_OF_ALL_TIERS = ("gap", "seconds", "reliability", "detection", "detection_by_effect")  # both tiers in one figure
FIGURES_OF_ONE_TIER = ("confusion_{}", "confusion_{}_all", "names_{}")
LINE_STYLES = {"clean": "-", "realistic": "--"}


def draw_figures(rows: ScoreRows, folder: Path) -> list[Path]:
    """Draws every figure that has something to show into a folder, in place of older ones; returns the files."""
    for name in (*FIGURES_OF_ALL_TIERS, *(each.format(tier) for each in FIGURES_OF_ONE_TIER for tier in TIER_COLORS)):
        (folder / f"{name}.svg").unlink(missing_ok=True)
    tiers = sorted(set(rows.cases["tier"]))
    drawn = [save_figure(_draw_seconds(rows, tiers), folder / "seconds.svg")]
    if rows.cases["gap_closed"].notna().any():
        drawn.append(save_figure(_draw_gap(rows, tiers), folder / "gap.svg"))
    if "probability" in rows.claims and rows.claims["probability"].notna().any():
        drawn.append(save_figure(_draw_reliability(rows, tiers), folder / "reliability.svg"))
    if len(rows.effects):
        drawn.append(save_figure(draw_detection(rows, tiers), folder / "detection.svg"))
        drawn.append(save_figure(draw_detection_by_effect(rows), folder / "detection_by_effect.svg"))
    for tier in tiers:
        drawn += _draw_tier(rows, tier, folder)
    return drawn


def _draw_tier(rows: ScoreRows, tier: str, folder: Path) -> list[Path]:
    large, drawn = f"{tier} tier, effects above {MIN_NAMED_MULTIPLE:g} detection limits", []
    tables = {
        "": (confusion_table(rows, tier, MIN_NAMED_MULTIPLE), large),
        "_all": (confusion_table(rows, tier), f"{tier} tier, all sizes"),
    }
    for suffix, (counts, title) in tables.items():
        if len(counts):
            drawn.append(save_figure(draw_confusion(counts, title), folder / f"confusion_{tier}{suffix}.svg"))
    names = effect_table(rows, tier)
    if len(names):
        drawn.append(save_figure(_draw_names(names, large), folder / f"names_{tier}.svg"))
    return drawn


def _draw_reliability(rows: ScoreRows, tiers: list[str]) -> Any:
    """Share of right claims against the probability that they state, in bins, a panel a tier."""
    figure, panels = make_figure((4.4 * len(tiers), 4.0), columns=len(tiers), sharey=True)
    for axes, tier in zip(np.atleast_1d(panels), tiers, strict=True):
        table = reliability_table(rows, tier)
        axes.plot([0, 1], [0, 1], color=GREY, linestyle=":")
        axes.errorbar(
            table["mean"],
            table["share"],
            yerr=[table["share"] - table["low"], table["high"] - table["share"]],
            color=TIER_COLORS[tier],
            marker=TIER_MARKERS[tier],
            linestyle="none",
            capsize=3,
        )
        for each in table.itertuples():
            axes.annotate(f"{each.number}", (each.mean, each.share), (6, -10), textcoords="offset points", fontsize=8)
        axes.set(xlim=(0, 1.02), ylim=(-0.02, 1.02), xlabel="stated probability, mean of a bin")
        axes.set_title(f"{tier} tier", fontsize=9)
    np.atleast_1d(panels)[0].set_ylabel("share that is right")
    return figure


def _draw_gap(rows: ScoreRows, tiers: list[str]) -> Any:
    figure, panels = make_figure((8.4, 3.4), columns=2, sharey=True)
    titles = {
        "gap_closed": "from rigid links, refitted",
        "gap_closed_beyond_friction": "from rigid links and plain friction, refitted",
    }
    for axes, (column, title) in zip(panels, titles.items(), strict=True):
        for tier in tiers:
            closed = rows.cases.loc[rows.cases["tier"] == tier, column].dropna().to_numpy(dtype=np.float64)
            _draw_cumulative(axes, np.clip(closed, -0.5, 1.1), tier)
        axes.axvline(0.9, color=GREY, linestyle=":")
        axes.set(xlabel="share of the gap closed (1: true floor)", xlim=(-0.5, 1.1), ylim=(0, 1.02))
        axes.set_title(title, fontsize=9)
    panels[0].set_ylabel("share of cases, cumulative")
    return figure


def _draw_seconds(rows: ScoreRows, tiers: list[str]) -> Any:
    figure, axes = make_figure((5.4, 3.2))
    for tier in tiers:
        _draw_cumulative(
            axes, rows.cases.loc[rows.cases["tier"] == tier, "seconds"].dropna().to_numpy(np.float64), tier
        )
    axes.set(xlabel="time of a diagnosis, s (one thread)", ylabel="share of cases, cumulative", ylim=(0, 1.02))
    axes.set_xlim(left=0)
    return figure


def _draw_cumulative(axes: Any, values: Any, tier: str) -> None:
    if len(values):
        style = {"color": TIER_COLORS[tier], "linestyle": LINE_STYLES[tier], "label": f"{tier}, {len(values)} cases"}
        axes.ecdf(values, **style)
        axes.legend(fontsize=8, frameon=False)


def _draw_names(table: pd.DataFrame, title: str) -> Any:
    table = table[(table["above"] > 0) | (table["wrong_claims"] > 0)]
    figure, axes = make_figure((6.8, 1.5 + 0.22 * len(table)))
    places = np.arange(len(table))
    axes.barh(places, table["above"], color=LIGHT_GREY, label="hidden")
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
