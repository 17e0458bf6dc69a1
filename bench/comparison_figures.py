"""Figures of a comparison: every end of one problem, the ranking over many, and the medians against the budget."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from armlab.common.arrays import Array
from armlab.common.streams import named_generator
from bench.figures import FORMATS, line_style, mark_zero, render_figure
from bench.printed import display_name
from bench.statistics import is_feasible, quantile
from bench.statistics.critical_difference import (
    CriticalDifference,
    block_losses,
    critical_difference,
    paired_blocks,
    paired_ranking,
)
from bench.statistics.ends import place_of_zero
from bench.statistics.pairwise import log_losses
from bench.tables import GROUP_COLUMNS, summary_table
from bench.value_names import CONDITION_NUMBER

_TICK_MULTIPLES = (1, 1.2, 1.4, 1.6, 1.8, 2, 2.5, 3, 4, 5, 7)


_ROW_HEIGHT = 0.34  # inches
_SPREAD = 0.28  # of the dots of one row about its middle, in rows


def draw_ends(
    frame: pd.DataFrame,
    known: Mapping[str, float],
    formats: Sequence[str] = FORMATS,
    figures: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, bytes]:
    """Every end of each algorithm, with median, quartiles and the best known as a line; a panel a problem.

    frame: tidy, one swarm size and budget. known: best values by problem. figures: what a problem's value is, by
    problem, the condition number if left out. SVG bytes.
    """
    problems = [str(problem) for problem in frame["problem"].unique()]
    labels = [str(label) for label in frame["algorithm"].unique()]

    def fill(figure: Figure) -> None:
        panels = figure.subplots(1, len(problems), squeeze=False, sharey=True)[0]
        for axes, problem in zip(panels, problems, strict=True):
            _draw_ends_panel(axes, frame[frame["problem"] == problem], labels, known.get(problem))
            axes.set(title=problem, xlabel=figures.get(problem, CONDITION_NUMBER))
        panels[0].set(yticks=range(len(labels)), yticklabels=[display_name(label) for label in labels])
        panels[0].invert_yaxis()
        handles, texts = panels[0].get_legend_handles_labels()
        figure.legend(handles, texts, loc="outside lower center", ncols=4)

    return render_figure((1.6 + 4.6 * len(problems), 1.5 + _ROW_HEIGHT * len(labels)), fill, formats)


def _draw_ends_panel(axes: Axes, frame: pd.DataFrame, labels: list[str], known: float | None) -> None:
    axes.set_xscale("log")
    losses = np.where(is_feasible(frame["value"].to_numpy(), frame["violation"].to_numpy()), frame["value"], np.inf)
    zero = place_of_zero(losses)
    _set_plain_ticks(axes, losses[np.isfinite(losses) & (losses > 0)])
    mark_zero(axes, zero)
    losses = np.where(losses == 0, zero, losses) if zero is not None else losses
    _draw_best_known(axes.axvline, known)
    if not np.isfinite(losses).all():
        axes.set_xmargin(0.22)  # room for the notes on infeasible ends
    for row, label in enumerate(labels):
        _draw_row_of_ends(axes, row, label, losses[(frame["algorithm"] == label).to_numpy()])
    if zero is not None:
        axes.set_xlim(left=0.9 * zero)  # no tick stands below 0


def _draw_best_known(draw_line: Callable[..., object], value: float | None) -> None:
    if value is not None:
        draw_line(value, color="black", linewidth=1.0, linestyle=(0, (4, 2)), label="best known")


def _draw_row_of_ends(axes: Axes, row: int, label: str, ends: Array) -> None:
    color = line_style(row).color
    finite = ends[np.isfinite(ends)]
    places = row + named_generator("figure of ends", label, len(finite)).uniform(-_SPREAD, _SPREAD, len(finite))
    first = row == 0
    axes.plot(finite, places, "o", color=color, markersize=3, alpha=0.55, label="an end" if first else None)
    lower, middle, upper = (quantile(ends, share) for share in (0.25, 0.5, 0.75))
    if np.isfinite(upper):
        text = "quartiles" if first else None
        axes.plot([lower, upper], [row, row], color="black", linewidth=1.4, solid_capstyle="butt", label=text)
    if np.isfinite(middle):
        text = "median" if first else None
        axes.plot(middle, row, "|", color="black", markersize=15, markeredgewidth=2.2, label=text)
    if len(finite) < len(ends):
        note = f"{len(ends) - len(finite)} of {len(ends)} infeasible"
        place = ("axes fraction", "data")
        axes.annotate(note, (1.0, row - _SPREAD), xycoords=place, ha="right", va="center", fontsize=7)


def _set_plain_ticks(axes: Axes, values: Array) -> None:
    """Plain numbers on a logarithmic axis that spans little or much."""
    if len(values) and values.max() / values.min() < 30:
        axes.xaxis.set_major_locator(
            LogLocator(subs=_TICK_MULTIPLES if values.max() / values.min() < 3 else (1, 2, 3, 5))
        )
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())


def draw_ranking(frame: pd.DataFrame, formats: Sequence[str] = FORMATS) -> dict[str, bytes]:
    """Rank of each algorithm in every problem, its average, and the groups that no test tells apart.

    frame: tidy. The ranks are those of medians over problems or, of too few problems or a single one, those of ends
    over the repetitions. SVG bytes.
    """
    cells = ["problem", "swarm_size", "budget"]
    by_cell = [log_losses(rows) for _, rows in frame.groupby(cells, sort=False)]
    losses = block_losses(by_cell)
    found, blocks = critical_difference(losses), f"{len(losses)} {_block_name(frame)}"
    if found.has_too_few_blocks and len(by_cell) > 1:
        losses, found = paired_blocks(by_cell), paired_ranking(by_cell)
        blocks = f"{len(losses)} repetitions of {blocks}"
    count = len(found.ranks)

    def fill(figure: Figure) -> None:
        axes = figure.subplots()
        _draw_ranks(axes, losses, found)
        _draw_groups(axes, found)
        axes.set(yticks=range(count), yticklabels=[display_name(name) for name in found.ranks])
        too_few = ", too few to tell any two apart" if found.has_too_few_blocks else ""
        axes.set(xlabel=f"rank (1: best) in {blocks}{too_few}", xticks=range(1, count + 1))
        axes.invert_yaxis()
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)

    return render_figure((6.4, 1.5 + _ROW_HEIGHT * count), fill, formats)


def _block_name(frame: pd.DataFrame) -> str:
    cases = len(frame[["problem", "swarm_size", "budget"]].drop_duplicates())
    if cases == 1:
        return "repetitions"
    return "problems" if cases == frame["problem"].nunique() else "cases (problem, swarm size, budget)"


def _draw_ranks(axes: Axes, losses: pd.DataFrame, found: CriticalDifference) -> None:
    ranks = losses.rank(axis=1)
    order = {str(label): line_style(index).color for index, label in enumerate(losses.columns)}
    for row, (name, average) in enumerate(found.ranks.items()):
        numbers, counts = np.unique(ranks[name], return_counts=True)
        text = "ranks: a larger dot for more of them" if row == 0 else None
        axes.scatter(numbers, np.full(len(numbers), row), s=7.0 * counts, color=order[name], alpha=0.45, label=text)
        text = "average rank" if row == 0 else None
        axes.plot(average, row, "|", color="black", markersize=15, markeredgewidth=2.2, label=text)
        axes.annotate(f"{average:.2f}", (average, row), (0, 8), textcoords="offset points", ha="center", fontsize=7)


def _draw_groups(axes: Axes, found: CriticalDifference) -> None:
    """A bar on the right beside each group without a significant difference (Wilcoxon, Holm, 5 %)."""
    rows = {name: row for row, name in enumerate(found.ranks)}
    for place, group in enumerate(() if found.has_too_few_blocks else found.groups):
        x = len(rows) + 0.8 + 0.25 * place
        text = "not told apart" if place == 0 else None
        axes.plot([x, x], [rows[group[0]] - 0.3, rows[group[-1]] + 0.3], color="black", linewidth=2.5, label=text)


def draw_budgets(
    frame: pd.DataFrame,
    known: Mapping[str, float],
    formats: Sequence[str] = FORMATS,
    figures: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, bytes]:
    """Median and quartiles against the budget, a panel a problem, each with its own scale.

    known: best values by problem, drawn as a line. figures: as in `draw_ends`.
    """
    problems = list(frame["problem"].unique())

    def fill(figure: Figure) -> None:
        panels = figure.subplots(1, len(problems), squeeze=False)[0]
        for axes, problem in zip(panels, problems, strict=True):
            _draw_budget_panel(axes, frame[frame["problem"] == problem])
            _draw_best_known(axes.axhline, known.get(str(problem)))
            axes.set(title=problem, xlabel="budget of a run (evaluations)", xscale="log")
            if any(np.isfinite(line.get_ydata()).any() for line in axes.lines):  # a scale needs a value
                axes.set_yscale("log")
                axes.yaxis.set_major_locator(LogLocator(subs=_TICK_MULTIPLES))  # powers of ten may be out of range
                axes.yaxis.set_major_formatter("{x:g}")
                axes.yaxis.set_minor_locator(NullLocator())
            budgets = sorted(frame["budget"].unique())
            axes.set_xticks(budgets, [f"{budget:,}" for budget in budgets])
            axes.xaxis.set_minor_locator(NullLocator())
            axes.set_ylabel(f"{figures.get(str(problem), CONDITION_NUMBER)}, median and quartiles")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4 * len(problems))

    return render_figure((2 + 4.2 * len(problems), 4.6), fill, formats)


def _draw_budget_panel(axes: Axes, frame: pd.DataFrame) -> None:
    """Medians that are infinite, where most ends are infeasible, are left out."""
    budgets = frame.drop_duplicates(GROUP_COLUMNS)["budget"].to_numpy()  # in the order of the summary
    table = summary_table(frame).assign(budget=budgets)
    columns = ["lower_quartile", "median", "upper_quartile"]
    zero = place_of_zero(table[columns].to_numpy())
    mark_zero(axes, zero, upright=True)
    table[columns] = table[columns].where(table[columns] != 0, zero)
    for index, (label, group) in enumerate(table.groupby("algorithm", sort=False)):
        color, linestyle, marker = line_style(index)
        rows = group[np.isfinite(group["median"])]
        middle = rows["median"].to_numpy()
        ends = np.abs(rows[["lower_quartile", "upper_quartile"]].to_numpy().T - middle)
        shift = 1 + 0.03 * (index - 3.5)  # keeps the bars of neighbours apart
        axes.errorbar(
            rows["budget"] * shift,
            middle,
            yerr=np.where(np.isfinite(ends), ends, 0.0),
            label=display_name(str(label)),
            color=color,
            linestyle=linestyle,
            marker=marker,
            markersize=4,
            linewidth=1.2,
            elinewidth=0.8,
        )
