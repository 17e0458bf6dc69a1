"""The tables and sentences of the report about results."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import yaml

from algorithms.registry import BrokenAlgorithmError, UnknownAlgorithmError, is_our_code, load
from armlab.common.report.page import Table
from armlab.common.report.wording import count_of
from bench.fingerprint import calls_lapack
from bench.report.analysis import BUDGET_SHARES, TARGET_SHARES, ProblemAnalysis
from bench.result_sets.result_set import ResultSet
from bench.statistics.critical_difference import ERROR_RATE, CriticalDifference
from bench.statistics.pairwise import Duel
from bench.statistics.power import Power, powers, smallest_detectable_effect
from bench.statistics.rating import Rating, rate_algorithms
from bench.studies import properties as properties_table
from bench.studies.properties import AlgorithmProperties


def ends_table(cell: ProblemAnalysis) -> Table:
    """Medians with intervals, quartiles, feasible share, area and expected running times on one problem."""
    places = [round(share * (len(cell.targets) - 1)) for share in TARGET_SHARES] if len(cell.targets) else []
    headings = ["algorithm", "median (95 %)", "quartiles", "minimum", "feasible", "area"]
    headings += ["s a run", "work"] if "seconds" in cell.trials else []
    headings += [f"ERT to {cell.targets[place]:.3g}" for place in places]
    return Table(headings, [_ends_row(cell, name, places) for name in cell.algorithms])


def _ends_row(cell: ProblemAnalysis, name: str, places: Sequence[int]) -> list[str]:
    summary, progress = cell.summary(name), cell.progress[name]
    low, high = cell.median_interval(name)
    return [
        name,
        f"{format_number(summary.median)} ({format_number(low)} – {format_number(high)})",
        f"{format_number(summary.lower_quartile)} – {format_number(summary.upper_quartile)}",
        format_number(summary.minimum),
        f"{summary.feasible_share:.0%}",
        "–" if np.isnan(progress.area) else f"{progress.area:.2f}",
        *_time_cells(cell, name),
        *(format_number(progress.expected[place]) for place in places),
    ]


def _time_cells(cell: ProblemAnalysis, name: str) -> list[str]:
    """Median seconds of a run, and its work an evaluation."""
    if "seconds" not in cell.trials:
        return []
    rows = cell.trials[cell.trials["algorithm"] == name]
    return [format_number(float(rows["seconds"].median())), format_number(cell.work(name))]


def duels_table(cell: ProblemAnalysis) -> Table:
    """The algorithm with the least median against all others."""
    best = min(cell.algorithms, key=lambda name: float(np.median(cell.losses[name])))
    fought = [_duel_from_side_of(best, duel) for duel in cell.all_duels if best in (duel.subject, duel.rival)]
    rows = [[duel.rival, _format_effect(duel), f"{duel.p:.2g}", _duel_outcome(duel)] for duel in fought]
    return Table([f"{best} against", "A12 (95 %)", "p (Holm)", f"{best} is"], rows)


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


def tally_table(cells: Sequence[ProblemAnalysis], algorithms: Sequence[str]) -> Table:
    """On how many problems an algorithm (row) is better and worse than another (column)."""
    won: dict[tuple[str, str], int] = {}
    for duel in (duel for cell in cells for duel in cell.all_duels):
        winner = duel.winner()
        if winner is not None:
            loser = duel.rival if winner == duel.subject else duel.subject
            won[winner, loser] = won.get((winner, loser), 0) + 1
    rows = [[name, *(_tally_cell(won, name, other) for other in algorithms)] for name in algorithms]
    return Table(["better – worse", *algorithms], rows)


def _tally_cell(won: dict[tuple[str, str], int], name: str, other: str) -> str:
    return "" if name == other else f"{won.get((name, other), 0)} – {won.get((other, name), 0)}"


def power_table(powers: Sequence[Power], repetitions: int, comparisons: int) -> Table:
    """The effects that the test can detect on one problem."""
    names = ("small", "medium", "large")
    rows = [
        [f"{name}, A12 = {power.superiority:.2f}", f"{power.alone:.0%}", f"{power.first_step:.0%}"]
        for name, power in zip(names, powers, strict=True)
    ]
    seen = [smallest_detectable_effect(repetitions, 0.05 / count) for count in (1, comparisons)]
    rows.append(["A12 seen with 80 %", *("none" if effect is None else f"{effect:.2f}" for effect in seen)])
    return Table(["true effect", "one comparison", f"first of {comparisons} (Holm)"], rows)


def format_number(value: float) -> str:
    """A number with three digits; signs for infinite and unknown."""
    if np.isnan(value):
        return "–"
    if np.isinf(value):
        return "∞"
    return f"{value:.0f}" if 1000 <= value < 1e6 else f"{value:.3g}"


@dataclass(frozen=True)
class TextAndTable:
    """A table with the text that stands above it."""

    text: str
    table: Table


@dataclass(frozen=True)
class ProblemPart:
    """The tables of one problem."""

    label: str
    ends: Table
    duels: Table


@dataclass(frozen=True)
class Origin:
    """Provenance, settings, and the commands that repeat the results."""

    text: str
    steps: str
    table: Table
    settings: str


def count_sentence(results: ResultSet, cells: Sequence[ProblemAnalysis]) -> str:
    """What was compared, and what of it failed or is missing."""
    trials = results.trials
    problems, sizes = trials["problem"].nunique(), trials["swarm_size"].nunique()
    budgets = int(trials.groupby("swarm_size")["budget"].nunique().max())  # which may follow the size
    counts = [
        count_of(problems, "problem"),
        *([count_of(sizes, "swarm size")] if sizes > 1 else []),
        *([count_of(budgets, "budget")] if budgets > 1 else []),
        count_of(trials["algorithm"].nunique(), "algorithm"),
        count_of(trials["repetition"].nunique(), "repetition"),
        count_of(len(trials), "run"),
    ]
    sweep = "A setting is a problem with a swarm size and a budget." if len(cells) > problems else ""
    return " ".join(filter(None, [f"{', '.join(counts)}.", sweep, *(f"{gap}." for gap in results.gaps)]))


MAX_NAMED_PROBLEMS = 6  # of which the headline names the winners one by one


def headline(cells: Sequence[ProblemAnalysis], within: CriticalDifference, over: CriticalDifference) -> tuple[str, str]:
    """Who has the best average rank on these problems, whom it beats and with whom it ties; then who beats whom, on
    each problem where they are few; and what holds for problems of this kind. within: from the paired runs. over: from
    the medians of the problems. Where the runs are too few for a test over all problems together, each problem has its
    own.
    """
    best, *others = within.ranks
    if not others:
        return f"{best} is the only algorithm: nothing was compared.", ""
    equal = [name for name in others if np.isclose(within.ranks[name], within.ranks[best])]
    leads = f"{join_words([best, *equal])} share" if equal else f"{best} has"
    first = f"{leads} the best average rank, {within.ranks[best]:.2f} of {len(within.ranks)}"
    if within.has_too_few_blocks and len(cells) > 1:
        first = f"{first}; {_count_wins(best, best if equal else 'it', cells)}."
    elif within.has_too_few_blocks:
        first = f"{first}; {within.blocks} repetitions are too few to tell any pair apart."
    else:
        first = f"{first}: {best if equal else 'it'} {_wins_and_ties(best, within)}."
    if len(cells) == 1:
        return first, "" if within.has_too_few_blocks else _rest_sentence(within)
    parts = []
    if len(cells) <= MAX_NAMED_PROBLEMS and not all(cell.ranking.has_too_few_blocks for cell in cells):
        parts = [f"On {cell.label}: {_winners_on(cell)}." for cell in cells]
    elif not within.has_too_few_blocks:
        parts = [_rest_sentence(within)]
    return first, " ".join(filter(None, [*parts, _generalisation(over)]))


def _count_wins(best: str, subject: str, cells: Sequence[ProblemAnalysis]) -> str:
    """On how many problems each other one is beaten, by the tests of each problem. subject: the best, in words."""
    if all(cell.ranking.has_too_few_blocks for cell in cells):
        least = min(cell.ranking.blocks for cell in cells)
        return f"{least} repetitions are too few to tell any pair apart on any of them"
    others = [name for name in cells[0].algorithms if name != best]
    counts = {name: sum(name in _beaten_by(best, cell.ranking) for cell in cells) for name in others}
    told = [f"{name} on {count}" for name, count in counts.items() if count]
    beaten = join_words(told) if told else "no other on any"
    return f"tested one by one, {subject} beats {beaten} of {len(cells)}"


def _wins_and_ties(best: str, found: CriticalDifference) -> str:
    beaten = _beaten_by(best, found)
    ties = [name for name in found.ranks if name != best and name not in beaten]
    parts = [f"beats {join_words(beaten)}"] if beaten else []
    parts += [f"ties with {join_words(ties)}"] if ties else []
    return " and ".join(parts)


def _winners_on(cell: ProblemAnalysis) -> str:
    """Who beats whom on one problem."""
    found = cell.ranking
    if found.has_too_few_blocks:
        return f"{found.blocks} repetitions are too few to tell any pair apart"
    wins = [
        f"{name} beats {join_words(beaten)} ({_largest_p(name, beaten, found)})"
        for name in found.ranks
        if (beaten := _beaten_by(name, found))
    ]
    return "; ".join(wins) or "no two are told apart"


def _largest_p(name: str, beaten: Sequence[str], found: CriticalDifference) -> str:
    """`p = 9e-07`, or the largest of several, after Holm's correction over the pairs of the problem."""
    largest = max(found.p[name, other] for other in beaten)
    return f"p {'=' if len(beaten) == 1 else 'at most'} {largest:.1g}"


def _rest_sentence(found: CriticalDifference) -> str:
    """Who of the others beats whom, and how many pairs tie."""
    others = list(found.ranks)[1:]
    wins = [f"{name} beats {join_words(_beaten_by(name, found))}" for name in others if _beaten_by(name, found)]
    tied = sum(p > ERROR_RATE for p in found.p.values())
    rest = f"{tied} of {len(found.p)} pairs tie: no difference was shown." if tied else ""
    return " ".join(filter(None, [f"{'; '.join(wins)}." if wins else "", rest]))


def _generalisation(over: CriticalDifference) -> str:
    """What the problems say as a sample of others like them."""
    if over.blocks == 1:
        return ""
    if over.has_too_few_blocks:
        return f"Nothing follows for other problems like them: {over.blocks} are too few."
    best = next(iter(over.ranks))
    return f"As a sample of others like them: {best} {_wins_and_ties(best, over)}."


def _beaten_by(name: str, found: CriticalDifference) -> list[str]:
    """The algorithms of a worse average rank that differ significantly."""
    names = list(found.ranks)
    return [other for other in names[names.index(name) + 1 :] if found.p[name, other] <= ERROR_RATE]


def join_words(names: Sequence[str]) -> str:
    """a, b and c."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def ranking_text(within: CriticalDifference, cells: Sequence[ProblemAnalysis]) -> str:
    """How the ranks of paired runs were compared."""
    noun = "problem" if len({cell.problem for cell in cells}) == len(cells) else "setting"
    problems = "" if len(cells) == 1 else f" of {len(cells)} {noun}s"
    told = "" if len(cells) == 1 else f", on at least one {noun} and on none the other way round"
    text = (
        f"Average ranks over the paired repetitions{problems}, 1 the best. A bar joins algorithms that cannot be told "
        f"apart: Wilcoxon's signed-rank test of every pair{told}, Holm's correction over all {within.tests}, 5 %."
    )
    if within.has_too_few_blocks and len(cells) > 1:
        text += f" After so many tests {within.blocks} repetitions tell no pair apart: see each {noun} below."
    return text


def generalisation_text(over: CriticalDifference) -> str:
    """How the ranks of medians over problems were compared."""
    text = (
        f"Average ranks of the medians of {over.blocks} problems: what may be expected of others like them. "
        f"Holm's correction over {count_of(over.tests, 'pair')}, 5 %."
    )
    if not np.isnan(over.friedman_p):
        text += f" Friedman's test that all are equal: p = {over.friedman_p:.2g}."
    return f"{text} So few problems cannot tell any pair apart." if over.has_too_few_blocks else text


def rating_part(cells: Sequence[ProblemAnalysis]) -> TextAndTable:
    """Ratings for fixed budgets and for fixed targets, with intervals; best at the whole budget first."""
    views = [
        (f"{share:.0%} of the budget", [cell.fixed_budget[k] for cell in cells])
        for k, share in enumerate(BUDGET_SHARES)
    ]
    reached = [cell for cell in cells if len(cell.targets)]
    if reached:
        views += [
            (f"target at {share:.0%}", [cell.fixed_target[k] for cell in reached])
            for k, share in enumerate(TARGET_SHARES)
        ]
    rated = [(heading, rate_algorithms(losses)) for heading, losses in views]
    order = next((list(found) for _, found in reversed(rated[: len(BUDGET_SHARES)]) if found), cells[0].algorithms)
    rows = [[name, *(_rating_cell(found.get(name)) for _, found in rated)] for name in order]
    text = (
        "Fixed budget: who has the smallest best value after a share of the evaluations. Fixed target: who reaches a "
        "value first, a share of the way from the worst first feasible value to the best of all, in the logarithm. "
        "Each repetition of each problem is a game between every two algorithms, ties counting half; the ratings of "
        "Bradley and Terry 1952 stand on Elo's scale (1500 on average, 400 points for odds of ten to one), with 95 % "
        "bootstrap intervals over the repetitions. They hold for these problems and algorithms."
    )
    return TextAndTable(text, Table(["algorithm", *(heading for heading, _ in rated)], rows))


def _rating_cell(rating: Rating | None) -> str:
    return "–" if rating is None else f"{rating.value:.0f} ({rating.low:.0f} – {rating.high:.0f})"


def power_part(cells: Sequence[ProblemAnalysis]) -> TextAndTable:
    """The effects that the paired test can detect with this number of repetitions."""
    repetitions = min(cell.repetitions for cell in cells)
    count = max(len(cells[0].all_duels), 1)
    text = (
        f"Chance to see a true difference on one problem with {repetitions} repetitions, by simulation of uncorrelated "
        "pairs. With Holm's correction it lies between the two columns."
    )
    return TextAndTable(text, power_table(powers(repetitions, count), repetitions, count))


def properties_part(facts: Sequence[AlgorithmProperties]) -> TextAndTable | None:
    """The behaviour of each algorithm on a problem that is shifted, scaled or pure noise; None without algorithms."""
    if not facts:
        return None
    headings, rows = properties_table.PROPERTY_HEADINGS, properties_table.property_rows(facts)
    return TextAndTable(properties_table.PROPERTY_READING, Table(headings, rows, (len(headings) - 1,)))


def origin_part(results: ResultSet) -> Origin:
    """Provenance, settings, and the commands that repeat the results."""
    rows = [[key, *(str(origin.get(key, "–")) for origin in results.origins)] for key in _origin_keys(results)]
    machines = range(1, len(results.origins) + 1)
    headings = ["", *(f"machine {k}" for k in machines)]
    settings = yaml.safe_load(results.settings)
    text = (
        f"Seed {settings['seed']}. With the same versions on the same kind of processor (kernels of BLAS and SIMD "
        "level as below) the same configuration gives the same numbers, whatever the number of workers. On another one "
        "the last digits differ"
    )
    lapack = [label for label, entry in settings["algorithms"].items() if _calls_lapack(entry["name"])]
    assumed = [label for label in lapack if not is_our_code(settings["algorithms"][label]["name"])]
    text += f", and where LAPACK is called the whole path: {join_words(lapack)}" if lapack else ""
    text += f" (assumed of {join_words(assumed)}, code of another package)." if assumed else "."
    steps = (
        f"armlab run {results.name}.yaml\narmlab report {results.name}.yaml\n"
        f"armlab bench share {results.name}.yaml --as csv --out {results.name}_tables"
    )
    return Origin(text, steps, Table(headings, rows, tuple(machines)), results.settings)


def _calls_lapack(name: str) -> bool:
    """Whether an algorithm calls LAPACK; one that is not registered here may."""
    try:
        return calls_lapack(load(name))
    except (UnknownAlgorithmError, BrokenAlgorithmError):
        return True


def _origin_keys(results: ResultSet) -> list[str]:
    return list(dict.fromkeys(key for origin in results.origins for key in origin))
