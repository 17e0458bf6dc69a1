"""What section 5 says of the arm, the settings and the optimised trajectory, and what Tables 1 and 2 print."""

from collections.abc import Iterator

import numpy as np

from bench.paper.claims import Claim, close, held
from bench.paper.evidence import Evidence

_MISSING = (
    "missing: the fundamental frequency, the number of samples, the centre of the path, the tool point, and "
    "which columns "
    "of the observation matrix were kept"
)


def trajectory_claims(evidence: Evidence) -> list[Claim]:
    """Tables 1 and 2, the fitness that ends a run, the published coefficients and their condition number."""
    return [*_tables(evidence), *_ends(evidence), *_coefficients(evidence), *_condition_number(evidence)]


def _tables(evidence: Evidence) -> Iterator[Claim]:
    deviations, differences = evidence.deviations, evidence.differences
    yield Claim(
        "Table 1",
        "D-H parameters and ranges of the IRB 120",
        "; ".join(deviations) or "no deviation",
        held(not deviations),
        "lengths and twists agree; the ranges that deviate are not the robot's by its data sheet",
    )
    yield Claim(
        "Table 2 and section 2",
        "parameters of the algorithms",
        "; ".join(differences) or "all in force as printed",
        held(not differences),
        "the paper names no speed limit, and Table 2 none of the remaining constants of WOA and GOA",
    )


def _ends(evidence: Evidence) -> Iterator[Claim]:
    values = evidence.frames["table3"]["value"]
    threshold = evidence.paper.table2["mupso"]["abandonment_threshold"]
    yield Claim(
        "eq. 7, section 2",
        f"a run ends when its fitness falls below {threshold:g}",
        f"least condition number of all runs {values.min():.3g}; none ended so",
        held(bool(values.min() <= threshold)),
        "a condition number is at least 1, so this end cannot happen; for the same reason every stagnation mutates",
    )


def _coefficients(evidence: Evidence) -> Iterator[Claim]:
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
        held(reached > 0),
        "evaluated for six durations, two tool points, two centres, both elbows, with and without the rest of eq. 48",
    )
    yield Claim(
        "section 5, coefficients b and c; eq. 48",
        "the motion starts and ends at rest",
        f"sum of b = {sum(optimum.b):.3g}, c = {optimum.c:g}; at rest both would be 0",
        held(bool(np.isclose(sum(optimum.b), 0) and np.isclose(optimum.c, 0))),
        "the speed of the Fourier part at both ends is sum b, its acceleration proportional to c times sum k",
    )


def _condition_number(evidence: Evidence) -> Iterator[Claim]:
    printed = evidence.paper.optimum.condition_number
    finite = [reading for reading in evidence.published if np.isfinite(reading.value)]
    nearest = min(finite, key=lambda reading: abs(np.log(reading.value / printed)))
    least = min(finite, key=lambda reading: reading.value)
    agrees = close(nearest.value, printed)
    yield Claim(
        "section 5, after Figure 3",
        f"condition number {printed:g} with the published coefficients",
        f"nearest {nearest.value:.4g} ({nearest}); least {least.value:.4g}; no value in Cartesian space, where "
        "the path "
        "leaves the reach",
        "reproduced" if agrees else "cannot be checked",
        "one convention agrees within 10 %" if agrees else _MISSING,
    )
    row = evidence.paper.table3.rows["mupso"]
    yield Claim(
        "section 5 against Table 3",
        f"the trajectory obtained from the MuPSO has {printed:g}",
        f"Table 3 prints {row.minimum:g} as MuPSO's minimum and {row.average:g} as its average",
        held(close(printed, row.minimum)),
        "from the printed numbers: the final trajectory is not the best one found, but like an average one",
    )
