"""Claims on the six algorithms: Table 3, its rankings and Figure 3 (section 5); percentages, times and particles
(section 6).
"""

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np
import pandas as pd
from scipy.stats import kendalltau

from algorithms.parameter_types import OURS
from bench.printed import PrintedRow, display_name
from bench.statistics import is_feasible
from bench.studies.mutations import MutationHistory
from bench.studies.paper.claims import (
    PRINTED_TOLERANCE,
    Claim,
    Evidence,
    Verdict,
    is_close_to_printed,
    percent_change,
    verdict_if,
)
from bench.studies.paper.claims_swarm_size import size_duels
from bench.studies.paper.ranking import READINGS, SUBJECT, Standing, count_duels, frames_by_reading

_STATISTICS = ("minimum", "average", "standard_deviation")
_MISSING_CONVENTIONS = "missing: search box, duration, samples, weight y, limits, scaling and choice of the columns"


def comparison_claims(evidence: Evidence) -> list[Claim]:
    """Claims about Table 3 number by number, then about its rankings, then about Figure 3."""
    return [
        *_number_claims(evidence),
        _nearest_convention_claim(evidence),
        *_order_claims(evidence),
        *_best_claims(evidence),
        *_figure3_claims(evidence),
    ]


def _number_claims(evidence: Evidence) -> Iterator[Claim]:
    frames = frames_by_reading(evidence.frames["ranking"])
    alone = _convention_spans(frames[OURS])
    spans = _convention_spans(pd.concat([frame.assign(reading=name) for name, frame in frames.items()]))
    average = evidence.column("table3", "average_seconds")
    total = evidence.column("table3", "total_seconds")
    columns = {statistic: evidence.column("table3", statistic) for statistic in _STATISTICS}
    for name, row in evidence.paper.table3.rows.items():
        for statistic in _STATISTICS:
            place = name, statistic
            yield _number_claim(place, columns[statistic][name], row, spans[place], alone[place])
        yield Claim(
            "Table 3",
            f"{display_name(name)}: time {row.seconds:.3g} s",
            f"{average[name]:.3g} s a run, {total[name]:.3g} s in total",
            "cannot be checked",
            "seconds of another machine and program; missing: the program, and whether of one run or of all",
        )


Span = tuple[float, float]


def _number_claim(place: tuple[str, str], ours: float, row: PrintedRow, span: Span, alone: Span) -> Claim:
    """span: over all usable conventions and readings of the algorithms; alone: over the conventions, with ours."""
    name, statistic = place
    printed, (low, high) = getattr(row, statistic), span
    text = f"{display_name(name)}: {statistic.replace('_', ' ')} {printed:g}"
    seen = f"{ours:.3g}; over all usable conventions and readings {low:.3g} to {high:.3g}"
    verdict, before = _number_verdict(ours, printed, span), _number_verdict(ours, printed, alone)
    if verdict == "reproduced":
        why = "agrees within 10 % under the default conventions"
    elif verdict == "cannot be checked":
        why = f"some conventions or readings give more, some less; {_MISSING_CONVENTIONS}"
    else:
        why = "outside of what any of our conventions and readings gives"
    return Claim("Table 3", text, seen, verdict, why, None if before == verdict else before)


def _number_verdict(ours: float, printed: float, span: Span) -> Verdict:
    if is_close_to_printed(ours, printed):
        return "reproduced"
    return "cannot be checked" if span[0] <= printed <= span[1] else "not reproduced"


def _convention_spans(frame: pd.DataFrame) -> Mapping[tuple[str, str], tuple[float, float]]:
    """Least and largest of each statistic of each algorithm over conventions and readings, feasible ends only."""
    feasible = frame[is_feasible(frame["value"].to_numpy(), frame["violation"].to_numpy())]
    readings = ["reading"] if "reading" in feasible else []
    groups = feasible.groupby(["problem", "algorithm", *readings])["value"]
    table = groups.agg(minimum="min", average="mean", standard_deviation="std").reset_index()
    return {
        (str(name), statistic): (float(rows[statistic].min()), float(rows[statistic].max()))
        for name, rows in table.groupby("algorithm")
        for statistic in _STATISTICS
    }


def _nearest_convention_claim(evidence: Evidence) -> Claim:
    """The convention under which the minima and averages have the printed size."""
    distances = {
        standing.problem: _distance_to_printed(standing, evidence.paper.table3.rows) for standing in evidence.ranking
    }
    finite = {problem: distance for problem, distance in distances.items() if np.isfinite(distance)}
    near, far = min(finite, key=finite.__getitem__), max(finite, key=finite.__getitem__)
    return Claim(
        "Table 3",
        "the size of its minima and averages",
        f"nearest convention: {near}, off by a factor of {np.exp(finite[near]):.2f} (median over the twelve numbers); "
        f"farthest: {far}, {np.exp(finite[far]):.2f}",
        "reproduced" if finite[near] <= np.log(1 + PRINTED_TOLERANCE) else "cannot be checked",
        f"whether the paper used the nearest one: {_MISSING_CONVENTIONS}",
    )


def _distance_to_printed(standing: Standing, rows: Mapping[str, PrintedRow]) -> float:
    """Median of |log(ours / printed)| over the minima and averages; NaN where nothing is feasible."""
    pairs = [(standing.minima[name], row.minimum) for name, row in rows.items()]
    pairs += [(standing.averages[name], row.average) for name, row in rows.items()]
    return float(np.median([abs(np.log(ours / theirs)) for ours, theirs in pairs]))


def _order_claims(evidence: Evidence) -> Iterator[Claim]:
    for statistic, reading in product(_STATISTICS, evidence.rankings):
        printed = sort_by_figure({name: getattr(row, statistic) for name, row in evidence.paper.table3.rows.items()})
        ours = sort_by_figure(_default_figures(evidence, statistic, reading))
        agreement = kendalltau(*([order.index(name) for name in sorted(order)] for order in (printed, ours))).statistic
        yield Claim(
            f"Table 3{_reading_text(reading)}",
            f"ranking by {statistic.replace('_', ' ')}: {format_order(printed)}",
            f"{format_order(ours)}; Kendall's tau {agreement:.2f}",
            verdict_if(printed == ours),
            "the same order or not, under the default conventions; the other conventions stand in the ranking",
        )


def _default_figures(evidence: Evidence, statistic: str, reading: str) -> dict[str, float]:
    """A statistic under the default conventions by algorithm."""
    standing = evidence.default_standing(evidence.rankings[reading])
    return {"minimum": standing.minima, "average": standing.averages, "standard_deviation": standing.deviations}[
        statistic
    ]


def _reading_text(reading: str) -> str:
    return f"; algorithms: {READINGS[reading]}"


def sort_by_figure(figures: Mapping[str, float]) -> list[str]:
    """Names, the one with the least figure first."""
    return sorted(figures, key=figures.__getitem__)


def format_order(order: list[str]) -> str:
    """`MuPSO < PSO`, as a ranking is printed."""
    return " < ".join(display_name(name) for name in order)


def _best_claims(evidence: Evidence) -> Iterator[Claim]:
    texts = {"minimum": "MuPSO 'best minimized the problem'", "average": "MuPSO 'produced better averages'"}
    for (statistic, says), reading in product(texts.items(), evidence.rankings):
        usable = [standing for standing in evidence.rankings[reading] if standing.usable]
        figures = [standing.minima if statistic == "minimum" else standing.averages for standing in usable]
        won = sum(min(by_name, key=lambda name: _nan_to_infinity(by_name[name])) == SUBJECT for by_name in figures)
        column = _default_figures(evidence, statistic, reading)
        rank = sort_by_figure(column).index(SUBJECT) + 1
        yield Claim(
            f"section 5, after Table 3{_reading_text(reading)}",
            says,
            f"{statistic} {column[SUBJECT]:.3g}, rank {rank} of {len(column)}; least in {won} of "
            f"{len(usable)} usable conventions",
            verdict_if(rank == 1),
            "by the default conventions; feasible ends only",
        )
    for reading, standings in evidence.rankings.items():
        usable = [standing for standing in standings if standing.usable]
        better, worse, pairs = count_duels(standings)
        yield Claim(
            f"abstract{_reading_text(reading)}",
            "MuPSO 'dominated other algorithms'",
            f"over {len(usable)} usable conventions: significantly better in {better} of {pairs} duels, worse in "
            f"{worse}; least median in {sum(standing.best == SUBJECT for standing in usable)} conventions",
            verdict_if(better > pairs / 2 and worse == 0),
            "paired Wilcoxon on log10, Holm within each convention, 5 %",
        )


def _nan_to_infinity(value: float) -> float:
    return value if np.isfinite(value) else np.inf


def _figure3_claims(evidence: Evidence) -> Iterator[Claim]:
    iteration = evidence.paper.figure3.mutated_at_iteration
    for reading, lives in evidence.mutation_histories.items():
        first = [life.mutations[0] for life in lives if life.mutations]
        earliest = f"{min(first)}, median {np.median(first):g}" if first else "never"
        yield Claim(
            f"section 5, Figure 3; eq. 6 read as {reading.replace('_', ' ')}",
            f"MuPSO mutated at iteration {iteration}",
            f"{len(first)} of {len(lives)} runs mutate; first mutation at the earliest in iteration {earliest}",
            verdict_if(bool(first) and np.median(first) == iteration),
            f"Q = {iteration} stagnant steps in a row must come first, so iteration {iteration} would need "
            "stagnation from "
            "the first population on, in every run whose average Figure 3 shows",
        )
        yield _before_mutation_claim(reading, lives)


def _before_mutation_claim(reading: str, lives: list[MutationHistory]) -> Claim:
    mutated = [life for life in lives if life.mutations]
    before = sum(bool(life.best_before_mutation) for life in mutated)
    return Claim(
        f"section 5, Figure 3; eq. 6 read as {reading.replace('_', ' ')}",
        "the best solution was obtained before the mutation",
        f"in {before} of {len(mutated)} runs that mutate; the others found a better one afterwards",
        verdict_if(bool(mutated) and before == len(mutated)),
        "compares the iteration of the last improvement with that of the first mutation; reproduced only if in "
        "all runs",
    )


_SECTION = "section 6"
_EARLY_ITERATION = 10  # iterations of 30


def conclusion_claims(evidence: Evidence) -> list[Claim]:
    """Claims of section 6: gains, times, and the swarm size."""
    return [
        *_gain_claims(evidence),
        *_time_rank_claims(evidence),
        *_slower_claims(evidence),
        *_reduction_claims(evidence),
        *_early_best_claims(evidence),
    ]


def _gain_claims(evidence: Evidence) -> Iterator[Claim]:
    rows, minimum = evidence.paper.table3.rows, evidence.column("table3", "minimum")
    low, high = evidence.paper.conclusion.gain_percent
    rivals = [name for name in rows if name != SUBJECT]
    printed = {
        statistic: [
            percent_change(getattr(rows[name], statistic), getattr(rows[SUBJECT], statistic)) for name in rivals
        ]
        for statistic in ("minimum", "average")
    }
    ours = [percent_change(minimum[name], minimum[SUBJECT]) for name in rivals]
    yield Claim(
        _SECTION,
        f"({low}-{high}) % gain in the minimum solution against the others",
        f"printed minima: {_format_range(printed['minimum'])} %; printed averages: "
        f"{_format_range(printed['average'])} %; "
        "our minima: "
        f"{_format_range(ours)} %",
        verdict_if(round(min(printed["minimum"])) == low and round(max(printed["minimum"])) == high),
        "from the printed numbers: the range is about that of the averages; a negative gain is a loss",
    )


def _time_rank_claims(evidence: Evidence) -> Iterator[Claim]:
    rows, taken = evidence.paper.table3.rows, evidence.column("table3", "average_seconds")
    printed = sorted(rows, key=lambda name: rows[name].seconds).index(SUBJECT) + 1
    order = sorted(taken, key=taken.__getitem__)
    rank = order.index(SUBJECT) + 1
    yield Claim(
        _SECTION,
        "MuPSO needs the second least computing time",
        f"printed times: rank {printed}; ours: rank {rank} ({' < '.join(map(display_name, order))}), a span of "
        f"{percent_change(taken[order[-1]], taken[order[0]]):.0f} %",
        verdict_if(rank == evidence.paper.conclusion.time_rank),
        "holds for the printed times; ours are those of this machine, where the objective is most of the time",
    )


def _slower_claims(evidence: Evidence) -> Iterator[Claim]:
    rows, paper = evidence.paper.table3.rows, evidence.paper.conclusion
    changes = {name: percent_change(rows[SUBJECT].seconds, rows[name].seconds) for name in rows if name != SUBJECT}
    meant = min(changes, key=lambda name: abs(changes[name] - paper.slower_percent))
    yield Claim(
        _SECTION,
        f"{paper.slower_percent} % more computing time than {display_name(paper.slower_than)}",
        f"printed times: {changes[paper.slower_than]:.2f} % against {display_name(paper.slower_than)}, "
        f"{changes[meant]:.2f} % against {display_name(meant)}",
        verdict_if(meant == paper.slower_than),
        f"from the printed numbers: {display_name(meant)} is meant",
    )


def _reduction_claims(evidence: Evidence) -> Iterator[Claim]:
    rows, paper = evidence.paper.table3.rows, evidence.paper.conclusion
    low, high = paper.time_reduction_percent
    slower = [name for name in rows if rows[name].seconds > rows[SUBJECT].seconds]
    of_theirs = {name: -percent_change(rows[SUBJECT].seconds, rows[name].seconds) for name in slower}
    of_ours = {name: percent_change(rows[name].seconds, rows[SUBJECT].seconds) for name in slower}
    left_out = [display_name(name) for name, change in of_ours.items() if change > high + 1]
    yield Claim(
        _SECTION,
        f"({low}-{high}) % less computing time than the others",
        f"printed times: {_format_range(list(of_theirs.values()))} % of theirs, "
        f"{_format_range(list(of_ours.values()))} % of MuPSO's",
        verdict_if(round(min(of_theirs.values())) == low and round(max(of_theirs.values())) == high),
        f"from the printed numbers: a reduction is counted from the larger; divided by MuPSO's own time, and without "
        f"{', '.join(left_out)}, the range fits",
    )


def _early_best_claims(evidence: Evidence) -> Iterator[Claim]:
    lives = next(iter(evidence.mutation_histories.values()))
    last = np.array([life.last_improvement for life in lives])
    yield Claim(
        "section 6, Figure 3",
        "MuPSO's best solution is obtained early in the run",
        f"median iteration of the last improvement {np.median(last):g} of {lives[0].iterations}; by iteration "
        f"{_EARLY_ITERATION} in "
        f"{(last <= _EARLY_ITERATION).mean():.0%} of the runs",
        verdict_if(bool(np.median(last) <= _EARLY_ITERATION)),
        f"early means the first third, iteration {_EARLY_ITERATION}, in half of the runs",
    )
    yield from _fewer_particles_claims(evidence)


def _fewer_particles_claims(evidence: Evidence) -> Iterator[Claim]:
    size = evidence.paper.table3.swarm_size
    slack = 1 + PRINTED_TOLERANCE
    budgets = {"figure2": "200 iterations each", "figure2_equal_evaluations": "equal evaluations"}
    for experiment, budget in budgets.items():
        frame = evidence.frames[experiment]
        against = size_duels(frame[frame["algorithm"] == SUBJECT], size)
        medians = evidence.column(experiment, "median")
        smaller = [duel for duel in against if int(duel.rival) < size]
        shown = ", ".join(f"{duel.rival}: {medians[int(duel.rival), SUBJECT]:.3g}" for duel in smaller)
        enough = [
            duel.rival
            for duel in smaller
            if duel.winner() != duel.subject and medians[int(duel.rival), SUBJECT] <= slack * medians[size, SUBJECT]
        ]
        yield Claim(
            _SECTION,
            f"MuPSO may have fewer particles than {size}, which saves computations",
            f"{budget}: medians {shown}, {size}: {medians[size, SUBJECT]:.3g}; as good as {size}: "
            f"{', '.join(enough) or 'none'}",
            verdict_if(bool(enough)),
            "reproduced where some smaller swarm is not worse (paired Wilcoxon, 5 %, Holm) and its median at "
            "most 10 % larger",
        )


def _format_range(values: list[float]) -> str:
    return f"{min(values):.1f} to {max(values):.1f}"
