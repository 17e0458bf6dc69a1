"""The verdict for a reader in a hurry: what is missing and what that gains, and the lines for the terminal."""

from collections.abc import Iterator, Sequence
from textwrap import wrap

import numpy as np

from armlab.common.report.numbers import format_number
from armlab.common.report.words import join_words
from armlab.diagnosis.report.residuals import is_white, select_residuals
from armlab.diagnosis.report.sentences import claim_figures, findings_in_sentences, model_in_words
from armlab.diagnosis.report.words import (
    finding_in_words,
    format_fixed,
    format_gap,
    format_probability,
    format_share,
    joint_unit,
    rival_in_words,
    shorten_name,
    variable_in_words,
)
from armlab.diagnosis.result import Claim, Diagnosis, JointFit
from armlab.diagnosis.simulation import Simulation
from armlab.diagnosis.story import claims_by_share
from armlab.effects.contract import UNKNOWN
from armlab.effects.links import PAYLOAD_FACTS
from armlab.recordings.reading.answer import SetupFinding
from problem.arm import Arm
from problem.joint_words import joint_in_table, joint_in_words

MAX_NAMED_FINDINGS = 4  # differences that the verdict names; the others are counted


def verdict_sentences(diagnosis: Diagnosis) -> tuple[str, str]:
    """What is missing, and how much better the model is with it."""
    setup = diagnosis.setup.sentence if diagnosis.setup else ""
    if setup:
        return setup, diagnosis.summary.removeprefix(setup).strip()
    if diagnosis.status == "inconclusive":
        return "These recordings allow no verdict.", diagnosis.summary
    worst = max(diagnosis.fit, key=lambda each: each.after, default=None)
    simulation = diagnosis.simulation
    if diagnosis.status == "none":
        size = "" if worst is None else _largest_error_text(worst, simulation.arm)
        left = f"The largest error on held-out data is {size}." if size else ""
        return f"Nothing is missing: {model_in_words(simulation)} explains the recordings down to their noise.", left
    claims = [claim for claim, _ in claims_by_share(diagnosis)]
    return findings_in_sentences(claims, simulation, MAX_NAMED_FINDINGS), gain_sentence(diagnosis)


def _largest_error_text(worst: JointFit, arm: Arm) -> str:
    size = joint_unit(arm, worst.joint - 1)
    where, noise = joint_in_words(arm, worst.joint), format_number(worst.noise_floor)
    return f"{format_number(worst.after)} {size} ({where}, noise {noise} {size})"


def gain_sentence(diagnosis: Diagnosis) -> str:
    """How far the held-out error falls at the joint of a finding that gains most, and what noise is there."""
    arm = diagnosis.simulation.arm
    largest, _ = claims_by_share(diagnosis)[0]
    if largest.effect == UNKNOWN.id:
        return _unknown_gain_sentence(diagnosis, largest)
    data = select_residuals(diagnosis)
    refit = np.array([each.before for each in diagnosis.fit])
    start = refit if data is None or data.given is None else data.held_out_rms(data.given)
    after = np.array([each.after for each in diagnosis.fit])
    joints = sorted({claim.evidence.joint for claim in diagnosis.claims})
    joint = joints[int(np.argmax(start[joints] / np.maximum(after[joints], 1e-300)))]
    best, size = diagnosis.fit[joint], joint_unit(arm, joint)
    white = data is None or is_white(data.final[:, joint], joint, data.observed)
    rest = "" if white or best.after <= best.noise_floor else " What is left there is not all noise."
    with_it = "With it" if len(diagnosis.claims) == 1 else "With these"
    falls = "falls" if best.after < start[joint] else "does not fall, it goes"
    return (
        f"{with_it} the error of {joint_in_words(arm, best.joint)} on held-out data {falls} "
        f"from {format_fixed(float(start[joint]))} to {format_fixed(best.after)} {size}; "
        f"its noise is {format_fixed(best.noise_floor)} {size}.{rest}"
    )


def _unknown_gain_sentence(diagnosis: Diagnosis, claim: Claim) -> str:
    """A surrogate tells how much there is to explain; it is no physics."""
    evidence, arm = claim.evidence, diagnosis.simulation.arm
    size, where = joint_unit(arm, evidence.joint), joint_in_words(arm, evidence.joint + 1)
    variables = join_words([variable_in_words(arm, name) for name in claim.depends_on])
    return (
        f"It depends on {variables}: a curve of these lowers the error of {where} on held-out data "
        f"from {format_fixed(evidence.rms_before)} to {format_fixed(evidence.rms_after)} {size}; "
        f"its noise is {format_fixed(diagnosis.fit[evidence.joint].noise_floor)} {size}."
    )


LINE_WIDTH = 110  # letters in a line of the terminal


def verdict_lines(diagnosis: Diagnosis) -> Iterator[str]:
    """The verdict, the findings with their errors and rivals, the largest first, and the error of each joint."""
    first, second = verdict_sentences(diagnosis)
    arm = diagnosis.simulation.arm
    yield from wrap(f"{diagnosis.status.upper()}: {first} {second}", LINE_WIDTH)
    for sign in diagnosis.signs:
        yield from (f"  {line}" for line in wrap(f"warning: {sign.text}", LINE_WIDTH - 2))
    setup = diagnosis.setup.findings if diagnosis.setup else ()
    for number, mistake in enumerate(setup, 1):
        yield from _setup_lines(number, mistake, arm)
    for number, (claim, share) in enumerate(claims_by_share(diagnosis), len(setup) + 1):
        yield from _claim_lines(number, claim, share, diagnosis.simulation)
    for each in diagnosis.unexplained:
        variables = join_words([variable_in_words(arm, name) for name in each.depends_on])
        yield f"  unexplained: {100 * each.share:.0f} % of {joint_in_words(arm, each.joint)}, by {variables}"
    yield from _error_lines(diagnosis.fit, arm)


def _error_lines(fits: Sequence[JointFit], arm: Arm) -> Iterator[str]:
    """The table of held-out errors, with the number of each joint that the equations have."""
    if not fits:
        return
    names = [shorten_name(joint_in_table(arm, fit.joint).replace("\N{NO-BREAK SPACE}", " ")) for fit in fits]
    width = max(len("joint"), *map(len, names))
    yield f"  {'joint':<{width}}   refitted      found      noise   gap closed   (rms on held-out data)"
    for name, fit in zip(names, fits, strict=True):
        closed = format_gap(fit.gap_closed)
        errors = "".join(f"{format_number(value):>11}" for value in (fit.before, fit.after, fit.noise_floor))
        yield f"  {name:<{width}}{errors}{closed:>13}   {joint_unit(arm, fit.joint - 1)}"


def _setup_lines(number: int, finding: SetupFinding, arm: Arm) -> Iterator[str]:
    lines = wrap(f"setup: {finding.text}", LINE_WIDTH - 5)
    yield f"{number:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    unit = joint_unit(arm, finding.worst_joint - 1)
    error = f"{format_number(finding.rms_before)} to {format_number(finding.rms_after)} {unit}"
    yield f"     held-out error of {joint_in_words(arm, finding.worst_joint)}: {error}"
    for rival in finding.rivals:
        yield from (f"     {line}" for line in wrap(f"fits as well: {rival.text}", LINE_WIDTH - 5))
    if finding.next_experiment:
        yield from (f"     {line}" for line in wrap(f"to tell: {finding.next_experiment}", LINE_WIDTH - 5))


def _claim_lines(number: int, claim: Claim, share: float, simulation: Simulation) -> Iterator[str]:
    evidence, arm = claim.evidence, simulation.arm
    law = claim_figures(claim, simulation) if claim.effect == PAYLOAD_FACTS.id else claim.equation
    lines = wrap(f"{finding_in_words(arm, claim)}: {law}", LINE_WIDTH - 5)
    yield f"{number:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    unit, where = joint_unit(arm, evidence.joint), joint_in_words(arm, evidence.joint + 1)
    error = f"{format_number(evidence.rms_before)} to {format_number(evidence.rms_after)} {unit}"
    probability = format_probability(evidence.corrected)
    gain = f"{format_share(share)} of the error; held-out error of {where}: {error}; p {probability}"
    yield from (f"     {line}" for line in wrap(gain, LINE_WIDTH - 5))
    rivals = ", ".join(rival_in_words(arm, each) for each in claim.rivals)
    if rivals:
        yield from (f"     {line}" for line in wrap(f"fits as well: {rivals}", LINE_WIDTH - 5))
    if claim.next_experiment:
        yield from (f"     {line}" for line in wrap(f"to tell: {claim.next_experiment}", LINE_WIDTH - 5))
