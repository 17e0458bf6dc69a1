"""What Table 4 says of the identified values, and whether its parameters are one set with eq. 49-53."""

from collections.abc import Iterator

import numpy as np

from bench.paper.claims import Claim, held
from bench.paper.evidence import Evidence
from bench.paper.table4 import listed_parameters
from problem.transforms import Array

_EXACT = 1e-6


def value_claims(evidence: Evidence) -> list[Claim]:
    """Exactness with and without noise, Table 4 number by number, and eq. 49-53."""
    return [*_exactness(evidence), *_values(evidence), *_inertias(evidence)]


def _exactness(evidence: Evidence) -> Iterator[Claim]:
    found = evidence.found
    yield Claim(
        "Table 4",
        "without noise the identified values equal the ideal ones",
        f"base parameters (sums): largest relative error {found.relative_error.max():.1e}",
        held(bool(found.relative_error.max() < _EXACT)),
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


def _values(evidence: Evidence) -> Iterator[Claim]:
    table = listed_parameters(evidence.best, evidence.found, evidence.paper)
    reasons = {
        "alone": "identifiable alone: least squares gives the true value",
        "in a sum": "torques depend on it only through a sum with others, so that its own value is free",
        "no effect": "no torque depends on it, so that no value can be found",
    }
    for row in table.to_dict("records"):
        ideal, identified, status = row["printed ideal"], row["printed identified"], row["ours"]
        exact = abs(row["least norm"] - row["true"]) <= _EXACT * max(abs(row["true"]), 1.0)
        yield Claim(
            "Table 4",
            f"{row['parameter']}: ideal {ideal:g}, identified {identified:g}",
            f"{status}; least squares of least norm gives {row['least norm']:.6g}, true {row['true']:.6g}",
            held(status == "alone" and exact),
            reasons[status],
        )
    yield _largest_errors(evidence)


def _largest_errors(evidence: Evidence) -> Claim:
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


def _inertias(evidence: Evidence) -> Iterator[Claim]:
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
        held(all(paper[name].ideal == value for name, value in {**whole, **moments}.items())),
        "from the printed numbers",
    )
    about_frame = _principal_about_centre(evidence)
    yield Claim(
        "Table 4, link 2",
        "inertias about the link's frame (eq. 17)",
        f"about the centre of mass they would be {', '.join(f'{value:.0f}' for value in about_frame)} kg mm²",
        held(bool(about_frame.sum() >= 2 * about_frame.max())),
        "no body has a moment of inertia larger than the sum of the two others; so they are about the centre of mass",
    )


def _principal_about_centre(evidence: Evidence) -> Array:
    """Table 4's inertias of link 2, read about the link's frame, moved to its centre of mass on x, kg mm2."""
    table = evidence.paper.table4
    shift = table["mcx2"].ideal ** 2 / table["m2"].ideal
    return np.array([table["Ixx2"].ideal, table["Iyy2"].ideal - shift, table["Izz2"].ideal - shift])
