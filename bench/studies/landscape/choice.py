"""The page that says which optimiser to take; every number on it is read from files of results."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from algorithms.registry import names_with_derivatives
from armlab.common.markdown import markdown_page, markdown_table
from bench.printed import display_name
from bench.studies.landscape.ratios import Ratio, mean_ratio, quartile_ratio_text
from bench.studies.landscape.sources import Comparison, Sources
from bench.studies.landscape.standing import BETTER, CANNOT_TELL, FEATURES, POWER, standings
from bench.studies.search_space.study import FEASIBLE_MARK
from bench.studies.tuning.report import TUNED

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
chosen; ratios to it are upper bounds."""


def choice_page(sources: Sources) -> str:
    """The whole page."""
    return markdown_page(
        "Which optimiser should I take?",
        "<!-- Written by `armlab landscape` from the files in results/: do not edit. -->",
        *_short_answer(sources),
        _READING,
        *_plain_section(sources),
        *_asking_section(sources),
        *_budget_section(sources),
        *_space_section(sources),
        *_tuning_section(sources),
        *_kind_section(sources),
        *_feature_section(sources),
    )


def _short_answer(sources: Sources) -> Iterator[str]:
    choice = _name(sources.choice)
    points = [
        f"- **Without derivatives**, {_evaluations(sources.suite)} evaluations: **{choice}**. "
        + _rivals_sentence(sources),
        _asking_sentence(sources),
        _space_sentence(sources),
        _budget_sentence(sources),
        _tuning_sentence(sources),
        _kind_sentence(sources),
    ]
    yield "\n".join(points)


def _name(algorithm: str) -> str:
    return display_name(algorithm)


def _names(algorithms: Sequence[str]) -> str:
    return ", ".join(map(_name, algorithms)) or "none"


def _evaluations(comparison: Comparison) -> str:
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
    ratio = sources.ratio(sources.held_out, sources.choice, sources.asking_choice)
    return (
        f"- **With exact derivatives**, each counted for the dimension plus one evaluations: "
        f"**{_name(sources.asking_choice)}**. On {CHECKED_ON} {_name(sources.choice)} ends {ratio.text()} times as high"
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
            cells[name] += [_number(rows, name), shown]
    headings = ["algorithm", *(text for problem, *_, asking in winners for text in (problem, f"to {_name(asking)}"))]
    yield markdown_table(headings, [[_name(name), *each] for name, each in cells.items()], range(1, len(headings)))


def _derivative_winners(compared: Comparison) -> list[tuple[str, pd.DataFrame, str, str]]:
    """By problem: its rows by algorithm, and the least medians without and with derivatives."""
    found = []
    for problem, group in compared.table.groupby("problem", sort=False):
        rows = group.set_index("algorithm")
        asking = [name for name in rows.index if name in names_with_derivatives()]
        plain = [name for name in rows.index if name not in asking]
        found.append(
            (str(problem), rows, str(rows.loc[plain, "median"].idxmin()), str(rows.loc[asking, "median"].idxmin()))
        )
    return found


_BUDGET_HEADINGS = ["problem", "evaluations", "least median", "next", "next to least"]


def _budget_section(sources: Sources) -> Iterator[str]:
    yield "## How many evaluations?"
    compared = sources.budgets
    yield f"Without derivatives, {compared.repetitions} repetitions; every run is planned for its budget."
    rows = []
    for problem, budget, group in _budget_groups(compared):
        best, second = group.index[:2]
        ratio = quartile_ratio_text(group.loc[second], group.loc[best], compared.repetitions)
        rows.append([problem, f"{budget:,}", _median_text(group, best), _median_text(group, second), ratio])
    yield markdown_table(_BUDGET_HEADINGS, rows, (1,))
    compared = sources.derivative_budgets
    yield f"With and without derivatives, {compared.repetitions} repetitions."
    rows = []
    for problem, budget, group in _budget_groups(compared):
        asking = next(name for name in group.index if name in names_with_derivatives())
        plain = next(name for name in group.index if name not in names_with_derivatives())
        ratio = quartile_ratio_text(group.loc[plain], group.loc[asking], compared.repetitions)
        rows.append([problem, f"{budget:,}", _median_text(group, asking), _median_text(group, plain), ratio])
    yield markdown_table(["problem", "evaluations", "least with derivatives", "least without", "ratio"], rows, (1,))


def _budget_groups(compared: Comparison) -> Iterator[tuple[str, int, pd.DataFrame]]:
    """Problem, budget, and the rows by algorithm, the least median first."""
    for names, group in compared.with_budgets().groupby(["problem", "budget"], sort=False):
        problem, budget = np.atleast_1d(np.array(names, dtype=object))
        yield str(problem), int(budget), group.set_index("algorithm").sort_values("median", kind="stable")


def _median_text(group: pd.DataFrame, name: Any) -> str:
    return f"{_name(str(name))} {_number(group, name)}"


def _number(rows: pd.DataFrame, name: Any) -> str:
    return f"{float(rows['median'][name]):.3g}"


def _budget_sentence(sources: Sources) -> str:
    parts = []
    for problem in sources.budgets.table["problem"].unique():
        told = [
            f"{_median_text(group, group.index[0])} at {budget:,}"
            for name, budget, group in _budget_groups(sources.budgets)
            if name == problem
        ]
        parts.append(f"`{problem}`: {', '.join(told)}")
    return f"- **With more evaluations**, without derivatives, the least medians are: {'; '.join(parts)}."


def _space_rows(sources: Sources, problem: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows by algorithm of a problem in its coefficients and in the feasible search space."""
    table = sources.space.table.set_index("algorithm")
    return table[table["problem"] == problem], table[table["problem"] == f"{problem}{FEASIBLE_MARK}"]


def _space_ratio(sources: Sources, name: str) -> Ratio:
    rows = sources.space_duels[sources.space_duels["algorithm"] == name].set_index("problem")
    return mean_ratio(rows["median"], rows["median_in_space"], pd.Series(rows.index, rows.index))


def _space_sentence(sources: Sources) -> str:
    duels = sources.space_duels
    better, worse = (int((duels["better"] == side).sum()) for side in ("feasible", "coefficients"))
    winners = {text: _space_winners(sources, asking=asking) for text, asking in (("without", False), ("with", True))}
    told = "; ".join(f"{text} derivatives {winner}" for text, winner in winners.items())
    return (
        f"- **With a series in joint space, search the feasible space** (`search_space: feasible`): it is better in "
        f"{better} and worse in {worse} of {len(duels)} duels of an algorithm with itself. Best there, and how many "
        f"times as high the best in the coefficients ends: {told}."
    )


def _space_winners(sources: Sources, *, asking: bool) -> str:
    told = []
    for problem in sources.space_duels["problem"].unique():
        both = [
            rows[[(name in names_with_derivatives()) is asking for name in rows.index]]
            for rows in _space_rows(sources, problem)
        ]
        plain, space = (rows.loc[str(rows["median"].idxmin())] for rows in both)
        ratio = quartile_ratio_text(plain, space, sources.space.repetitions)
        told.append(f"`{problem}` {_name(str(space.name))}, {ratio}")
    return ", ".join(told)


def _space_section(sources: Sources) -> Iterator[str]:
    duels = sources.space_duels
    problems = [str(problem) for problem in duels["problem"].unique()]
    yield "## In the feasible search space"
    yield (
        f"Median in the space, and the ratio of the median in the coefficients to it; {sources.space.repetitions} "
        "repetitions of equal budget."
    )
    rows = []
    for name in [str(each) for each in duels["algorithm"].unique()]:
        cells = [_name(name), _space_ratio(sources, name).text()]
        for problem in problems:
            plain, space = _space_rows(sources, problem)
            ratio = quartile_ratio_text(plain.loc[name], space.loc[name], sources.space.repetitions)
            cells.append(f"{_number(space, name)}; {ratio}")
        rows.append(cells)
    yield markdown_table(["algorithm", "mean ratio", *problems], rows, range(1, len(problems) + 2))


def _tuning_ratio(sources: Sources, ours: str, theirs: str) -> Ratio:
    judged = sources.tuned.T
    return mean_ratio(judged[ours], judged[theirs], pd.Series(judged.index, judged.index))


def _tuning_pairs(sources: Sources) -> list[str]:
    return [name for name in sources.tuned.index if f"{name}{TUNED}" in sources.tuned.index]


def _tuning_sentence(sources: Sources) -> str:
    names = _tuning_pairs(sources)
    gains = {name: _tuning_ratio(sources, name, f"{name}{TUNED}") for name in names}
    helped = sorted((name for name in names if gains[name].low > 1), key=lambda name: -gains[name].value)
    told = ", ".join(f"{_name(name)} {gains[name].text()}" for name in helped)
    harmed = [name for name in names if gains[name].high < 1]
    return (
        f"- **Tuning** lowers the median on each of {sources.tuned.shape[1]} judging problems for {told or 'none'} "
        f"(published to tuned), and raises it on each for {_names(harmed)}; for the others it depends on the problem."
    )


def _tuning_section(sources: Sources) -> Iterator[str]:
    names = _tuning_pairs(sources)
    losses = sources.tuned.loc[[f"{name}{TUNED}" for name in names]].rank().mean(axis=1).sort_values(kind="stable")
    best = str(losses.index[0])
    yield "## Tuned against published"
    yield (
        f"{sources.tuned.shape[1]} judging problems that took no part in the tuning. Rank among the tuned ones, ratio "
        f"of published to tuned, and of tuned to the tuned {_name(best.removesuffix(TUNED))}."
    )
    rows = []
    for label in map(str, losses.index):
        name = label.removesuffix(TUNED)
        to_best = "1" if label == best else _tuning_ratio(sources, label, best).text()
        rows.append([_name(name), f"{losses[label]:.2f}", _tuning_ratio(sources, name, label).text(), to_best])
    headings = ["algorithm", "rank", "published to tuned", f"tuned to {_name(best.removesuffix(TUNED))}"]
    yield markdown_table(headings, rows, (1, 2, 3))


def _kinds(sources: Sources) -> Iterator[tuple[str, Comparison, Comparison]]:
    """Kinds of problems: form of the trajectory and joints, with the rows of both suites."""
    for (form, joints), rows in sources.features.groupby(["form", "joints"], sort=False):
        problems = list(rows["problem"])
        label = f"{FORMS[str(form)]} ({joints} joints)"
        yield label, sources.suite.of_problems(problems), sources.held_out.of_problems(problems)


def _kind_winner(comparison: Comparison) -> str:
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
