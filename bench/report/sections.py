"""The sections of the report and their tables, as HTML."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape

import numpy as np
import yaml

from bench.report.analysis import Cell
from bench.report.ranking_chart import ChartStyle, draw_critical_difference
from bench.result_sets.result_set import ResultSet
from bench.statistics.critical_difference import CriticalDifference
from bench.statistics.pairwise import Duel
from bench.statistics.power import Power, powers, smallest_detectable_effect
from bench.studies import properties as properties_table
from bench.studies.properties import AlgorithmProperties

_TARGET_SHARES = (0.25, 0.5, 0.75)  # of the way from easy to hard


def html_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """An HTML table that scrolls sideways; the first cell of a row is its heading."""
    head = "".join(f'<th scope="col">{escape(heading)}</th>' for heading in headings)
    body = "".join(_html_row(row) for row in rows)
    parts = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f'<div class="wide" tabindex="0"><table>{parts}</table></div>'


def ends_table(cell: Cell) -> str:
    """Medians with intervals, quartiles, feasible share, area and expected running times on one problem."""
    places = [round(share * (len(cell.targets) - 1)) for share in _TARGET_SHARES] if len(cell.targets) else []
    headings = ["algorithm", "median (95 %)", "quartiles", "minimum", "feasible", "area"]
    headings += [f"ERT to {cell.targets[place]:.3g}" for place in places]
    return html_table(headings, [_ends_row(cell, name, places) for name in cell.algorithms])


def _ends_row(cell: Cell, name: str, places: Sequence[int]) -> list[str]:
    summary, progress = cell.summary(name), cell.progress[name]
    low, high = cell.median_interval(name)
    return [
        name,
        f"{format_number(summary.median)} ({format_number(low)} – {format_number(high)})",
        f"{format_number(summary.lower_quartile)} – {format_number(summary.upper_quartile)}",
        format_number(summary.minimum),
        f"{summary.feasible_share:.0%}",
        "–" if np.isnan(progress.area) else f"{progress.area:.2f}",
        *(format_number(progress.expected[place]) for place in places),
    ]


def duels_table(cell: Cell) -> str:
    """The algorithm with the least median against all others."""
    best = min(cell.algorithms, key=lambda name: float(np.median(cell.losses[name])))
    fought = [_duel_from_side_of(best, duel) for duel in cell.all_duels if best in (duel.subject, duel.rival)]
    rows = [[duel.rival, _format_effect(duel), f"{duel.p:.2g}", _duel_outcome(duel)] for duel in fought]
    return html_table([f"{best} against", "A12 (95 %)", "p (Holm)", f"{best} is"], rows)


def _duel_from_side_of(subject: str, duel: Duel) -> Duel:
    """The same duel with the subject first."""
    if duel.subject == subject:
        return duel
    return Duel(subject, duel.subject, 1 - duel.superiority, 1 - duel.high, 1 - duel.low, duel.p)


def _format_effect(duel: Duel) -> str:
    return f"{duel.superiority:.2f} ({duel.low:.2f} – {duel.high:.2f})"


def _duel_outcome(duel: Duel) -> str:
    winner = duel.winner()
    return "not told apart" if winner is None else "better" if winner == duel.subject else "worse"


def tally_table(cells: Sequence[Cell], algorithms: Sequence[str]) -> str:
    """On how many problems an algorithm (row) is better and worse than another (column)."""
    won: dict[tuple[str, str], int] = {}
    for duel in (duel for cell in cells for duel in cell.all_duels):
        winner = duel.winner()
        if winner is not None:
            loser = duel.rival if winner == duel.subject else duel.subject
            won[winner, loser] = won.get((winner, loser), 0) + 1
    rows = [[name, *(_tally_cell(won, name, other) for other in algorithms)] for name in algorithms]
    return html_table(["better – worse", *algorithms], rows)


def _tally_cell(won: dict[tuple[str, str], int], name: str, other: str) -> str:
    return "" if name == other else f"{won.get((name, other), 0)} – {won.get((other, name), 0)}"


def power_table(powers: Sequence[Power], repetitions: int, comparisons: int) -> str:
    """The effects that the test can detect on one problem."""
    names = ("small", "medium", "large")
    rows = [
        [f"{name}, A12 = {power.superiority:.2f}", f"{power.alone:.0%}", f"{power.first_step:.0%}"]
        for name, power in zip(names, powers, strict=True)
    ]
    seen = [smallest_detectable_effect(repetitions, 0.05 / count) for count in (1, comparisons)]
    rows.append(["A12 seen with 80 %", *("none" if effect is None else f"{effect:.2f}" for effect in seen)])
    return html_table(["true effect", "one comparison", f"first of {comparisons} (Holm)"], rows)


def format_number(value: float) -> str:
    """A number with three digits; signs for infinite and unknown."""
    if np.isnan(value):
        return "–"
    if np.isinf(value):
        return "∞"
    return f"{value:.0f}" if 1000 <= value < 1e6 else f"{value:.3g}"


def _html_row(cells: Sequence[str]) -> str:
    first, *rest = (escape(cell) for cell in cells)
    return f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>'


def header_section(results: ResultSet, cells: Sequence[Cell], found: CriticalDifference) -> str:
    """What was compared, and the result in one sentence."""
    trials = results.trials
    best = next(iter(found.ranks))
    equals = [name for group in found.groups if best in group for name in group if name != best]
    verdict = f"{best} has the best average rank, {found.ranks[best]:.2f} of {len(found.ranks)}"
    if found.has_too_few_blocks:
        verdict += f"; {found.blocks} {_block_name(cells)} are too few to tell any pair apart."
    else:
        verdict += f"; it cannot be told apart from {', '.join(equals)}." if equals else "; it differs from all others."
    return (
        f"<header><h1>{escape(results.name)}</h1><p>{len(cells)} problems, {trials['algorithm'].nunique()} algorithms, "
        f"{trials['repetition'].nunique()} repetitions, {len(trials)} runs.</p>"
        f'<p class="verdict">{escape(verdict)}</p></header>'
    )


def algorithm_buttons(looks: Mapping[str, ChartStyle]) -> str:
    """One button an algorithm; the buttons are also the legend of all charts."""
    items = "".join(
        f'<button type="button" aria-pressed="true" data-algorithm="{escape(name)}" data-color="{color}" '
        f'data-dash="{dash}"><svg width="26" height="10" aria-hidden="true"><line x1="0" x2="26" y1="5" y2="5" '
        f'stroke="{color}" stroke-width="3" stroke-dasharray="{dash}"/></svg>{escape(name)}</button>'
        for name, (color, dash) in looks.items()
    )
    return f'<nav class="legend" aria-label="Show or hide algorithms">{items}</nav>'


def ranking_section(
    found: CriticalDifference, cells: Sequence[Cell], names: list[str], looks: Mapping[str, ChartStyle]
) -> str:
    """The critical-difference chart, and on how many problems each algorithm beats each other one."""
    text = (
        f"Average ranks over {found.blocks} {_block_name(cells)}, 1 the best. A bar joins algorithms that "
        "cannot be told "
        f"apart: Wilcoxon's signed-rank test of every pair, Holm's correction over all {len(found.p)}, 5 %. "
        f"Friedman's test that all are equal: p = {found.friedman_p:.2g}."
    )
    if found.has_too_few_blocks:
        text += f" With so few {_block_name(cells)} no pair could be told apart at all."
    tally = (
        "<h3>Problem by problem</h3><p>On how many problems the algorithm of the row is better – worse than that of "
        "the column: Wilcoxon paired by repetition, Holm over all pairs of a problem, 5 %.</p>"
        + tally_table(cells, names)
    )
    return _html_section(
        "ranking", "Ranking", text, draw_critical_difference(found, looks) + (tally if len(cells) > 1 else "")
    )


def _block_name(cells: Sequence[Cell]) -> str:
    """What is ranked: medians of problems, or the repetitions of a single problem."""
    return "problems" if len(cells) > 1 else "repetitions"


def overall_section() -> str:
    """Share of targets reached and performance profile."""
    return _html_section(
        "overall",
        "All problems together",
        "Targets reached: the share over all problems and runs; 51 targets a problem, evenly spaced in the "
        "logarithm from the worst first feasible value to the best value of all. Within a factor: the share of "
        "problems on which the median end is within a factor of the least median (performance profile).",
        f'<div class="charts">{_chart_frames("overall-reached", "profile")}</div>',
    )


def problem_section(cells: Sequence[Cell]) -> str:
    """Charts of the chosen problem, and the tables of all."""
    options = "".join(f'<option value="{k}">{escape(cell.label)}</option>' for k, cell in enumerate(cells))
    tables = "".join(
        f'<div class="problem" data-problem="{k}"><h3>{escape(cell.label)}</h3>'
        f"{ends_table(cell)}{duels_table(cell)}</div>"
        for k, cell in enumerate(cells)
    )
    return _html_section(
        "problems",
        "One problem",
        "Convergence: median of the best so far with its quartiles; an infeasible value counts as infinite and is not "
        "drawn. ERT: expected running time in evaluations, failed runs included. Area: under the convergence curve in "
        "log10, 0 would be the best value from the first evaluation on, 1 the worst to the end.",
        f'<p class="controls"><label for="problem">Problem</label><select id="problem">{options}</select>'
        '<button type="button" id="previous">previous</button><button type="button" id="next">next</button></p>'
        f'<div class="charts">{_chart_frames("convergence", "reached", "ends")}</div>{tables}',
    )


def power_section(cells: Sequence[Cell]) -> str:
    """The effects that the paired test can detect with this number of repetitions."""
    repetitions = min(cell.repetitions for cell in cells)
    count = len(cells[0].all_duels)
    shown = power_table(powers(repetitions, max(count, 1)), repetitions, max(count, 1))
    text = (
        f"Chance to see a true difference on one problem with {repetitions} repetitions, by simulation of uncorrelated "
        "pairs. With Holm's correction it lies between the two columns."
    )
    return _html_section("power", "What can be seen at all", text, shown)


def properties_section(facts: Sequence[AlgorithmProperties]) -> str:
    """The behaviour of each algorithm on a problem that is shifted, scaled or pure noise."""
    if not facts:
        return ""
    shown = html_table(properties_table.PROPERTY_HEADINGS, properties_table.property_rows(facts))
    return _html_section("properties", "Properties of the algorithms", properties_table.PROPERTY_READING, shown)


def origin_section(results: ResultSet) -> str:
    """Provenance, settings, and the commands that repeat the results."""
    rows = [[key, *(str(origin.get(key, "–")) for origin in results.origins)] for key in _origin_keys(results)]
    headings = ["", *(f"machine {k}" for k in range(1, len(results.origins) + 1))]
    settings = yaml.safe_load(results.settings)
    steps = (
        f"armlab run {results.name}.yaml\narmlab report {results.name}.yaml\n"
        f"armlab share {results.name}.yaml --as csv --out {results.name}_tables"
    )
    return _html_section(
        "origin",
        "Where this comes from, and how to repeat it",
        f"Seed {settings['seed']}. With the same versions the same configuration gives the same numbers, whatever the "
        "number of workers.",
        f"<pre>{escape(steps)}</pre>{html_table(headings, rows)}"
        f"<details><summary>All settings</summary><pre>{escape(results.settings)}</pre></details>",
    )


def _origin_keys(results: ResultSet) -> list[str]:
    return list(dict.fromkeys(key for origin in results.origins for key in origin))


def _html_section(name: str, title: str, text: str, content: str) -> str:
    return f'<section id="{name}"><h2>{title}</h2><p>{escape(text)}</p>{content}</section>'


def _chart_frames(*names: str) -> str:
    return "".join(f'<figure data-chart="{name}"></figure>' for name in names)
