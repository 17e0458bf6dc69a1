"""Claims of section 5 on the swarm size: Figure 2."""

from collections.abc import Iterator

import pandas as pd

from bench.printed import display_name
from bench.statistics.pairwise import Duel, duels
from bench.studies.paper.claims import (
    PRINTED_TOLERANCE,
    Claim,
    Evidence,
    is_close_to_printed,
    percent_change,
    verdict_if,
)

_PLACE = "section 5, Figure 2"
_SWARM_ALGORITHMS = ("spso", "mupso")
_MISSING_CONVENTIONS = (
    "missing: search box, duration, samples, weight y, limits and scaling of the columns, and which PSO was run"
)


def swarm_size_claims(evidence: Evidence) -> list[Claim]:
    """The best costs, the times, the percentages and the optimal size."""
    return [
        *_cost_claims(evidence),
        _table3_claim(evidence),
        *_time_claims(evidence),
        *_percentage_claims(evidence),
        *_optimal_size_claims(evidence),
    ]


def _cost_claims(evidence: Evidence) -> Iterator[Claim]:
    minimum = evidence.column("figure2", "minimum")
    median = evidence.column("figure2", "median")
    for size, cost in evidence.paper.figure2.best_cost.items():
        pairs = {name: (minimum[size, name], median[size, name]) for name in _SWARM_ALGORITHMS}
        ours = "; ".join(f"{display_name(n)} minimum {low:.3g}, median {mid:.3g}" for n, (low, mid) in pairs.items())
        agrees = any(is_close_to_printed(figure, cost) for pair in pairs.values() for figure in pair)
        yield Claim(
            _PLACE,
            f"best cost {cost:g} with {size} particles",
            ours,
            "reproduced" if agrees else "cannot be checked",
            "minimum or median agrees within 10 %"
            if agrees
            else f"the value depends on conventions; {_MISSING_CONVENTIONS}",
        )


def _table3_claim(evidence: Evidence) -> Claim:
    figure2, table3 = evidence.paper.figure2, evidence.paper.table3
    size = table3.swarm_size
    more = (figure2.iterations + 1) / (table3.iterations + 1)
    rows = ", ".join(f"{display_name(name)} {table3.rows[name].minimum:g}" for name in _SWARM_ALGORITHMS)
    return Claim(
        "section 5, Figure 2 against Table 3",
        f"{figure2.best_cost[size]:g} with {size} particles and {figure2.iterations} iterations",
        f"Table 3 prints as minima with {table3.iterations} iterations: {rows}; Figure 2 has {more:.1f} times "
        "the evaluations",
        "cannot be checked",
        "missing: which PSO Figure 2 shows; were it MuPSO, more evaluations would have given a worse best",
    )


def _time_claims(evidence: Evidence) -> Iterator[Claim]:
    taken, paper = evidence.column("figure2", "average_seconds"), evidence.paper
    for size, seconds in paper.figure2.seconds.items():
        ours = ", ".join(f"{display_name(name)} {taken[size, name]:.3g} s" for name in _SWARM_ALGORITHMS)
        yield Claim(
            _PLACE,
            f"{seconds:.3g} s per generation with {size} particles",
            f"{ours} a run on one core",
            "cannot be checked",
            "seconds of another machine and program; missing: the program, and what a 'generation' spans",
        )
    size = paper.table3.swarm_size
    figure2 = paper.figure2.seconds[size] / (size * (paper.figure2.iterations + 1))
    table3 = paper.table3.rows["spso"].seconds / (size * (paper.table3.iterations + 1))
    repetitions = paper.figure2.repetitions
    yield Claim(
        "section 5, Figure 2 and Table 3",
        "computing times of the same swarm on the same problem",
        f"Figure 2: {figure2:.3g} s an evaluation; Table 3, SPSO: {table3:.3g} s, or "
        f"{table3 / repetitions:.3g} s if its "
        f"seconds are of all {repetitions} runs",
        verdict_if(is_close_to_printed(figure2, table3) or is_close_to_printed(figure2, table3 / repetitions)),
        "computed from the printed numbers: under neither reading do the two agree",
    )


def _percentage_claims(evidence: Evidence) -> Iterator[Claim]:
    figure2, median = evidence.paper.figure2, evidence.column("figure2", "median")
    taken = evidence.column("figure2", "average_seconds")
    (small, large), cost, seconds = sorted(figure2.best_cost), figure2.best_cost, figure2.seconds
    of_start, of_end = -percent_change(cost[large], cost[small]), percent_change(cost[small], cost[large])
    ours = {name: -percent_change(median[large, name], median[small, name]) for name in _SWARM_ALGORITHMS}
    yield Claim(
        _PLACE,
        f"{figure2.cost_decrease_percent} % decrease of the best cost from {small} to {large} particles",
        f"printed costs: {of_start:.1f} % of the first, {of_end:.1f} % of the second; our medians: "
        + ", ".join(f"{display_name(n)} {change:.1f} %" for n, change in ours.items()),
        verdict_if(round(of_start) == figure2.cost_decrease_percent),
        f"a decrease is counted from where it starts: {of_start:.1f} %; the printed figure divides by the end",
    )
    printed = percent_change(seconds[large], seconds[small])
    ratio = {name: percent_change(taken[large, name], taken[small, name]) for name in _SWARM_ALGORITHMS}
    yield Claim(
        _PLACE,
        f"{figure2.time_increase_percent} % increase of the computing time from {small} to {large} particles",
        f"printed times: {printed:.1f} %; evaluations: {percent_change(large, small):.0f} %; our times: "
        + ", ".join(f"{display_name(n)} {change:.0f} %" for n, change in ratio.items()),
        verdict_if(is_close_to_printed(printed, figure2.time_increase_percent)),
        "follows from the printed times, and from the number of evaluations, to which the time is proportional",
    )


def _optimal_size_claims(evidence: Evidence) -> Iterator[Claim]:
    optimal = evidence.paper.figure2.optimal_swarm_size
    for experiment, budget in (("figure2", "200 iterations each"), ("figure2_equal_evaluations", "equal evaluations")):
        for name in _SWARM_ALGORITHMS:
            yield _optimal_size_claim(evidence, experiment, budget, name, optimal)


def _optimal_size_claim(evidence: Evidence, experiment: str, budget: str, name: str, optimal: int) -> Claim:
    frame = evidence.frames[experiment]
    column = evidence.column(experiment, "median")
    medians = {size: median for (size, label), median in column.items() if label == name}
    best = min(medians, key=medians.__getitem__)
    against = size_duels(frame[frame["algorithm"] == name], optimal)
    worse = [duel.rival for duel in against if duel.winner() == duel.subject]
    better = [duel.rival for duel in against if duel.winner() == duel.rival]
    return Claim(
        _PLACE,
        f"{optimal} particles are optimal",
        f"{display_name(name)}, {budget}: least median {medians[best]:.3g} with {best}, {medians[optimal]:.3g} with "
        f"{optimal}; {optimal} is better than {', '.join(worse) or 'none'}, worse than {', '.join(better) or 'none'}",
        verdict_if(not better and medians[optimal] <= (1 + PRINTED_TOLERANCE) * medians[best]),
        "reproduced where no other size is better (paired Wilcoxon, 5 %, Holm) and its median is within 10 % "
        "of the least",
    )


def size_duels(frame: pd.DataFrame, subject: int) -> list[Duel]:
    """One swarm size against all others of one algorithm; a larger swarm begins with the smaller one's points."""
    sizes = frame.assign(algorithm=frame["swarm_size"].astype(str))
    return duels(sizes, [(str(subject), rival) for rival in sizes["algorithm"].unique() if rival != str(subject)])
