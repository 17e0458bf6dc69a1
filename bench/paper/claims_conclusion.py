"""What section 6 says: percentages, computing times, and that fewer particles suffice."""

from collections.abc import Iterator

import numpy as np

from bench.paper.claims import TOLERANCE, Claim, held, percent
from bench.paper.claims_swarm_size import size_duels
from bench.paper.evidence import Evidence
from bench.paper.ranking import SUBJECT
from bench.printed import display_name

_PLACE = "section 6"
_EARLY = 10  # iterations of 30


def conclusion_claims(evidence: Evidence) -> list[Claim]:
    """Gains, times, and the swarm size once more."""
    return [*_gain(evidence), *_time_rank(evidence), *_slower(evidence), *_reduction(evidence), *_fewer(evidence)]


def _gain(evidence: Evidence) -> Iterator[Claim]:
    rows, minimum = evidence.paper.table3.rows, evidence.column("table3", "minimum")
    low, high = evidence.paper.conclusion.gain_percent
    rivals = [name for name in rows if name != SUBJECT]
    printed = {
        statistic: [percent(getattr(rows[name], statistic), getattr(rows[SUBJECT], statistic)) for name in rivals]
        for statistic in ("minimum", "average")
    }
    ours = [percent(minimum[name], minimum[SUBJECT]) for name in rivals]
    yield Claim(
        _PLACE,
        f"({low}-{high}) % gain in the minimum solution against the others",
        f"printed minima: {_range(printed['minimum'])} %; printed averages: {_range(printed['average'])} %; "
        "our minima: "
        f"{_range(ours)} %",
        held(round(min(printed["minimum"])) == low and round(max(printed["minimum"])) == high),
        "from the printed numbers: the range is about that of the averages; a negative gain is a loss",
    )


def _time_rank(evidence: Evidence) -> Iterator[Claim]:
    rows, taken = evidence.paper.table3.rows, evidence.column("table3", "average_seconds")
    printed = sorted(rows, key=lambda name: rows[name].seconds).index(SUBJECT) + 1
    order = sorted(taken, key=taken.__getitem__)
    rank = order.index(SUBJECT) + 1
    yield Claim(
        _PLACE,
        "MuPSO needs the second least computing time",
        f"printed times: rank {printed}; ours: rank {rank} ({' < '.join(map(display_name, order))}), a span of "
        f"{percent(taken[order[-1]], taken[order[0]]):.0f} %",
        held(rank == evidence.paper.conclusion.time_rank),
        "holds for the printed times; ours are those of this machine, where the objective is most of the time",
    )


def _slower(evidence: Evidence) -> Iterator[Claim]:
    rows, paper = evidence.paper.table3.rows, evidence.paper.conclusion
    changes = {name: percent(rows[SUBJECT].seconds, rows[name].seconds) for name in rows if name != SUBJECT}
    meant = min(changes, key=lambda name: abs(changes[name] - paper.slower_percent))
    yield Claim(
        _PLACE,
        f"{paper.slower_percent} % more computing time than {display_name(paper.slower_than)}",
        f"printed times: {changes[paper.slower_than]:.2f} % against {display_name(paper.slower_than)}, "
        f"{changes[meant]:.2f} % against {display_name(meant)}",
        held(meant == paper.slower_than),
        f"from the printed numbers: {display_name(meant)} is meant",
    )


def _reduction(evidence: Evidence) -> Iterator[Claim]:
    rows, paper = evidence.paper.table3.rows, evidence.paper.conclusion
    low, high = paper.time_reduction_percent
    slower = [name for name in rows if rows[name].seconds > rows[SUBJECT].seconds]
    of_theirs = {name: -percent(rows[SUBJECT].seconds, rows[name].seconds) for name in slower}
    of_ours = {name: percent(rows[name].seconds, rows[SUBJECT].seconds) for name in slower}
    left_out = [display_name(name) for name, change in of_ours.items() if change > high + 1]
    yield Claim(
        _PLACE,
        f"({low}-{high}) % less computing time than the others",
        f"printed times: {_range(list(of_theirs.values()))} % of theirs, {_range(list(of_ours.values()))} % of MuPSO's",
        held(round(min(of_theirs.values())) == low and round(max(of_theirs.values())) == high),
        f"from the printed numbers: a reduction is counted from the larger; divided by MuPSO's own time, and without "
        f"{', '.join(left_out)}, the range fits",
    )


def _fewer(evidence: Evidence) -> Iterator[Claim]:
    lives = next(iter(evidence.lives.values()))
    last = np.array([life.last_improvement for life in lives])
    yield Claim(
        "section 6, Figure 3",
        "MuPSO's best solution is obtained early in the run",
        f"median iteration of the last improvement {np.median(last):g} of {lives[0].iterations}; by iteration "
        f"{_EARLY} in "
        f"{(last <= _EARLY).mean():.0%} of the runs",
        held(bool(np.median(last) <= _EARLY)),
        f"early means the first third, iteration {_EARLY}, in half of the runs",
    )
    yield from _fewer_particles(evidence)


def _fewer_particles(evidence: Evidence) -> Iterator[Claim]:
    size = evidence.paper.table3.swarm_size
    slack = 1 + TOLERANCE
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
            _PLACE,
            f"MuPSO may have fewer particles than {size}, which saves computations",
            f"{budget}: medians {shown}, {size}: {medians[size, SUBJECT]:.3g}; as good as {size}: "
            f"{', '.join(enough) or 'none'}",
            held(bool(enough)),
            "reproduced where some smaller swarm is not worse (paired Wilcoxon, 5 %, Holm) and its median at "
            "most 10 % larger",
        )


def _range(values: list[float]) -> str:
    return f"{min(values):.1f} to {max(values):.1f}"
