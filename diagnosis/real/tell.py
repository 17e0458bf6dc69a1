"""The diagnoses of real arms as Markdown."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import chi2, norm

from armlab.diagnosis.result import Diagnosis, Parameter
from diagnosis.real.study import RealStudy, RunGain, added_mass
from diagnosis.report.words import joint_unit, number, place, plain, probability, rows_of, told, verdict_sentences

SPRINGS = ("gravity_compensator", "cable_stiffness")
AGREE = 0.01
INTRODUCTION = """\
# Real arms, diagnosed with only the rigid body given

Percent: `||tau - tau_hat|| / ||tau||` over all joints, filtered torque, on data that took no part in any fit.
They are not untouched: bounds and forms of the diagnosis were chosen after earlier looks at them, each of which is in
`validation_looks.jsonl`. What judges the diagnosis on data that nobody had seen is `results/proof/`.
As given: the CAD links where the source publishes them. Refitted: base parameters fitted, nothing else. Found: with
every finding, and with the surrogate where something is unknown. Best known: the figure of a published or hand-made
model of that run. What is not sure is not named: an unknown stands with what it depends on.
"""


def markdown(studies: Sequence[RealStudy]) -> str:
    """The whole page."""
    return INTRODUCTION + "".join(f"\n{line}" for each in studies for line in _study(each)) + "\n"


def _study(found: RealStudy) -> Iterator[str]:
    diagnosis = found.diagnosis
    first, second = verdict_sentences(diagnosis)
    yield f"## {found.name}\n"
    yield f"{first} {second}\n"
    yield from gain_table(found.gains)
    if diagnosis.claims:
        yield from _claims(diagnosis)
    for each in diagnosis.unexplained:
        depends = ", ".join(each.depends_on)
        yield f"Unexplained at joint {each.joint}: {100 * each.share:.0f} % of the held-out variance, by {depends}.\n"
    if found.alone:
        yield from _alone(found)


def gain_table(gains: Sequence[RunGain]) -> Iterator[str]:
    """Errors of each run that took no part."""
    yield "| run | as given | refitted | found | best known |"
    yield "|---|---:|---:|---:|---:|"
    for each in gains:
        cells = (_percent(each.given), _percent(each.refitted), _percent(each.found), _percent(each.best_known))
        yield f"| {each.run} | {' | '.join(cells)} |"
    yield ""


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f} %"


def _claims(diagnosis: Diagnosis) -> Iterator[str]:
    yield "| finding | where | law | held-out error without, with it | p | fits as well |"
    yield "|---|---|---|---|---|---|"
    for claim in diagnosis.claims:
        evidence = claim.evidence
        size = joint_unit(diagnosis.simulation.arm, evidence.joint)
        error = f"{number(evidence.rms_before)}, {number(evidence.rms_after)} {size} (joint {evidence.joint + 1})"
        rivals = "; ".join(
            f"{plain(each.effect)}, {place(each.effect, each.joint, each.joints)}" for each in claim.rivals
        )
        law = claim.equation.replace("|", "\\|")
        where = place(claim.effect, claim.joint, claim.joints)
        p_value = probability(evidence.corrected)
        yield f"| {plain(claim.effect)} | {where} | `{law}` | {error} | {p_value} | {rivals or '–'} |"
    yield ""


def _alone(found: RealStudy) -> Iterator[str]:
    """What each run by itself says of the links: the same load should come out of each."""
    yield "Each run by itself (blocks of time held out), what it says of the links:\n"
    masses: list[Parameter] = []
    for run, diagnosis in found.alone:
        told_masses, own = [], list[Parameter]()
        for claim in added_mass(diagnosis):
            for parameter in (each for each in claim.parameters if each.name == "mass"):
                own.append(parameter)
                (row,) = rows_of(parameter)
                told_masses.append(f"{told(claim)}, mass {row.value} kg ({row.interval})")
        masses += sorted((each for each in own if each.interval), key=_width)[:1]  # one a run: its surest
        springs = [told(each) for each in diagnosis.claims if each.effect in SPRINGS]
        yield f"- {run}: {'; '.join([*told_masses, *springs]) or 'nothing'}"
    yield f"\n{agreement(masses)}\n"


def _width(parameter: Parameter) -> float:
    return float(np.ptp(np.array(parameter.interval, dtype=float)))


def agreement(masses: Sequence[Parameter]) -> str:
    """Whether masses with intervals can be one mass: chi-square of their weighted mean."""
    sized = [each for each in masses if each.interval]
    if len(sized) < 2:
        return "Too few of them give a mass to be compared."
    values = np.array([each.value for each in sized], dtype=float)
    widths = np.array([_width(each) for each in sized])
    weights = 1 / (widths / (2 * float(norm.ppf(0.975)))) ** 2
    mean = float(weights @ values / weights.sum())
    p_value = float(chi2.sf(float(weights @ (values - mean) ** 2), len(values) - 1))
    word = "agree" if p_value > AGREE else "do not agree within their intervals"
    return f"{len(values)} masses, weighted mean {mean:.4g} kg: they {word} (p {probability(p_value)})."
