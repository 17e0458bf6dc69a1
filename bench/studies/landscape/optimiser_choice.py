"""The page that says which optimiser to take; every number on it is read from files of results."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from bench.printed import display_name
from bench.studies.landscape.choice_studies import (
    budget_section,
    budget_sentence,
    least_row,
    median_number,
    space_section,
    space_sentence,
    time_section,
    time_sentence,
    tuning_section,
    tuning_sentence,
)
from bench.studies.landscape.ratios import Ratio, mean_ratio, quartile_ratio_text
from bench.studies.landscape.sources import Sources, SummaryTable
from bench.studies.landscape.standing import BETTER, CANNOT_TELL, FEATURES, POWER, standings

FORMS = {"tool": "path of the tool point", "joint": "periodic series", "rest": "series from rest to rest"}
CHOSEN_ON, CHECKED_ON = "suite 1", "the held-out suite"
COLUMNS = {CHOSEN_ON: "suite 1", CHECKED_ON: "held-out"}


_READING = """\
*Ratio*: geometric mean over problems of the median condition numbers of two algorithms, above 1 where the first one
ends higher, that is worse. In brackets a 95 % interval: a bootstrap over the problems (those that differ in their frame
alone count as one); the range where problems are fewer than six, which is said; on a single problem from the quartiles
of both algorithms (McGill, Tukey and Larsen 1978). Algorithms are chosen on suite 1; the numbers of the held-out suite
took no part in that. A median is infeasible where most ends break a limit; such problems are left out of a ratio and
counted beside it, which flatters an algorithm that has many of them. The least of many medians is flattered by being
chosen; ratios to it are upper bounds. Of two infeasible medians the one with the larger share of feasible ends has
the better rank; the reports of comparisons rank them as equal, so their average ranks differ a little."""


def choice_page(sources: Sources) -> str:
    """The whole page."""
    return markdown_page(
        "Which optimiser should I take?",
        "<!-- Written by `armlab bench landscape` from the files in results/: do not edit. -->",
        *_short_answer(sources),
        _READING,
        *_plain_section(sources),
        *_readings_section(sources),
        *_asking_section(sources),
        *budget_section(sources),
        *time_section(sources),
        *space_section(sources),
        *tuning_section(sources),
        *_kind_section(sources),
        *_feature_section(sources),
    )


def _short_answer(sources: Sources) -> Iterator[str]:
    choice = _name(sources.choice)
    points = [
        f"- **Without derivatives**, {_evaluations(sources.suite)} evaluations: **{choice}**. "
        + _rivals_sentence(sources),
        _asking_sentence(sources),
        space_sentence(sources),
        budget_sentence(sources),
        time_sentence(sources),
        tuning_sentence(sources),
        _kind_sentence(sources),
        _readings_sentence(sources),
    ]
    yield "\n".join(points)


def _name(algorithm: str) -> str:
    return display_name(algorithm)


def _names(algorithms: Sequence[str]) -> str:
    return ", ".join(map(_name, algorithms)) or "none"


def _evaluations(comparison: SummaryTable) -> str:
    sizes, iterations = (np.atleast_1d(comparison.settings[key]) for key in ("swarm_size", "iterations"))
    return " or ".join(f"{count:,}" for count in np.outer(sizes, iterations + 1).ravel())


def _rivals_sentence(sources: Sources) -> str:
    others = [name for name in sources.plain if name in sources.held_out.algorithms and name != sources.choice]
    rivals = {name: sources.ratio(sources.held_out, name, sources.choice) for name in others}
    tied = [name for name, ratio in rivals.items() if not ratio.told_apart]
    better = [name for name, ratio in rivals.items() if ratio.told_apart and ratio.value < 1]
    worse = sorted((name for name in rivals if name not in (*tied, *better)), key=lambda name: rivals[name].value)
    told = ", ".join(f"{_name(name)} {rivals[name].text()}" for name in worse)
    return (
        f"On {CHECKED_ON} these end higher, by the ratio: {told or 'none'}; not told apart from it: {_names(tied)}; "
        f"better: {_names(better)}."
    )


def _asking_sentence(sources: Sources) -> str:
    if sources.asking_choice is None:
        told = "; ".join(
            f"`{problem}`: **{_name(asking)}**, the best without, {_name(plain)}, ends "
            f"{quartile_ratio_text(rows.loc[plain], rows.loc[asking], sources.derivatives.repetitions)} times as high"
            for problem, rows, plain, asking in _derivative_winners(sources.derivatives)
        )
        return (
            "- **With exact derivatives**, each point counted for the dimension plus one evaluations, "
            f"{_evaluations(sources.derivatives)} in all: {told}."
        )
    is_checked = sources.asking_choice in sources.held_out.algorithms
    runs, where = (sources.held_out, CHECKED_ON) if is_checked else (sources.suite, "suite 1, on which it was chosen,")
    ratio = sources.ratio(runs, sources.choice, sources.asking_choice)
    return (
        f"- **With exact derivatives**, each counted for the dimension plus one evaluations: "
        f"**{_name(sources.asking_choice)}**. On {where} {_name(sources.choice)} ends {ratio.text()} times as high"
        f"{_left_out(ratio)}."
    )


def _left_out(ratio: Ratio) -> str:
    return f", {ratio.without} problems left out where one of the two is infeasible" if ratio.without else ""


def _plain_section(sources: Sources) -> Iterator[str]:
    yield "## Without derivatives"
    yield (
        f"Average rank among the {len(sources.plain)} algorithms without derivatives, share of feasible ends, number "
        f"of least medians, and the ratio to {_name(sources.choice)}; {_evaluations(sources.suite)} evaluations, "
        f"{sources.suite.repetitions} repetitions."
    )
    yield _field_table(sources, sources.plain, sources.choice)


def _reading_ratio(sources: Sources, label: str) -> Ratio:
    """Of an algorithm under another reading to the choice, on suite 1."""
    ours, theirs = sources.readings.medians(label), sources.suite.medians(sources.choice)
    return mean_ratio(ours, theirs, sources.groups)


def _readings_sentence(sources: Sources) -> str:
    """Whether another reading of an algorithm ends below the choice."""
    ratios = {label: _reading_ratio(sources, label) for label in sources.readings.algorithms}
    better = [label for label, ratio in ratios.items() if ratio.told_apart and ratio.value < 1]
    tied = [label for label, ratio in ratios.items() if not ratio.told_apart]
    return (
        f"- **All this is of the algorithms as read here.** Of {len(ratios)} other readings of the paper's six on "
        f"{CHOSEN_ON}, the source's text as printed or its authors' program, these end below {_name(sources.choice)}: "
        f"{', '.join(map(_reading_name, better)) or 'none'}; not told apart from it: "
        f"{', '.join(map(_reading_name, tied)) or 'none'}."
    )


def _reading_name(label: str) -> str:
    name, _, reading = label.partition(" ")
    return f"{_name(name)} ({reading})"


def _readings_section(sources: Sources) -> Iterator[str]:
    """What other readings of the algorithms change on suite 1."""
    both = pd.concat([sources.suite.only(sources.plain).table, sources.readings.table])
    ranks = SummaryTable(both, sources.suite.settings).average_ranks()
    yield "## Other readings of the algorithms"
    yield (
        "The rows above are of the algorithms as read here. A source's text as printed and its authors' program are "
        "other readings (`reading`; the docstrings say what each does), from the same first populations. Suite 1: rank "
        f"among all {len(ranks)}, and the ratio to {_name(sources.choice)}, both as here and as read otherwise."
    )
    rows = []
    for name in dict.fromkeys(label.partition(" ")[0] for label in sources.readings.algorithms):
        cells = [_name(name), f"{ranks[name]:.1f}", sources.ratio(sources.suite, name, sources.choice).text()]
        for label in (f"{name} text", f"{name} program"):
            known = label in ranks
            cells += [f"{ranks[label]:.1f}", _reading_ratio(sources, label).text()] if known else ["-", "-"]
        rows.append(cells)
    headings = ["algorithm", "rank, as here", "ratio", "rank, text", "ratio", "rank, program", "ratio"]
    yield markdown_table(headings, rows, range(1, 7))


def _field_table(sources: Sources, algorithms: Sequence[str], reference: str) -> str:
    headings = ["algorithm"]
    for suite in (CHOSEN_ON, CHECKED_ON):
        headings += [f"rank, {COLUMNS[suite]}", "feasible", "least", f"ratio to {_name(reference)}", "left out"]
    columns = []
    for comparison in (sources.suite, sources.held_out):
        field = comparison.only(algorithms)
        ranks, wins = field.average_ranks(), standings(field.table).eq(1).sum()
        feasible = field.table.groupby("algorithm")["feasible_share"].mean()
        columns.append((field, ranks, wins, feasible))
    rows = []
    for name in columns[0][1].index:
        cells = [_name(str(name))]
        for field, ranks, wins, feasible in columns:
            if name not in ranks:
                cells += ["-"] * 5
                continue
            ratio = sources.ratio(field, str(name), reference)
            shown = "1" if name == reference else ratio.text()
            cells += [f"{ranks[name]:.2f}", f"{feasible[name]:.0%}", str(wins[name]), shown, str(ratio.without)]
        rows.append(cells)
    return markdown_table(headings, rows, range(1, len(headings)))


def _asking_section(sources: Sources) -> Iterator[str]:
    yield "## With derivatives"
    if sources.asking_choice is not None:
        yield (
            f"All algorithms of the suite; ratios to {_name(sources.asking_choice)}, the best of those that ask for "
            "derivatives."
        )
        yield _field_table(sources, sources.suite.algorithms, sources.asking_choice)
    compared = sources.derivatives
    yield (
        f"The paper's problem and its like in joint space, {_evaluations(compared)} evaluations, "
        f"{compared.repetitions} repetitions: medians, and the ratio to the best that asks for derivatives."
    )
    cells: dict[str, list[str]] = {name: [] for name in compared.algorithms}
    winners = _derivative_winners(compared)
    for _, rows, _, asking in winners:
        for name in cells:
            shown = (
                "1" if name == asking else quartile_ratio_text(rows.loc[name], rows.loc[asking], compared.repetitions)
            )
            cells[name] += [median_number(rows, name), shown]
    headings = ["algorithm", *(text for problem, *_, asking in winners for text in (problem, f"to {_name(asking)}"))]
    yield markdown_table(headings, [[_name(name), *each] for name, each in cells.items()], range(1, len(headings)))


def _derivative_winners(compared: SummaryTable) -> list[tuple[str, pd.DataFrame, str, str]]:
    """By problem: its rows by algorithm, and the least medians without and with derivatives."""
    groups = [(str(name), rows.set_index("algorithm")) for name, rows in compared.table.groupby("problem", sort=False)]
    return [
        (problem, rows, str(least_row(rows, asking=False).name), str(least_row(rows, asking=True).name))
        for problem, rows in groups
    ]


def _kinds(sources: Sources) -> Iterator[tuple[str, SummaryTable, SummaryTable]]:
    """Kinds of problems: form of the trajectory and joints, with the rows of both suites."""
    for (form, joints), rows in sources.features.groupby(["form", "joints"], sort=False):
        problems = list(rows["problem"])
        label = f"{FORMS[str(form)]} ({joints} joints)"
        yield label, sources.suite.of_problems(problems), sources.held_out.of_problems(problems)


def _kind_winner(comparison: SummaryTable) -> str:
    return str(comparison.average_ranks().index[0])


def _kind_sentence(sources: Sources) -> str:
    overall = _kind_winner(sources.suite)
    winners: dict[str, list[str]] = {}
    better = []
    for label, suite, held_out in _kinds(sources):
        winner = _kind_winner(suite)
        winners.setdefault(winner, []).append(label)
        if sources.ratio(held_out, overall, winner).low > 1:
            better.append(f"{_name(winner)} for {label}")
    told = "; ".join(f"**{_name(name)}**: {', '.join(labels)}" for name, labels in winners.items())
    return (
        f"- **By kind of problem**, the least average rank on {CHOSEN_ON} has {told}. On {CHECKED_ON} these end below "
        f"{_name(overall)}, the best of all kinds together, on each problem of the kind: {', '.join(better) or 'none'}."
    )


def _kind_section(sources: Sources) -> Iterator[str]:
    overall = _kind_winner(sources.suite)
    yield "## For which kind of problem"
    yield (
        f"The algorithm with the least average rank on the problems of a kind on {CHOSEN_ON}, the share of feasible "
        f"ends, and the ratio of {_name(overall)}, the best of all kinds together, to it, on both suites."
    )
    rows = []
    for label, suite, held_out in _kinds(sources):
        winner = _kind_winner(suite)
        feasible = suite.only([winner]).table["feasible_share"].mean()
        cells = [label, str(suite.table["problem"].nunique()), _name(winner), f"{feasible:.0%}"]
        cells += [
            "1" if winner == overall else sources.ratio(each, overall, winner).text() for each in (suite, held_out)
        ]
        rows.append([*cells, str(held_out.table["problem"].nunique())])
    ratios = [f"ratio, {text}" for text in COLUMNS.values()]
    headings = ["kind", "problems", "least rank", "feasible", *ratios, "held-out problems"]
    yield markdown_table(headings, rows, (1, 3, 4, 5, 6))


def _feature_section(sources: Sources) -> Iterator[str]:
    table = sources.correlations
    found = table[table["verdict"] != CANNOT_TELL]
    yield "## Can the landscape of my problem tell?"
    again = f", and {int(found['confirmed'].sum())} of them are found again on {CHECKED_ON}" if len(found) else ""
    yield (
        f"Of {int(table['p'].notna().sum())} pairs of a feature and an algorithm, {len(found) or 'none'} "
        f"{'have' if len(found) > 1 else 'has'} a rank correlation with the standing on {CHOSEN_ON} that Holm's "
        f"correction leaves{again}. With {int(table['problems'].max())} different problems, a correlation is seen with "
        f"a power of {POWER:g} if it is at least {table['smallest_alone'].min():.2f} as the only comparison and "
        f"{table['smallest_holm'].min():.2f} at Holm's first step; what is smaller these suites cannot tell. The "
        "table of all pairs stands in `results/landscape/landscape.md`."
    )
    rows = [
        (
            _name(row["algorithm"]),
            FEATURES[row["feature"]],
            "better" if row["verdict"] == BETTER else "worse",
            f"{row['correlation']:.2f} ({row['low']:.2f} to {row['high']:.2f})",
            f"{row['p_holm']:.2g}",
            f"{row['within_arms']:.2f}, {row['p_within_holm']:.2g}",
            f"{row['checked_correlation']:.2f}, {row['checked_p']:.2g}",
        )
        for row in found[found["confirmed"]].to_dict("records")
    ]
    if rows:
        yield "Those that are found again; ranks are relative, so where one algorithm falls others must rise."
        headings = ["algorithm", "feature", "where it is large", "correlation", "p", "within arms, p", "held out, p"]
        yield markdown_table(headings, rows, (3, 4, 5, 6))
