"""Table 3 once more, with every algorithm tuned: which claims of the paper hold then, and with which speed limit MuPSO
would win. Read from the judged runs of `armlab bench tune` and from the study of MuPSO's ingredients.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import kendalltau

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.markdown import markdown_table
from bench.printed import Printed, display_name
from bench.statistics import Summary, is_feasible, summarise
from bench.statistics.ends import quantile_interval
from bench.statistics.power import power_text
from bench.studies.best_known.records import record_key
from bench.studies.paper.claims import percent_change
from bench.studies.paper.claims_comparison import format_order, sort_by_figure
from bench.studies.paper.ranking import SUBJECT
from bench.studies.tuning.judged import TUNED, JudgedRuns, count_wins, duels_by_rival, read_judged_runs
from problem.registry import parse_problem

TITLE = "Table 3, tuned"
_INGREDIENTS = "study_mupso"
_SPEED_LIMITS = ("speed limit 0.1", "speed limit 0.25", SUBJECT, "speed limit 1", "no speed limit", "spso")
_STATISTICS = ("minimum", "average", "standard_deviation")


@dataclass(frozen=True, eq=False)
class TunedEvidence:
    """runs: of `armlab bench tune`. medians, duels: tables of the study of MuPSO's ingredients."""

    runs: JudgedRuns
    medians: pd.DataFrame
    duels: pd.DataFrame

    @property
    def problem(self) -> str:
        """The judging problem that is the one of Table 3."""
        wanted = record_key(parse_problem({"preset": "paper"}, "Table 3"))
        for name in self.runs.settings.judge:
            if record_key(parse_problem({"preset": name}, "tuning")) == wanted:
                return name
        raise InputError(f"'{self.runs.settings.name}' judges on no problem that is the one of Table 3, 'paper'")


def read_tuned_evidence(tuning: Path, study: Path) -> TunedEvidence:
    """From the folders of `armlab bench tune` and `armlab paper study`; raises InputError for a missing file."""
    tables = []
    for path in (study / f"{_INGREDIENTS}.csv", study / f"{_INGREDIENTS}_duels.csv"):
        try:
            tables.append(pd.read_csv(path))
        except (OSError, ValueError) as error:
            raise InputError(
                f"cannot read {path}, which `armlab paper study` writes: {error!s}".splitlines()[0]
            ) from None
    return TunedEvidence(read_judged_runs(tuning), *tables)


@dataclass(frozen=True)
class _Outcome:
    """What a claim becomes: our numbers, and whether it holds."""

    text: str
    holds: bool


Judge = Callable[[TunedEvidence, Printed, bool], _Outcome]


def tuned_section(evidence: TunedEvidence, paper: Printed) -> list[str]:
    """The section of the replication report."""
    outcomes = {
        says: [judge(evidence, paper, tuned) for tuned in (False, True)] for says, judge in _claims(paper).items()
    }
    rows = [[says, *_outcome_cells(published), *_outcome_cells(tuned)] for says, (published, tuned) in outcomes.items()]
    return [
        f"## {TITLE}",
        _effort_text(evidence),
        _verdict_text(evidence, outcomes),
        _table3(evidence),
        markdown_table(["the paper says", "as published", "", "all tuned", ""], rows),
        f"Tuned MuPSO against every other tuned algorithm: {_READING_OF_DUELS} {_power(evidence)}",
        duels_by_rival(evidence.runs.subject_duels(tuned=True)),
        *_speed_limit_parts(evidence),
    ]


_READING_OF_DUELS = """\
chance that it ends better (A12) with its 95 % interval; `+` better, `-` worse (paired Wilcoxon on log10, 5 % after Holm
within the problem)."""


def _effort_text(evidence: TunedEvidence) -> str:
    settings = evidence.runs.settings
    return (
        f"Every algorithm got the same tuning budget, {settings.configurations} configurations on "
        f"{len(settings.train)} training problems, the published one the first. Judged on {len(settings.judge)} "
        f"problems that took no part, one of them that of Table 3, with {settings.judge_repetitions} paired runs of "
        f"{settings.evaluations:,} evaluations. Ranges, training problems and what was found: `results/tune/tune.md`."
    )


def _power(evidence: TunedEvidence) -> str:
    settings = evidence.runs.settings
    return power_text(settings.judge_repetitions, len(settings.algorithms) - 1) + "."


def _table3(evidence: TunedEvidence) -> str:
    """Minimum, average, deviation and median on the problem of Table 3, as published and as tuned."""
    rows = []
    for name in evidence.runs.settings.algorithms:
        cells = [_summary_cells(evidence, name + TUNED * tuned) for tuned in (False, True)]
        rows.append([display_name(name), *cells[0], *cells[1]])
    headings = ["minimum", "average", "standard deviation", "median (95 %)"]
    return markdown_table(["Table 3", *headings, *(f"tuned: {heading}" for heading in headings)], rows)


def _summary_cells(evidence: TunedEvidence, label: str) -> Iterator[str]:
    found = _summaries(evidence, evidence.problem)[label]
    yield from (f"{getattr(found, statistic):.3g}" for statistic in _STATISTICS)
    low, high = quantile_interval(_ends(evidence, evidence.problem, label))
    yield f"{found.median:.3g} ({low:.3g}-{high:.3g})"


def _ends(evidence: TunedEvidence, problem: str, label: str) -> Array:
    rows = evidence.runs.of([label])
    rows = rows[rows["problem"] == problem]
    return np.where(is_feasible(rows["value"].to_numpy(), rows["violation"].to_numpy()), rows["value"], np.inf)


def _summaries(evidence: TunedEvidence, problem: str) -> dict[str, Summary]:
    """By label."""
    rows = evidence.runs.frame[evidence.runs.frame["problem"] == problem]
    return {
        str(label): summarise(group["value"].to_numpy(), group["violation"].to_numpy())
        for label, group in rows.groupby("algorithm", sort=False)
    }


def _column(evidence: TunedEvidence, statistic: str, tuned: bool) -> dict[str, float]:
    """A statistic on the problem of Table 3, by algorithm."""
    found = _summaries(evidence, evidence.problem)
    return {name: getattr(found[name + TUNED * tuned], statistic) for name in evidence.runs.settings.algorithms}


def _claims(paper: Printed) -> dict[str, Judge]:
    low, high = paper.conclusion.gain_percent
    ranked = {
        f"ranking by {statistic.replace('_', ' ')}: {format_order(_printed_order(paper, statistic))}": _order_judge(
            statistic
        )
        for statistic in _STATISTICS
    }
    return {
        "MuPSO 'best minimized the problem'": _least_judge("minimum"),
        "MuPSO 'produced better averages'": _least_judge("average"),
        "MuPSO 'dominated other algorithms'": _judge_dominance,
        **ranked,
        f"({low}-{high}) % gain in the minimum solution against the others": _judge_gains,
    }


def _least_judge(statistic: str) -> Judge:
    def judge(evidence: TunedEvidence, paper: Printed, tuned: bool) -> _Outcome:
        column = _column(evidence, statistic, tuned)
        rank = sort_by_figure(column).index(SUBJECT) + 1
        return _Outcome(f"{statistic} {column[SUBJECT]:.3g}, rank {rank} of {len(column)}", rank == 1)

    return judge


def _judge_dominance(evidence: TunedEvidence, paper: Printed, tuned: bool) -> _Outcome:
    """The rule that judges the claim as published: better in most duels, worse in none."""
    won, lost, fought = count_wins(evidence.runs.subject_duels(tuned=tuned), SUBJECT + TUNED * tuned)
    text = f"better in {won}, worse in {lost} of {fought} duels on {len(evidence.runs.settings.judge)} problems"
    return _Outcome(text, won > fought / 2 and lost == 0)


def _order_judge(statistic: str) -> Judge:
    def judge(evidence: TunedEvidence, paper: Printed, tuned: bool) -> _Outcome:
        printed, ours = _printed_order(paper, statistic), sort_by_figure(_column(evidence, statistic, tuned))
        places = [[order.index(name) for name in sorted(printed)] for order in (printed, ours)]
        return _Outcome(f"{format_order(ours)}; Kendall's tau {kendalltau(*places).statistic:.2f}", printed == ours)

    return judge


def _judge_gains(evidence: TunedEvidence, paper: Printed, tuned: bool) -> _Outcome:
    """Holds if the gain against every other algorithm is at least the least that the paper claims."""
    column = _column(evidence, "minimum", tuned)
    gains = [percent_change(value, column[SUBJECT]) for name, value in column.items() if name != SUBJECT]
    return _Outcome(f"{min(gains):.1f} to {max(gains):.1f} %", min(gains) >= paper.conclusion.gain_percent[0])


def _printed_order(paper: Printed, statistic: str) -> list[str]:
    return sort_by_figure({name: getattr(row, statistic) for name, row in paper.table3.rows.items()})


def _outcome_cells(outcome: _Outcome) -> tuple[str, str]:
    return outcome.text, "holds" if outcome.holds else "does not hold"


def _verdict_text(evidence: TunedEvidence, outcomes: Mapping[str, list[_Outcome]]) -> str:
    runs = evidence.runs
    counts = [sum(found[tuned].holds for found in outcomes.values()) for tuned in (False, True)]
    ranks = runs.ranking(runs.labels(tuned=True)).ranks
    place = list(ranks).index(SUBJECT + TUNED) + 1
    won, lost, fought = count_wins(runs.subject_duels(tuned=True), SUBJECT + TUNED)
    return (
        f"**Verdict.** Of {len(outcomes)} claims about the comparison, {counts[False]} hold as published and "
        f"{counts[True]} when everybody is tuned. Tuned, MuPSO has place {place} of {len(ranks)} by average rank "
        f"({ranks[SUBJECT + TUNED]:.2f}); it is better in {won} and worse in {lost} of {fought} duels. "
        f"{_speed_limit_sentence(evidence)}"
    )


@dataclass(frozen=True)
class _LimitStanding:
    """MuPSO with one speed limit among the others: place by average rank, and duels won, lost, fought."""

    value: float
    place: int
    rank: float
    duels: tuple[int, int, int]

    @property
    def wins(self) -> bool:
        """First by average rank, and better in most duels, worse in none: the rule of 'dominated'."""
        won, lost, fought = self.duels
        return self.place == 1 and won > fought / 2 and lost == 0

    def cell(self) -> str:
        won, lost, fought = self.duels
        return f"place {self.place} ({self.rank:.2f}), better in {won}, worse in {lost} of {fought}"


def _limit_standings(runs: JudgedRuns, *, tuned: bool) -> list[_LimitStanding]:
    """One a speed limit of the sweep, the others as published or as tuned."""
    others, found = runs.labels(tuned=tuned, without=SUBJECT), runs.sweep_duels(tuned=tuned)
    standings = []
    for value, label in runs.sweep_labels.items():
        ranks = runs.ranking([label, *others]).ranks
        standings.append(_LimitStanding(value, list(ranks).index(label) + 1, ranks[label], count_wins(found, label)))
    return standings


def _speed_limit_sentence(evidence: TunedEvidence) -> str:
    texts = []
    for tuned, of_whom in ((False, "the others as published"), (True, "the others tuned")):
        standings = _limit_standings(evidence.runs, tuned=tuned)
        winners = [f"{one.value:g}" for one in standings if one.wins]
        best = min(standings, key=lambda one: one.rank)
        nearest = f"the best limit, {best.value:g}, has {best.cell()}"
        texts.append(f"against {of_whom} it wins with {', '.join(winners) or 'none'} ({nearest})")
    limits = ", ".join(f"{value:g}" for value in evidence.runs.sweep_labels)
    return (
        f"With its speed limit alone changed ({limits} of the box width), {'; '.join(texts)}. To win: the first place "
        "by average rank, better in most duels and worse in none."
    )


def _speed_limit_parts(evidence: TunedEvidence) -> Iterator[str]:
    published, tuned = (_limit_standings(evidence.runs, tuned=tuned) for tuned in (False, True))
    yield (
        "MuPSO with another speed limit, all else as published, among the other five: place by average rank over the "
        "judging problems, and duels (Holm over all limits and rivals within a problem). The limit is read off the "
        "problems that judge it, so a win would be an upper bound."
    )
    yield markdown_table(
        ["speed limit", "others as published", "others tuned"],
        ([f"{one.value:g}", one.cell(), other.cell()] for one, other in zip(published, tuned, strict=True)),
    )
    repetitions = evidence.runs.settings.judge_repetitions
    yield power_text(repetitions, len(evidence.runs.sweep_labels) * (len(evidence.runs.settings.algorithms) - 1)) + "."
    yield (
        "The same on the problems of the study (`results/study/study.md`): median, and in brackets the chance to end "
        "better than MuPSO as published, with its 95 % interval."
    )
    yield _ingredients_table(evidence)


def _ingredients_table(evidence: TunedEvidence) -> str:
    cells = evidence.medians.drop_duplicates(["problem", "evaluations"])[["problem", "evaluations"]].to_numpy().tolist()
    rows = [
        [display_name(label), *(_ingredient_cell(evidence, label, problem, budget) for problem, budget in cells)]
        for label in _SPEED_LIMITS
    ]
    return markdown_table(["MuPSO with", *(f"{problem}, {budget:,.0f}" for problem, budget in cells)], rows)


def _ingredient_cell(evidence: TunedEvidence, label: str, problem: str, budget: float) -> str:
    medians = evidence.medians.query("algorithm == @label and problem == @problem and evaluations == @budget")
    duels = evidence.duels.query("subject == @label and problem == @problem and budget == @budget")
    effect = "".join(f" ({row.superiority:.2f}, {row.low:.2f}-{row.high:.2f})" for row in duels.itertuples())
    return f"{medians['median'].item():.3g}{effect}"
