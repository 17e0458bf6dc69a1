"""The sections of the page, one function each, as HTML."""

from collections.abc import Mapping, Sequence
from html import escape

import yaml

from bench.properties import table as properties_table
from bench.properties.facts import Facts
from bench.report.analysis import Cell
from bench.report.critical_picture import critical_picture
from bench.report.looks import Look
from bench.report.tables import duels_table, ends_table, power_table, table, tally_table
from bench.sharing.result_set import ResultSet
from bench.statistics.critical import CriticalDifference
from bench.statistics.power import powers


def head(results: ResultSet, cells: Sequence[Cell], found: CriticalDifference) -> str:
    """What was compared, and the verdict in a sentence."""
    trials = results.trials
    best = next(iter(found.ranks))
    equals = [name for group in found.groups if best in group for name in group if name != best]
    verdict = f"{best} has the best average rank, {found.ranks[best]:.2f} of {len(found.ranks)}"
    if found.sees_nothing:
        verdict += f"; {found.blocks} {_blocks(cells)} are too few to tell any pair apart."
    else:
        verdict += f"; it cannot be told apart from {', '.join(equals)}." if equals else "; it differs from all others."
    return (
        f"<header><h1>{escape(results.name)}</h1><p>{len(cells)} problems, {trials['algorithm'].nunique()} algorithms, "
        f"{trials['repetition'].nunique()} repetitions, {len(trials)} runs.</p>"
        f'<p class="verdict">{escape(verdict)}</p></header>'
    )


def buttons(looks: Mapping[str, Look]) -> str:
    """One button an algorithm, which is the legend of all charts too."""
    items = "".join(
        f'<button type="button" aria-pressed="true" data-algorithm="{escape(name)}" data-color="{color}" '
        f'data-dash="{dash}"><svg width="26" height="10" aria-hidden="true"><line x1="0" x2="26" y1="5" y2="5" '
        f'stroke="{color}" stroke-width="3" stroke-dasharray="{dash}"/></svg>{escape(name)}</button>'
        for name, (color, dash) in looks.items()
    )
    return f'<nav class="legend" aria-label="Show or hide algorithms">{items}</nav>'


def ranking(found: CriticalDifference, cells: Sequence[Cell], names: list[str], looks: Mapping[str, Look]) -> str:
    """The critical-difference picture, and who beats whom on how many problems."""
    text = (
        f"Average ranks over {found.blocks} {_blocks(cells)}, 1 the best. A bar joins algorithms that cannot be told "
        f"apart: Wilcoxon's signed-rank test of every pair, Holm's correction over all {len(found.p)}, 5 %. "
        f"Friedman's test that all are equal: p = {found.friedman_p:.2g}."
    )
    if found.sees_nothing:
        text += f" With so few {_blocks(cells)} no pair could be told apart at all."
    tally = (
        "<h3>Problem by problem</h3><p>On how many problems the algorithm of the row is better – worse than that of "
        "the column: Wilcoxon paired by repetition, Holm over all pairs of a problem, 5 %.</p>"
        + tally_table(cells, names)
    )
    return _section("ranking", "Ranking", text, critical_picture(found, looks) + (tally if len(cells) > 1 else ""))


def _blocks(cells: Sequence[Cell]) -> str:
    """What is ranked: medians of problems, or the repetitions of the only one."""
    return "problems" if len(cells) > 1 else "repetitions"


def overall() -> str:
    """Share of targets reached and performance profile."""
    return _section(
        "overall",
        "All problems together",
        "Targets reached: the share over all problems and runs; 51 targets a problem, evenly spaced in the "
        "logarithm from the worst first feasible value to the best value of all. Within a factor: the share of "
        "problems on which the median end is within a factor of the least median (performance profile).",
        f'<div class="charts">{_figures("overall-reached", "profile")}</div>',
    )


def problem(cells: Sequence[Cell]) -> str:
    """Charts of the chosen problem, and the tables of all."""
    options = "".join(f'<option value="{k}">{escape(cell.label)}</option>' for k, cell in enumerate(cells))
    tables = "".join(
        f'<div class="problem" data-problem="{k}"><h3>{escape(cell.label)}</h3>'
        f"{ends_table(cell)}{duels_table(cell)}</div>"
        for k, cell in enumerate(cells)
    )
    return _section(
        "problems",
        "One problem",
        "Convergence: median of the best so far with its quartiles; an infeasible value counts as infinite and is not "
        "drawn. ERT: expected running time in evaluations, failed runs included. Area: under the convergence curve in "
        "log10, 0 would be the best value from the first evaluation on, 1 the worst to the end.",
        f'<p class="controls"><label for="problem">Problem</label><select id="problem">{options}</select>'
        '<button type="button" id="previous">previous</button><button type="button" id="next">next</button></p>'
        f'<div class="charts">{_figures("convergence", "reached", "ends")}</div>{tables}',
    )


def power(cells: Sequence[Cell]) -> str:
    """What the paired test can see with this number of repetitions."""
    repetitions = min(cell.repetitions for cell in cells)
    count = len(cells[0].all_duels)
    shown = power_table(powers(repetitions, max(count, 1)), repetitions, max(count, 1))
    text = (
        f"Chance to see a true difference on one problem with {repetitions} repetitions, by simulation of uncorrelated "
        "pairs. With Holm's correction it lies between the two columns."
    )
    return _section("power", "What can be seen at all", text, shown)


def properties(facts: Sequence[Facts]) -> str:
    """What each algorithm does to a problem that is moved, scaled or noise."""
    if not facts:
        return ""
    shown = table(properties_table.HEADINGS, properties_table.rows(facts))
    return _section("properties", "Properties of the algorithms", properties_table.READING, shown)


def origin(results: ResultSet) -> str:
    """Provenance, settings, and the commands that repeat it."""
    rows = [[key, *(str(origin.get(key, "–")) for origin in results.origins)] for key in _keys(results)]
    headings = ["", *(f"machine {k}" for k in range(1, len(results.origins) + 1))]
    settings = yaml.safe_load(results.settings)
    steps = (
        f"armlab run {results.name}.yaml\narmlab report {results.name}.yaml\n"
        f"armlab share {results.name}.yaml --as csv --out {results.name}_tables"
    )
    return _section(
        "origin",
        "Where this comes from, and how to repeat it",
        f"Seed {settings['seed']}. With the same versions the same configuration gives the same numbers, whatever the "
        "number of workers.",
        f"<pre>{escape(steps)}</pre>{table(headings, rows)}"
        f"<details><summary>All settings</summary><pre>{escape(results.settings)}</pre></details>",
    )


def _keys(results: ResultSet) -> list[str]:
    return list(dict.fromkeys(key for origin in results.origins for key in origin))


def _section(name: str, title: str, text: str, content: str) -> str:
    return f'<section id="{name}"><h2>{title}</h2><p>{escape(text)}</p>{content}</section>'


def _figures(*names: str) -> str:
    return "".join(f'<figure data-chart="{name}"></figure>' for name in names)
