"""What section 5 says of the six algorithms: Table 3, its rankings, and Figure 3."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
from scipy.stats import kendalltau

from bench.mutations import InnerLife
from bench.paper.claims import TOLERANCE, Claim, close, held
from bench.paper.evidence import Evidence
from bench.paper.ranking import SUBJECT, Standing
from bench.printed import PrintedRow, display_name
from bench.statistics import is_feasible

_STATISTICS = ("minimum", "average", "standard_deviation")
_MISSING = "missing: search box, duration, samples, weight y, limits, scaling and choice of the columns"


def comparison_claims(evidence: Evidence) -> list[Claim]:
    """Table 3 number by number, then its rankings, then Figure 3."""
    return [*_numbers(evidence), _nearest(evidence), *_orders(evidence), *_best(evidence), *_figure3(evidence)]


def _numbers(evidence: Evidence) -> Iterator[Claim]:
    spans = _spans(evidence.frames["ranking"])
    average, total = (evidence.column("table3", name) for name in ("average_seconds", "total_seconds"))
    columns = {statistic: evidence.column("table3", statistic) for statistic in _STATISTICS}
    for name, row in evidence.paper.table3.rows.items():
        for statistic in _STATISTICS:
            yield _number(name, statistic, columns[statistic][name], row, spans[name, statistic])
        yield Claim(
            "Table 3",
            f"{display_name(name)}: time {row.seconds:.3g} s",
            f"{average[name]:.3g} s a run, {total[name]:.3g} s in total",
            "cannot be checked",
            "seconds of another machine and program; missing: the program, and whether of one run or of all",
        )


def _number(name: str, statistic: str, ours: float, row: PrintedRow, span: tuple[float, float]) -> Claim:
    printed, (low, high) = getattr(row, statistic), span
    text = f"{display_name(name)}: {statistic.replace('_', ' ')} {printed:g}"
    seen = f"{ours:.3g}; over all usable conventions {low:.3g} to {high:.3g}"
    if close(ours, printed):
        return Claim("Table 3", text, seen, "reproduced", "agrees within 10 % under the default conventions")
    if low <= printed <= high:
        why = f"some conventions give more, some less; {_MISSING}"
        return Claim("Table 3", text, seen, "cannot be checked", why)
    return Claim("Table 3", text, seen, "not reproduced", "outside of what any of our conventions gives")


def _spans(frame: pd.DataFrame) -> Mapping[tuple[str, str], tuple[float, float]]:
    """Least and largest of each statistic of each algorithm over the conventions, feasible ends only."""
    feasible = frame[is_feasible(frame["value"].to_numpy(), frame["violation"].to_numpy())]
    groups = feasible.groupby(["problem", "algorithm"])["value"]
    table = groups.agg(minimum="min", average="mean", standard_deviation="std").reset_index()
    return {
        (str(name), statistic): (float(rows[statistic].min()), float(rows[statistic].max()))
        for name, rows in table.groupby("algorithm")
        for statistic in _STATISTICS
    }


def _nearest(evidence: Evidence) -> Claim:
    """Under which convention the minima and averages are of the printed size."""
    distances = {standing.problem: _distance(standing, evidence.paper.table3.rows) for standing in evidence.ranking}
    finite = {problem: distance for problem, distance in distances.items() if np.isfinite(distance)}
    near, far = min(finite, key=finite.__getitem__), max(finite, key=finite.__getitem__)
    return Claim(
        "Table 3",
        "the size of its minima and averages",
        f"nearest convention: {near}, off by a factor of {np.exp(finite[near]):.2f} (median over the twelve numbers); "
        f"farthest: {far}, {np.exp(finite[far]):.2f}",
        "reproduced" if finite[near] <= np.log(1 + TOLERANCE) else "cannot be checked",
        f"whether the paper used the nearest one: {_MISSING}",
    )


def _distance(standing: Standing, rows: Mapping[str, PrintedRow]) -> float:
    """Median of |log(ours / printed)| over the minima and averages; NaN where nothing is feasible."""
    pairs = [(standing.minima[name], row.minimum) for name, row in rows.items()]
    pairs += [(standing.averages[name], row.average) for name, row in rows.items()]
    return float(np.median([abs(np.log(ours / theirs)) for ours, theirs in pairs]))


def _orders(evidence: Evidence) -> Iterator[Claim]:
    for statistic in _STATISTICS:
        printed = _order({name: getattr(row, statistic) for name, row in evidence.paper.table3.rows.items()})
        ours = _order(evidence.column("table3", statistic))
        agreement = kendalltau(*([order.index(name) for name in sorted(order)] for order in (printed, ours))).statistic
        yield Claim(
            "Table 3",
            f"ranking by {statistic.replace('_', ' ')}: {_chain(printed)}",
            f"{_chain(ours)}; Kendall's tau {agreement:.2f}",
            held(printed == ours),
            "the same order or not, under the default conventions; the other conventions stand in the ranking",
        )


def _order(figures: Mapping[str, float]) -> list[str]:
    return sorted(figures, key=figures.__getitem__)


def _chain(order: list[str]) -> str:
    return " < ".join(display_name(name) for name in order)


def _best(evidence: Evidence) -> Iterator[Claim]:
    usable = [standing for standing in evidence.ranking if standing.usable]
    texts = {"minimum": "MuPSO 'best minimized the problem'", "average": "MuPSO 'produced better averages'"}
    for statistic, says in texts.items():
        figures = [standing.minima if statistic == "minimum" else standing.averages for standing in usable]
        won = sum(min(by_name, key=lambda name: _or_infinite(by_name[name])) == SUBJECT for by_name in figures)
        column = evidence.column("table3", statistic)
        rank = _order(column).index(SUBJECT) + 1
        yield Claim(
            "section 5, after Table 3",
            says,
            f"{statistic} {column[SUBJECT]:.3g}, rank {rank} of {len(column)}; least in {won} of "
            f"{len(usable)} usable conventions",
            held(rank == 1),
            "by the default conventions; feasible ends only",
        )
    better, worse = (sum(standing.count(outcome) for standing in usable) for outcome in ("better", "worse"))
    pairs = sum(len(standing.duels) for standing in usable)
    yield Claim(
        "abstract",
        "MuPSO 'dominated other algorithms'",
        f"over {len(usable)} usable conventions: significantly better in {better} of {pairs} duels, worse in {worse}; "
        f"least median in {sum(standing.best == SUBJECT for standing in usable)} conventions",
        held(better > pairs / 2 and worse == 0),
        "paired Wilcoxon on log10, Holm within each convention, 5 %",
    )


def _or_infinite(value: float) -> float:
    return value if np.isfinite(value) else np.inf


def _figure3(evidence: Evidence) -> Iterator[Claim]:
    iteration = evidence.paper.figure3.mutated_at_iteration
    for reading, lives in evidence.lives.items():
        first = [life.mutations[0] for life in lives if life.mutations]
        earliest = f"{min(first)}, median {np.median(first):g}" if first else "never"
        yield Claim(
            f"section 5, Figure 3; eq. 6 read as {reading.replace('_', ' ')}",
            f"MuPSO mutated at iteration {iteration}",
            f"{len(first)} of {len(lives)} runs mutate; first mutation at the earliest in iteration {earliest}",
            held(bool(first) and np.median(first) == iteration),
            f"Q = {iteration} stagnant steps in a row must come first, so iteration {iteration} would need "
            "stagnation from "
            "the first population on, in every run whose average Figure 3 shows",
        )
        yield _before_mutation(reading, lives)


def _before_mutation(reading: str, lives: list[InnerLife]) -> Claim:
    mutated = [life for life in lives if life.mutations]
    before = sum(bool(life.best_before_mutation) for life in mutated)
    return Claim(
        f"section 5, Figure 3; eq. 6 read as {reading.replace('_', ' ')}",
        "the best solution was obtained before the mutation",
        f"in {before} of {len(mutated)} runs that mutate; the others found a better one afterwards",
        held(bool(mutated) and before == len(mutated)),
        "compares the iteration of the last improvement with that of the first mutation; reproduced only if in "
        "all runs",
    )
