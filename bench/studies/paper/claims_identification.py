"""Claims of section 5 on the arm, the optimised trajectory, and which parameters are identified with which values."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

from armlab.common.arrays import Array
from bench.printed import PrintedCounts
from bench.studies.paper.claims import Claim, Evidence, is_close_to_printed, verdict_if
from bench.studies.paper.literal import Identifiability, Reading
from bench.studies.paper.paper_tables import listed_parameters

_MISSING_CONVENTIONS = (
    "missing: the fundamental frequency, the number of samples, the centre of the path, the tool point, and "
    "which columns "
    "of the observation matrix were kept"
)


def trajectory_claims(evidence: Evidence) -> list[Claim]:
    """Tables 1 and 2, the fitness that ends a run, the published coefficients and their condition number."""
    return [
        *_table_claims(evidence),
        *_end_claims(evidence),
        *_coefficient_claims(evidence),
        *_condition_number_claims(evidence),
    ]


def _table_claims(evidence: Evidence) -> Iterator[Claim]:
    deviations, differences = evidence.deviations, evidence.differences
    yield Claim(
        "Table 1",
        "D-H parameters and ranges of the IRB 120",
        "; ".join(deviations) or "no deviation",
        verdict_if(not deviations),
        "lengths and twists agree; the ranges that deviate are not the robot's by its data sheet",
    )
    yield Claim(
        "Table 2 and section 2",
        "parameters of the algorithms",
        "; ".join(differences) or "all in force as printed",
        verdict_if(not differences),
        "the paper names no speed limit, and Table 2 none of the remaining constants of WOA and GOA",
    )


def _end_claims(evidence: Evidence) -> Iterator[Claim]:
    values = evidence.frames["table3"]["value"]
    threshold = evidence.paper.table2["mupso"]["abandonment_threshold"]
    yield Claim(
        "eq. 7, section 2",
        f"a run ends when its fitness falls below {threshold:g}",
        f"least condition number of all runs {values.min():.3g}; none ended so",
        verdict_if(bool(values.min() <= threshold)),
        "a condition number is at least 1, so this end cannot happen; for the same reason every stagnation mutates",
    )


def _coefficient_claims(evidence: Evidence) -> Iterator[Claim]:
    optimum, arm = evidence.paper.optimum, evidence.paper.table1
    upper, side, fore = arm[1].a_mm, arm[2].a_mm, arm[3].d_mm
    reach = (upper + np.hypot(side, fore)) / 1e3
    cartesian = [reading for reading in evidence.published if reading.space == "Cartesian"]
    reached = sum(reading.overreach == 0 for reading in cartesian)
    nearest = min(cartesian, key=lambda reading: reading.overreach)
    yield Claim(
        "section 5, coefficients a, b, c; eq. 45-47",
        "the optimal trajectory lies in the workspace (eq. 48)",
        f"sum of a = {sum(optimum.a):.3g} m, the reach of the wrist is {reach:.3g} m; within reach under {reached} of "
        f"{len(cartesian)} conventions, at best {nearest.overreach:.2g} m outside ({nearest})",
        verdict_if(reached > 0),
        "evaluated for six durations, two tool points, two centres, both elbows, with and without the rest of eq. 48",
    )
    yield Claim(
        "section 5, coefficients b and c; eq. 48",
        "the motion starts and ends at rest",
        f"sum of b = {sum(optimum.b):.3g}, c = {optimum.c:g}; at rest both would be 0",
        verdict_if(bool(np.isclose(sum(optimum.b), 0) and np.isclose(optimum.c, 0))),
        "the speed of the Fourier part at both ends is sum b, its acceleration proportional to c times sum k",
    )


def _condition_number_claims(evidence: Evidence) -> Iterator[Claim]:
    printed = evidence.paper.optimum.condition_number
    finite = [reading for reading in evidence.published if np.isfinite(reading.value)]
    nearest = min(finite, key=lambda reading: abs(np.log(reading.value / printed)))
    least = min(finite, key=lambda reading: reading.value)
    agrees = is_close_to_printed(nearest.value, printed)
    yield Claim(
        "section 5, after Figure 3",
        f"condition number {printed:g} with the published coefficients",
        f"nearest {nearest.value:.4g} ({nearest}); least {least.value:.4g}; no value in Cartesian space, where "
        "the path "
        "leaves the reach",
        "reproduced" if agrees else "cannot be checked",
        "one convention agrees within 10 %" if agrees else _MISSING_CONVENTIONS,
    )
    row = evidence.paper.table3.rows["mupso"]
    yield Claim(
        "section 5 against Table 3",
        f"the trajectory obtained from the MuPSO has {printed:g}",
        f"Table 3 prints {row.minimum:g} as MuPSO's minimum and {row.average:g} as its average",
        verdict_if(is_close_to_printed(printed, row.minimum)),
        "from the printed numbers: the final trajectory is not the best one found, but like an average one",
    )


def identification_claims(evidence: Evidence) -> list[Claim]:
    """Claims about the counts of identifiable parameters, the literal readings, and the list of parameters."""
    return [*_count_claims(evidence), *_reading_claims(evidence), *_list_claims(evidence)]


def _count_claims(evidence: Evidence) -> Iterator[Claim]:
    base, printed = evidence.best.problem.base, evidence.paper.identifiable
    sums = len(base) - len(base.alone)
    ours = (
        f"{len(base.names)} parameters: {len(base.alone)} alone ({', '.join(base.alone)}), {len(base.grouped)} "
        f"in {sums} "
        f"sums, {len(base.unidentifiable)} without effect ({', '.join(base.unidentifiable)}); rank {len(base)}"
    )
    same = (len(base.alone), len(base.grouped), len(base.unidentifiable)) == _printed_counts(printed)
    yield Claim(
        "abstract; section 5",
        f"of {printed.parameters} parameters {printed.alone} identifiable alone, {printed.combinations} in linear "
        f"combinations, {printed.unidentifiable} not",
        ours,
        verdict_if(same),
        "the rank of three joint torques in the 30 parameters; the same from an independent dynamics engine in "
        "the tests",
    )


def _printed_counts(printed: PrintedCounts) -> tuple[int, int, int]:
    return printed.alone, printed.combinations, printed.unidentifiable


def _reading_claims(evidence: Evidence) -> Iterator[Claim]:
    """Which literal reading of the paper's equations gives its counts, and which its list."""
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
            f" against Table 4 missing: {_join_names(listed - seen)}; too many: {_join_names(seen - listed)}",
            verdict_if(counts == _printed_counts(printed) and seen == listed),
            _explain_reading(
                reading, found, counts == _printed_counts(printed), seen - listed, last if listed < seen else []
            ),
        )


def _explain_reading(reading: Reading, found: Identifiability, counts: bool, extra: set[str], last: list[str]) -> str:
    """last: the end of the sentence if every parameter of Table 4 has an effect."""
    combined = _join_names(set(found.combined))
    if counts:
        return f"the counts, not the list; in combination are {combined}"
    if last and set(last) <= set(found.combined):
        return (
            f"not the counts, but the list: all of Table 4 has an effect, and {_join_names(extra)} alone besides. "
            "In two pairs "
            f"are {combined}; Table 4 ends with one of each, {' and '.join(last)}. So {_join_names(extra)} dropped "
            "as dependent "
            "gives 22 kept and 8 dropped columns, and the two at the end as 'combinations' give 20 + 2 + 8. "
            "This reading "
            "has P in the wrong frame, no gravity, the moment about a wrong axis and misnamed inertias"
        )
    measured = (
        "six components of each joint's wrench" if reading.rows == "wrench" else "moments not about the joint's axis"
    )
    return f"neither the counts nor the list; takes {measured} as measured"


def _list_claims(evidence: Evidence) -> Iterator[Claim]:
    named, table = evidence.paper.named, evidence.paper.table4
    twice = [name for name, count in Counter(named).items() if count > 1]
    yield Claim(
        "section 5, after Figure 5, against Table 4",
        f"{len(named)} identified parameters are named",
        f"{len(set(named))} different ones; twice: {', '.join(twice)}; in Table 4 but not in the text: "
        f"{_join_names(set(table) - set(named))}; in the text but not in Table 4: "
        f"{_join_names(set(named) - set(table))}",
        verdict_if(set(named) == set(table)),
        "from the printed lists",
    )
    base = evidence.best.problem.base
    effective = [name for name in table if name not in base.unidentifiable]
    alone = [name for name in table if name in base.alone]
    yield Claim(
        "Table 4",
        f"{len(table)} parameters identified one by one",
        f"{len(alone)} of them identifiable alone ({', '.join(alone)}), {len(effective) - len(alone)} only in sums, "
        f"{len(table) - len(effective)} without effect ({_join_names(set(table) - set(effective))})",
        verdict_if(len(alone) == len(table)),
        "from the rank of the three joint torques; a parameter without effect cannot be estimated at all",
    )


def _join_names(names: set[str]) -> str:
    return ", ".join(sorted(names)) or "none"


_EXACT_TOLERANCE = 1e-6


def value_claims(evidence: Evidence) -> list[Claim]:
    """Exactness with and without noise, Table 4 number by number, and eq. 49-53."""
    return [*_exactness_claims(evidence), *_value_claims(evidence), *_inertia_claims(evidence)]


def _exactness_claims(evidence: Evidence) -> Iterator[Claim]:
    found = evidence.found
    yield Claim(
        "Table 4",
        "without noise the identified values equal the ideal ones",
        f"base parameters (sums): largest relative error {found.relative_error.max():.1e}",
        verdict_if(bool(found.relative_error.max() < _EXACT_TOLERANCE)),
        "reproduced for the sums, within 1e-6; the single parameters follow",
    )
    ratio = found.spread / found.predicted
    worst = np.max(np.abs(found.bias) / found.spread)
    yield Claim(
        "Table 4, beyond the paper",
        "nothing is said of noise",
        f"with encoder and torque noise the standard deviations are {ratio.min():.2f} to {ratio.max():.2f} times the "
        f"predicted ones, the largest bias is {worst:.2f} standard deviations",
        "cannot be checked",
        "missing: the paper's noise; ours is in the configuration",
    )


def _value_claims(evidence: Evidence) -> Iterator[Claim]:
    table = listed_parameters(evidence.best, evidence.found, evidence.paper)
    reasons = {
        "alone": "identifiable alone: least squares gives the true value",
        "in a sum": "torques depend on it only through a sum with others, so that its own value is free",
        "no effect": "no torque depends on it, so that no value can be found",
    }
    for row in table.to_dict("records"):
        ideal, identified, status = row["printed ideal"], row["printed identified"], row["ours"]
        exact = abs(row["least norm"] - row["true"]) <= _EXACT_TOLERANCE * max(abs(row["true"]), 1.0)
        yield Claim(
            "Table 4",
            f"{row['parameter']}: ideal {ideal:g}, identified {identified:g}",
            f"{status}; least squares of least norm gives {row['least norm']:.6g}, true {row['true']:.6g}",
            verdict_if(status == "alone" and exact),
            reasons[status],
        )
    yield _largest_errors_claim(evidence)


def _largest_errors_claim(evidence: Evidence) -> Claim:
    errors = np.array([abs(row.identified - row.ideal) for row in evidence.paper.table4.values()])
    largest = np.array(list(evidence.paper.table4))[np.argsort(errors)[-2:][::-1]]
    return Claim(
        "Table 4",
        f"identification errors up to {errors.max():.2g}",
        f"the largest printed errors are those of {largest[0]} and {largest[1]}; with double precision a "
        "full-rank problem "
        f"of this size leaves {np.abs(evidence.found.exact - evidence.found.true).max() * 1e6:.0e} kg mm²",
        "cannot be checked",
        "missing: the observation matrix; errors far above rounding point to one that is nearly without full rank",
    )


def _inertia_claims(evidence: Evidence) -> Iterator[Claim]:
    paper, printed = evidence.paper.table4, evidence.paper.eq49_53
    whole = {
        "m2": printed.masses[1],
        "m3": printed.masses[2],
        "Iyy1": printed.inertias[0][1],
        **{f"I{axis}2": printed.inertias[1][i] for i, axis in enumerate(("xx", "yy", "zz"))},
        **{f"I{axis}3": printed.inertias[2][i] for i, axis in enumerate(("xx", "yy", "zz"))},
    }
    cut = [name for name, value in whole.items() if paper[name].ideal == int(value)]
    moments = {"mcx2": printed.first_moments[1][0], "mcx3": printed.first_moments[2][0]}
    apart = ", ".join(f"{name} {value:g} against {paper[name].ideal:g}" for name, value in moments.items())
    yield Claim(
        "eq. 49-53 against Table 4",
        "one set of inertial parameters",
        f"{len(cut)} of {len(whole)} masses and inertias of Table 4 are those of eq. 49-53 cut to whole "
        "numbers; the first "
        f"moments are others: {apart}",
        verdict_if(all(paper[name].ideal == value for name, value in {**whole, **moments}.items())),
        "from the printed numbers",
    )
    about_frame = _inertias_about_centre(evidence)
    yield Claim(
        "Table 4, link 2",
        "inertias about the link's frame (eq. 17)",
        f"about the centre of mass they would be {', '.join(f'{value:.0f}' for value in about_frame)} kg mm²",
        verdict_if(bool(about_frame.sum() >= 2 * about_frame.max())),
        "no body has a moment of inertia larger than the sum of the two others; so they are about the centre of mass",
    )


def _inertias_about_centre(evidence: Evidence) -> Array:
    """Table 4's inertias of link 2, read about the link's frame, moved to its centre of mass on x, kg mm2."""
    table = evidence.paper.table4
    shift = table["mcx2"].ideal ** 2 / table["m2"].ideal
    return np.array([table["Ixx2"].ideal, table["Iyy2"].ideal - shift, table["Izz2"].ideal - shift])
