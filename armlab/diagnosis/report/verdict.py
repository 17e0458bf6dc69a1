"""The verdict for a reader in a hurry: what is missing and what that gains, and the lines for the terminal."""

from collections.abc import Iterator
from dataclasses import dataclass
from textwrap import wrap

import numpy as np

from armlab.common.report.wording import count_of, format_number
from armlab.diagnosis.report.residuals import (
    ShownResiduals,
    correlation_seconds,
    filter_correlation_seconds,
    is_white,
    select_residuals,
)
from armlab.diagnosis.report.sentences import claim_figures, findings_in_sentences, model_in_words, simulated_figures
from armlab.diagnosis.report.words import (
    chance_in_words,
    compared_in_words,
    finding_in_words,
    format_fixed,
    format_gap,
    format_growth,
    format_probability,
    format_share,
    joint_unit,
    rival_in_words,
    shorten_name,
    variables_in_words,
)
from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Unexplained
from armlab.diagnosis.simulation import Simulation
from armlab.diagnosis.story import claims_by_share, story_sentence, tell_story
from armlab.effects.contract import UNKNOWN
from armlab.effects.links import PAYLOAD_FACTS
from armlab.recordings.reading.answer import SetupFinding
from problem.arm import Arm
from problem.joint_words import joint_in_table, joint_in_words

MAX_NAMED_FINDINGS = 4  # differences that the verdict names; the others are counted
MAX_WORDS_IN_SIGHT = 80  # of all findings in sentences on the first screen; more are folded


def verdict_sentences(diagnosis: Diagnosis) -> tuple[str, str]:
    """What is missing, and how much better the model is with it."""
    setup = diagnosis.setup.sentence if diagnosis.setup else ""
    if setup:
        physics = " ".join(_findings_and_gain(diagnosis))
        return setup, physics if diagnosis.claims else diagnosis.summary.removeprefix(setup).strip()
    if diagnosis.status == "inconclusive":
        return "These recordings allow no verdict.", diagnosis.summary
    if diagnosis.status == "none":
        if not diagnosis.fit:  # physics was not asked
            return diagnosis.summary, ""
        worst, simulation = max(diagnosis.fit, key=lambda each: each.after), diagnosis.simulation
        size = _largest_error_text(worst, simulation.arm)
        left = f"The largest error on held-out data is {size}." if size else ""
        return f"Nothing is missing: {model_in_words(simulation)} explains the recordings down to their noise.", left
    return _findings_and_gain(diagnosis)


def _findings_and_gain(diagnosis: Diagnosis) -> tuple[str, str]:
    """All that is missing, and what it gains; nothing without findings."""
    claims = [claim for claim, _ in claims_by_share(diagnosis)]
    if not claims:
        return "", ""
    return findings_in_sentences(claims, diagnosis.simulation, MAX_NAMED_FINDINGS), gain_sentence(diagnosis)


@dataclass(frozen=True)
class FirstScreen:
    """What a reader sees first: a headline, paragraphs below it, and all findings in words where these are folded."""

    headline: str
    paragraphs: tuple[str, ...]
    folded: str = ""


def first_screen(diagnosis: Diagnosis) -> FirstScreen:
    """A mistake of the reading first, else where the error comes from, else the verdict itself."""
    first, second = verdict_sentences(diagnosis)
    chapters = tell_story(diagnosis)
    if not chapters:
        return FirstScreen(first, (second,) if second else ())
    setup = diagnosis.setup.sentence if diagnosis.setup else ""
    findings, gain = _findings_and_gain(diagnosis)
    folded = findings if len(findings.split()) > MAX_WORDS_IN_SIGHT else ""
    shown = _count_sentence(diagnosis) if folded else findings
    story = story_sentence(chapters, diagnosis.simulation.arm)
    if setup:
        return FirstScreen(
            setup, (f"Of the recording read rightly: {story[0].lower()}{story[1:]}", shown, gain), folded
        )
    return FirstScreen(story, (shown, gain), folded)


def _count_sentence(diagnosis: Diagnosis) -> str:
    """What stands on the first screen in the place of many findings."""
    return (
        f"{count_of(len(diagnosis.claims), 'finding')}: each joint beside the drawing has its own, those that explain "
        "most first; their numbers stand in the table below."
    )


def _largest_error_text(worst: JointFit, arm: Arm) -> str:
    size = joint_unit(arm, worst.joint - 1)
    where, noise = joint_in_words(arm, worst.joint), format_number(worst.noise_floor)
    return f"{format_number(worst.after)} {size} ({where}, noise {noise} {size})"


def gain_sentence(diagnosis: Diagnosis) -> str:
    """How far the held-out error falls at the joint of a finding that gains most, and what noise is there.

    The start is what is compared: the simulation as given, else the refitted rigid body.
    """
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
    with_it = "With it" if len(diagnosis.claims) == 1 else "With these"
    most = "most " if len(diagnosis.fit) > 1 else ""
    falls = f"falls {most}at" if best.after < start[joint] else "does not fall; at"
    return (
        f"{with_it} the error on held-out data {falls} {joint_in_words(arm, best.joint)}: "
        f"from {format_fixed(float(start[joint]))} {size} ({compared_in_words(diagnosis.simulation)}) "
        f"to {format_fixed(best.after)} {size}; the noise floor there is {format_fixed(best.noise_floor)} {size}."
        f"{_rest_sentence(diagnosis, data, joint)}"
    )


def _rest_sentence(diagnosis: Diagnosis, data: ShownResiduals | None, joint: int) -> str:
    """What is left at a joint (from 0) where that is more than noise; empty where it is noise as far as one can see."""
    best, arm = diagnosis.fit[joint], diagnosis.simulation.arm
    if data is None or best.after <= best.noise_floor:
        return ""
    for each in diagnosis.unexplained:
        if each.joint == best.joint:
            variables = variables_in_words(arm, each.depends_on)
            return (
                f" {100 * each.share:.0f} % of the variance that is left there depends on {variables}, "
                f"in a way that no known effect has{_floor_clause(best, each)}."
            )
    residual = data.final[:, joint]
    if is_white(residual, joint, data.observed):
        return ""
    own, noise = correlation_seconds(residual, joint, data.observed), filter_correlation_seconds(data.observed)
    return (
        f" What is left there changes more slowly than noise (over {1e3 * own:.0f} ms, noise over "
        f"{1e3 * noise:.0f} ms), but the recorded motion does not predict it."
    )


def _floor_clause(fit: JointFit, unexplained: Unexplained) -> str:
    """That the floor holds what has no name, where it is too high to be noise alone."""
    is_in_floor = fit.noise_floor**2 > (1 - unexplained.share) * fit.after**2
    return "; the noise floor holds it, too" if is_in_floor else ""


def _unknown_gain_sentence(diagnosis: Diagnosis, claim: Claim) -> str:
    """A surrogate tells how much there is to explain; it is no physics."""
    evidence, arm = claim.evidence, diagnosis.simulation.arm
    size, where = joint_unit(arm, evidence.joint), joint_in_words(arm, evidence.joint + 1)
    variables = variables_in_words(arm, claim.depends_on)
    if evidence.rms_after >= evidence.rms_before:
        return f"It depends on {variables}, in a way that does not repeat on held-out data of {where}."
    return (
        f"It depends on {variables}: a curve of these lowers the error of {where} on held-out data "
        f"from {format_fixed(evidence.rms_before)} to {format_fixed(evidence.rms_after)} {size}; "
        f"the noise floor there is {format_fixed(diagnosis.fit[evidence.joint].noise_floor)} {size}."
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
        variables = variables_in_words(arm, each.depends_on)
        yield f"  unexplained: {100 * each.share:.0f} % of {joint_in_words(arm, each.joint)}, by {variables}"
    yield from _error_lines(diagnosis)


def _error_lines(diagnosis: Diagnosis) -> Iterator[str]:
    """The table of held-out errors, with the number of each joint that the equations have."""
    fits, arm, data = diagnosis.fit, diagnosis.simulation.arm, select_residuals(diagnosis)
    if not fits:
        return
    given = None if data is None or data.given is None else data.held_out_rms(data.given).tolist()
    first = "" if given is None else f"{'as given':>11}"
    filtered = "" if data is None else f" of torque {data.filtered}"
    names = [shorten_name(joint_in_table(arm, fit.joint).replace("\N{NO-BREAK SPACE}", " ")) for fit in fits]
    width = max(len("joint"), *map(len, names))
    yield f"  errors on held-out data, rms{filtered}:"
    yield f"  {'joint':<{width}}{first}   refitted      found      noise   gap closed"
    for name, fit in zip(names, fits, strict=True):
        closed = format_gap(fit.gap_closed)
        values = [*([] if given is None else [given[fit.joint - 1]]), fit.before, fit.after, fit.noise_floor]
        errors = "".join(f"{format_number(value):>11}" for value in values)
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
    present = simulated_figures(claim)
    law = f"{law}; the simulation has {present}" if present else law
    lines = wrap(f"{finding_in_words(arm, claim)}: {law}", LINE_WIDTH - 5)
    yield f"{number:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    where, growth = joint_in_words(arm, evidence.joint + 1), format_growth(evidence.rms_before, evidence.rms_after)
    probability = format_probability(evidence.corrected)
    gain = f"{format_share(share)} of the error; without it the held-out error of {where} is {growth}; p {probability}"
    chance = chance_in_words(arm, claim)
    whole = f"{gain}; {chance}" if chance else gain
    yield from (f"     {line}" for line in wrap(whole, LINE_WIDTH - 5))
    same = ", ".join(rival_in_words(arm, each) for each in claim.rivals if each.identical)
    if same:
        yield from (f"     {line}" for line in wrap(f"no such motion tells it from {same}", LINE_WIDTH - 5))
    if claim.next_experiment:
        yield from (f"     {line}" for line in wrap(f"to tell: {claim.next_experiment}", LINE_WIDTH - 5))
