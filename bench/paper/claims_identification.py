"""What section 5 says can be identified: the counts, the readings that lead to them, and the list of 22."""

from collections import Counter
from collections.abc import Iterator

from bench.paper.claims import Claim, held
from bench.paper.evidence import Evidence
from bench.paper.literal import Identifiability, Reading
from bench.printed import PrintedCounts


def identification_claims(evidence: Evidence) -> list[Claim]:
    """Counts, literal readings, and the list."""
    return [*_counts(evidence), *_readings(evidence), *_list(evidence)]


def _counts(evidence: Evidence) -> Iterator[Claim]:
    base, printed = evidence.best.problem.base, evidence.paper.identifiable
    sums = len(base) - len(base.alone)
    ours = (
        f"{len(base.names)} parameters: {len(base.alone)} alone ({', '.join(base.alone)}), {len(base.grouped)} "
        f"in {sums} "
        f"sums, {len(base.unidentifiable)} without effect ({', '.join(base.unidentifiable)}); rank {len(base)}"
    )
    same = (len(base.alone), len(base.grouped), len(base.unidentifiable)) == _triple(printed)
    yield Claim(
        "abstract; section 5",
        f"of {printed.parameters} parameters {printed.alone} identifiable alone, {printed.combinations} in linear "
        f"combinations, {printed.unidentifiable} not",
        ours,
        held(same),
        "the rank of three joint torques in the 30 parameters; the same from an independent dynamics engine in "
        "the tests",
    )


def _triple(printed: PrintedCounts) -> tuple[int, int, int]:
    return printed.alone, printed.combinations, printed.unidentifiable


def _readings(evidence: Evidence) -> Iterator[Claim]:
    """The paper's own equations, read to the letter: what gives its counts, and what its list."""
    printed, listed = evidence.paper.identifiable, set(evidence.paper.table4)
    last = list(evidence.paper.table4)[-printed.combinations :]
    for reading, found in evidence.readings:
        counts = (len(found.alone), len(found.combined), len(found.without_effect))
        seen = set(found.alone) | set(found.combined)
        yield Claim(
            "eq. 9-39",
            f"{printed.alone} + {printed.combinations} + {printed.unidentifiable}, and the 22 of Table 4, by "
            "this reading: "
            f"{reading}",
            f"{counts[0]} + {counts[1]} + {counts[2]}, {counts[0] + counts[1]} columns that are not zero, rank "
            f"{found.rank};"
            f" against Table 4 missing: {_names(listed - seen)}; too many: {_names(seen - listed)}",
            held(counts == _triple(printed) and seen == listed),
            _explanation(reading, found, counts == _triple(printed), seen - listed, last if listed < seen else []),
        )


def _explanation(reading: Reading, found: Identifiability, counts: bool, extra: set[str], last: list[str]) -> str:
    """last: with what Table 4 ends, where every parameter of it has an effect."""
    combined = _names(set(found.combined))
    if counts:
        return f"the counts, not the list; in combination are {combined}"
    if last and set(last) <= set(found.combined):
        return (
            f"not the counts, but the list: all of Table 4 has an effect, and {_names(extra)} alone besides. "
            "In two pairs "
            f"are {combined}; Table 4 ends with one of each, {' and '.join(last)}. So {_names(extra)} dropped "
            "as dependent "
            "gives 22 kept and 8 dropped columns, and the two at the end as 'combinations' give 20 + 2 + 8. "
            "This reading "
            "has P in the wrong frame, no gravity, the moment about a wrong axis and misnamed inertias"
        )
    measured = (
        "six components of each joint's wrench" if reading.rows == "wrench" else "moments not about the joint's axis"
    )
    return f"neither the counts nor the list; takes {measured} as measured"


def _list(evidence: Evidence) -> Iterator[Claim]:
    named, table = evidence.paper.named, evidence.paper.table4
    twice = [name for name, count in Counter(named).items() if count > 1]
    yield Claim(
        "section 5, after Figure 5, against Table 4",
        f"{len(named)} identified parameters are named",
        f"{len(set(named))} different ones; twice: {', '.join(twice)}; in Table 4 but not in the text: "
        f"{_names(set(table) - set(named))}; in the text but not in Table 4: {_names(set(named) - set(table))}",
        held(set(named) == set(table)),
        "from the printed lists",
    )
    base = evidence.best.problem.base
    effective = [name for name in table if name not in base.unidentifiable]
    alone = [name for name in table if name in base.alone]
    yield Claim(
        "Table 4",
        f"{len(table)} parameters identified one by one",
        f"{len(alone)} of them identifiable alone ({', '.join(alone)}), {len(effective) - len(alone)} only in sums, "
        f"{len(table) - len(effective)} without effect ({_names(set(table) - set(effective))})",
        held(len(alone) == len(table)),
        "from the rank of the three joint torques; a parameter without effect cannot be estimated at all",
    )


def _names(names: set[str]) -> str:
    return ", ".join(sorted(names)) or "none"
