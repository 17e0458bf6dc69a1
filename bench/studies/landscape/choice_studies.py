"""Parts of the page about the choice that come from the studies of budgets, search space and tuning."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from algorithms.registry import names_with_derivatives
from algorithms.sqp import SPSOThenSQPParams
from armlab.common.markdown import markdown_table
from bench.printed import display_name
from bench.studies.landscape.ratios import Ratio, mean_ratio, quartile_ratio_text
from bench.studies.landscape.sources import Sources, SummaryTable
from bench.studies.search_space.search_space_study import FEASIBLE_MARK
from bench.studies.tuning.judged import TUNED

_BUDGET_HEADINGS = ["problem", "evaluations", "least median", "next", "next to least"]


def budget_sentence(sources: Sources) -> str:
    """The least median without derivatives at each budget."""
    parts = []
    for problem in sources.budgets.table["problem"].unique():
        told = [
            f"{_median_text(group, group.index[0])} at {budget:,}"
            for name, budget, group in _budget_groups(sources.budgets)
            if name == problem
        ]
        parts.append(f"`{problem}`: {', '.join(told)}")
    return f"- **With more evaluations**, without derivatives, the least medians are: {'; '.join(parts)}."


def budget_section(sources: Sources) -> Iterator[str]:
    """Medians against the budget, with and without derivatives."""
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


def time_sentence(sources: Sources) -> str:
    """At equal time, the least median with derivatives beside the least without."""
    told = [
        f"`{row.problem}`, the time of {row.work:,.0f} evaluations: {row.asking} against {row.plain}"
        for row in _time_rows(sources)
    ]
    return f"- **In equal time of one core**, with derivatives against without: {'; '.join(told)}."


def time_section(sources: Sources) -> Iterator[str]:
    """With and without derivatives at equal time, whose unit is an evaluation in a population."""
    yield "## In equal time"
    yield (
        "Time is counted in a fixed unit, an evaluation of the same problem in a population, so that any machine can "
        "repeat it. A point with derivatives takes as long as "
        + ", ".join(f"{price['in_population']:.0f} evaluations on `{name}`" for name, price in sources.prices.items())
        + " (`results/speed/speed.md`), and counts as "
        + ", ".join(f"{price['stated']:.0f}" for price in sources.prices.values())
        + " in the budgets above; `spso-sqp` asks for none in the first half of its budget. Without derivatives: "
        "the budget nearest to that time. The time of the solvers themselves is left out."
    )
    headings = [
        "problem",
        "evaluations",
        "as counted in time",
        "least with derivatives",
        "without, at",
        "least",
        "ratio",
    ]
    rows = [
        [row.problem, f"{row.budget:,}", f"{row.work:,.0f}", row.asking, f"{row.plain_budget:,}", row.plain, row.ratio]
        for row in _time_rows(sources)
    ]
    yield markdown_table(headings, rows, (1, 2, 4))


class _TimeRow(NamedTuple):
    """A budget with derivatives, its work in evaluations of a population, and the best without in that time."""

    problem: str
    budget: int
    work: float
    asking: str
    plain_budget: int
    plain: str
    ratio: str


def _time_rows(sources: Sources) -> Iterator[_TimeRow]:
    plain = {(name, budget): group for name, budget, group in _budget_groups(sources.budgets)}
    for problem, budget, group in _budget_groups(sources.derivative_budgets):
        price = sources.prices.get(problem)
        budgets = [known for name, known in plain if name == problem]
        if price is None or not budgets:
            continue
        asking = str(next(name for name in group.index if name in names_with_derivatives()))
        plain_share = SPSOThenSQPParams().swarm_share if asking == "spso-sqp" else 0.0
        work = budget * (plain_share + (1 - plain_share) * price["in_population"] / price["stated"])
        nearest = budgets[int(np.argmin(np.abs(np.log(np.array(budgets) / work))))]
        rival = plain[problem, nearest]
        best = rival.index[0]
        ratio = f"{rival.loc[best, 'median'] / group.loc[asking, 'median']:.2f}"
        yield _TimeRow(problem, budget, work, _median_text(group, asking), nearest, _median_text(rival, best), ratio)


def _budget_groups(compared: SummaryTable) -> Iterator[tuple[str, int, pd.DataFrame]]:
    """Problem, budget, and the rows by algorithm, the least median first."""
    for names, group in compared.with_budgets().groupby(["problem", "budget"], sort=False):
        problem, budget = np.atleast_1d(np.array(names, dtype=object))
        yield str(problem), int(budget), group.set_index("algorithm").sort_values("median", kind="stable")


def _median_text(group: pd.DataFrame, name: Any) -> str:
    return f"{display_name(str(name))} {median_number(group, name)}"


def space_sentence(sources: Sources) -> str:
    """What the feasible search space is worth, and the best in it."""
    duels = sources.space_duels
    better, worse = (int((duels["better"] == side).sum()) for side in ("feasible", "coefficients"))
    told = []
    for asking in (False, True):
        outside, inside = (_least_by_problem(sources, asking=asking, feasible=each) for each in (False, True))
        found = ", ".join(dict.fromkeys(display_name(str(row.name)) for row in inside.values()))
        told.append(f"{'with' if asking else 'without'} derivatives {found}, {_mean_of_rows(outside, inside).text()}")
    plain, with_derivatives = (_least_by_problem(sources, asking=asking, feasible=True) for asking in (False, True))
    return (
        f"- **With a series in joint space, search the feasible space** (`search_space: feasible`): it is better in "
        f"{better} and worse in {worse} of {len(duels)} duels of an algorithm with itself. The best there, and how "
        f"many times as high the best in the coefficients ends: {'; '.join(told)}. In the space the best without "
        f"derivatives ends {_mean_of_rows(plain, with_derivatives).text()} times as high as the best with them."
    )


def _least_by_problem(sources: Sources, *, asking: bool, feasible: bool) -> dict[str, Any]:
    """By problem the row with the least median, in the feasible search space or in the coefficients."""
    problems = [str(problem) for problem in sources.space_duels["problem"].unique()]
    return {name: least_row(_space_rows(sources, name)[feasible], asking=asking) for name in problems}


def _mean_of_rows(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> Ratio:
    one, other = (pd.Series({name: float(row["median"]) for name, row in rows.items()}) for rows in (ours, theirs))
    return mean_ratio(one, other, pd.Series(list(ours), list(ours)))


def _space_rows(sources: Sources, problem: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Rows by algorithm of a problem in its coefficients and in the feasible search space."""
    table = sources.space.table.set_index("algorithm")
    return table[table["problem"] == problem], table[table["problem"] == f"{problem}{FEASIBLE_MARK}"]


def _space_ratio(sources: Sources, name: str) -> Ratio:
    rows = sources.space_duels[sources.space_duels["algorithm"] == name].set_index("problem")
    return mean_ratio(rows["median"], rows["median_in_space"], pd.Series(rows.index, rows.index))


def space_section(sources: Sources) -> Iterator[str]:
    """Every algorithm in both search spaces, and the best of each."""
    duels = sources.space_duels
    problems = [str(problem) for problem in duels["problem"].unique()]
    yield "## In the feasible search space"
    yield (
        f"Median in the space, and the ratio of the median in the coefficients to it; {sources.space.repetitions} "
        "repetitions of equal budget."
    )
    rows = []
    for name in [str(each) for each in duels["algorithm"].unique()]:
        cells = [display_name(name), _space_ratio(sources, name).text()]
        for problem in problems:
            plain, space = _space_rows(sources, problem)
            ratio = quartile_ratio_text(plain.loc[name], space.loc[name], sources.space.repetitions)
            cells.append(f"{median_number(space, name)}; {ratio}")
        rows.append(cells)
    yield markdown_table(["algorithm", "mean ratio", *problems], rows, range(1, len(problems) + 2))
    yield (
        "The best algorithm on each problem in the feasible space, without and with derivatives. *ratio*: the best in "
        "the coefficients divided by it. *without to with*: the best without derivatives divided by the best with "
        "them, both in the feasible space."
    )
    winners = {
        (asking, feasible): _least_by_problem(sources, asking=asking, feasible=feasible)
        for asking in (False, True)
        for feasible in (False, True)
    }
    rows = []
    for problem in problems:
        cells = [problem]
        for asking in (False, True):
            inside, outside = (winners[asking, feasible][problem] for feasible in (True, False))
            ratio = quartile_ratio_text(outside, inside, sources.space.repetitions)
            cells += [f"{display_name(str(inside.name))} {inside['median']:.3g}", ratio]
        plain, with_derivatives = (winners[asking, True][problem] for asking in (False, True))
        rows.append([*cells, quartile_ratio_text(plain, with_derivatives, sources.space.repetitions)])
    yield markdown_table(
        ["problem", "without derivatives", "ratio", "with derivatives", "ratio", "without to with"], rows
    )


def tuning_sentence(sources: Sources) -> str:
    """For whom tuning helps on each judging problem."""
    names = _tuning_pairs(sources)
    gains = {name: _tuning_ratio(sources, name, f"{name}{TUNED}") for name in names}
    helped = sorted((name for name in names if gains[name].low > 1), key=lambda name: -gains[name].value)
    told = ", ".join(f"{display_name(name)} {gains[name].text()}" for name in helped)
    harmed = ", ".join(display_name(name) for name in names if gains[name].high < 1)
    return (
        f"- **Tuning** lowers the median on each of {sources.tuned.shape[1]} judging problems for {told or 'none'} "
        f"(published to tuned), and raises it on each for {harmed or 'none'}; for the others it depends on the problem."
    )


def tuning_section(sources: Sources) -> Iterator[str]:
    """Every algorithm as published and as tuned."""
    names = _tuning_pairs(sources)
    losses = sources.tuned.loc[[f"{name}{TUNED}" for name in names]].rank().mean(axis=1).sort_values(kind="stable")
    best = str(losses.index[0])
    yield "## Tuned against published"
    yield (
        f"{sources.tuned.shape[1]} judging problems that took no part in the tuning. Rank among the tuned ones, ratio "
        f"of published to tuned, and of tuned to the tuned {display_name(best.removesuffix(TUNED))}."
    )
    rows = []
    for label in map(str, losses.index):
        name = label.removesuffix(TUNED)
        to_best = "1" if label == best else _tuning_ratio(sources, label, best).text()
        rows.append([display_name(name), f"{losses[label]:.2f}", _tuning_ratio(sources, name, label).text(), to_best])
    headings = ["algorithm", "rank", "published to tuned", f"tuned to {display_name(best.removesuffix(TUNED))}"]
    yield markdown_table(headings, rows, (1, 2, 3))


def _tuning_pairs(sources: Sources) -> list[str]:
    return [name for name in sources.tuned.index if f"{name}{TUNED}" in sources.tuned.index]


def _tuning_ratio(sources: Sources, ours: str, theirs: str) -> Ratio:
    judged = sources.tuned.T
    return mean_ratio(judged[ours], judged[theirs], pd.Series(judged.index, judged.index))


def least_row(rows: pd.DataFrame, *, asking: bool) -> Any:
    """The row with the least median of the algorithms that ask for derivatives, or of the others."""
    chosen = rows[[(name in names_with_derivatives()) is asking for name in rows.index]]
    return chosen.loc[str(chosen["median"].idxmin())]


def median_number(rows: pd.DataFrame, name: Any) -> str:
    """The median of an algorithm, for a cell of a table."""
    return f"{float(rows['median'][name]):.3g}"
