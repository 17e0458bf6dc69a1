"""A diagnosis in words: effects, places, numbers with units, the verdict in two sentences, and the lines for the
terminal.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import wrap

import numpy as np

from armlab.diagnosis.report.residuals import is_white, select_residuals
from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Rival
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named
from armlab.effects.parameters import ParameterValue
from armlab.recordings.reading.answer import SetupFinding
from problem.arm import Arm

MAX_NAME_LENGTH = 24  # letters
PARAMETER_DIGITS = 4  # of a parameter
COMPONENT_NAMES = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "xz", "yz")}
MAX_NAMED_FINDINGS = 3  # findings that the verdict names; the others are counted


def effect_in_words(effect: str) -> str:
    """The name of an effect in a sentence; ValueError for an id that no effect has."""
    return effect_named(effect).words


def place_in_words(effect: str, joint: int | None, joints: Sequence[int] = ()) -> str:
    """Where an effect is: a joint, a link, a coupling, or the whole robot."""
    if joint is None:
        return "the whole robot"
    if effect_named(effect).where == "link":
        return f"link {joint}"
    return f"joint {joint} from joint {joints[1]}" if len(joints) > 1 else f"joint {joint}"


def finding_in_words(claim: Claim | Rival) -> str:
    """An effect with its place."""
    if claim.effect == UNKNOWN.id:
        return f"something unknown at {place_in_words(claim.effect, claim.joint)}"
    where = place_in_words(claim.effect, claim.joint, claim.joints)
    return f"{effect_in_words(claim.effect)} {'of' if claim.joint is None else 'at'} {where}"


def shorten_name(name: str) -> str:
    """The name of a file, cut to MAX_NAME_LENGTH letters."""
    return name if len(name) <= MAX_NAME_LENGTH else f"{name[: MAX_NAME_LENGTH - 1]}…"


def format_number(value: float, digits: int = 3) -> str:
    """A number with `digits` significant digits, and with an exponent only where it is very large or small."""
    if not math.isfinite(value):
        return "none" if math.isnan(value) else ("∞" if value > 0 else "−∞")
    size = abs(value)
    text = f"{value:.{digits}g}"
    if 10**digits <= size < 1e6:
        text = f"{value:.0f}"
    elif size >= 1e6 or 0 < size < 1e-4:
        text = f"{value:.{digits - 1}e}"
    return text.replace("-", "−")


def format_unit(text: str) -> str:
    """A unit as people write it: N m s/rad, kg m²."""
    return "" if text == "1" else text.replace("m2", "m²").replace("s2", "s²").replace(".", " ")


def joint_unit(arm: Arm, joint: int) -> str:
    """Unit of the torque (force) of a joint, from 0."""
    return "N m" if arm.joints[joint].kind == "revolute" else "N"


@dataclass(frozen=True)
class ParameterRow:
    """One number of a finding as the page shows it."""

    name: str
    value: str
    interval: str
    unit: str


def parameter_rows(parameter: ParameterValue) -> list[ParameterRow]:
    """A parameter as rows, a vector's components one by one."""
    values = np.atleast_1d(np.array(parameter.value, dtype=float)).tolist()
    interval = parameter.interval
    pairs = [None] * len(values) if interval is None else np.array(interval, dtype=float).reshape(-1, 2).tolist()
    names = [parameter.name]
    if len(values) > 1:
        names = [f"{parameter.name} {part}" for part in COMPONENT_NAMES.get(len(values), range(1, len(values) + 1))]
    size = format_unit(parameter.unit)
    return [
        ParameterRow(
            name, format_number(value, PARAMETER_DIGITS), "–" if pair is None else _format_interval(*pair), size
        )
        for name, value, pair in zip(names, values, pairs, strict=True)
    ]


def _format_interval(low: float, high: float) -> str:
    return f"{format_number(low, PARAMETER_DIGITS)} to {format_number(high, PARAMETER_DIGITS)}"


def format_probability(value: float) -> str:
    """A p-value with three digits; a smaller one than 1e-12 only as this bound."""
    return "below 1e−12" if value < 1e-12 else format_number(value)


def format_share(value: float) -> str:
    """A share in percent, `below 0.1 %` where it is that small."""
    return "below 0.1 %" if 0 <= value < 0.001 else f"{100 * value:.1f} %"


def format_gap(closed: float | None) -> str:
    """The share of a gap that is closed: 100 % at most, as the noise floor is an estimate too."""
    return "–" if closed is None else f"{100 * min(closed, 1.0):.1f} %"


def verdict_sentences(diagnosis: Diagnosis) -> tuple[str, str]:
    """What is missing, and how much better the model is with it."""
    setup = diagnosis.setup.sentence if diagnosis.setup else ""
    if setup:
        return setup, diagnosis.summary.removeprefix(setup).strip()
    if diagnosis.status == "inconclusive":
        return "These recordings allow no verdict.", diagnosis.summary
    worst = max(diagnosis.fit, key=lambda each: each.after, default=None)
    arm = diagnosis.simulation.arm
    subject = "The rigid-body model" if diagnosis.simulation.kind == "refit" else "The simulation"
    if diagnosis.status == "none":
        left = f"On data that took no part the largest error is {_largest_error_text(worst, arm)}." if worst else ""
        return f"Nothing is missing: t{subject[1:]} explains the recordings down to their noise.", left
    return f"{subject} of {arm.name} misses {_list_findings(diagnosis.claims)}.", gain_sentence(diagnosis)


def _largest_error_text(worst: JointFit, arm: Arm) -> str:
    size = joint_unit(arm, worst.joint - 1)
    return f"{format_number(worst.after)} {size} (joint {worst.joint}, noise {format_number(worst.noise_floor)} {size})"


def _list_findings(claims: Sequence[Claim]) -> str:
    known = [_finding_with_rivals(claim) for claim in claims if claim.effect != UNKNOWN.id]
    unknown = [f"joint {claim.joint}" for claim in claims if claim.effect == UNKNOWN.id]
    parts = known[:MAX_NAMED_FINDINGS]
    if len(known) > MAX_NAMED_FINDINGS:
        parts.append(
            f"{len(known) - MAX_NAMED_FINDINGS} more effect{'s' if len(known) > MAX_NAMED_FINDINGS + 1 else ''} (below)"
        )
    if unknown:
        parts.append(f"something that no known effect explains at {join_words(unknown)}")
    return join_words(parts)


def _finding_with_rivals(claim: Claim) -> str:
    rivals = list(dict.fromkeys(effect_in_words(each.effect) for each in claim.rivals if each.effect != claim.effect))
    return finding_in_words(claim) + (f" (or {join_words(rivals, 'or')})" if rivals else "")


def gain_sentence(diagnosis: Diagnosis) -> str:
    """How far the held-out error falls at the joint that gains most, and its share of the gap to the noise."""
    data = select_residuals(diagnosis)
    refit = np.array([each.before for each in diagnosis.fit])
    start = refit if data is None or data.given is None else data.held_out_rms(data.given)
    after = np.array([each.after for each in diagnosis.fit])
    joint = int(np.argmax(start / np.maximum(after, 1e-300)))
    best = diagnosis.fit[joint]
    size = joint_unit(diagnosis.simulation.arm, joint)
    before = f"{format_number(best.before)} {size} with the rigid body refitted"
    if start is not refit:
        before = f"{format_number(float(start[joint]))} {size} ({before})"
    closed = "" if best.gap_closed is None else f", {100 * min(best.gap_closed, 1.0):.0f} % of the way to the noise"
    if data is not None and not is_white(data.final[:, joint], joint, data.observed):
        closed = "; what is left there still holds structure"
    this = "With it" if len(diagnosis.claims) == 1 else "With these"
    return (
        f"{this} the error on data that took no part falls from {before} to {format_number(best.after)} {size} "
        f"at joint {best.joint}{closed}."
    )


def join_words(parts: Sequence[str], last: str = "and") -> str:
    """a, b and c."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} {last} {parts[-1]}"


LINE_WIDTH = 110  # letters in a line of the terminal


def verdict_lines(diagnosis: Diagnosis) -> Iterator[str]:
    """The verdict, each finding with its equation, errors before and after, and what to do next."""
    first, second = verdict_sentences(diagnosis)
    yield from wrap(f"{diagnosis.status.upper()}: {first} {second}", LINE_WIDTH)
    for sign in diagnosis.signs:
        yield from (f"  {line}" for line in wrap(f"warning: {sign.text}", LINE_WIDTH - 2))
    setup = diagnosis.setup.findings if diagnosis.setup else ()
    for number, mistake in enumerate(setup, 1):
        yield from _setup_lines(number, mistake, joint_unit(diagnosis.simulation.arm, mistake.worst_joint - 1))
    for number, claim in enumerate(diagnosis.claims, len(setup) + 1):
        yield from _claim_lines(number, claim, joint_unit(diagnosis.simulation.arm, claim.evidence.joint))
    for each in diagnosis.unexplained:
        yield f"  unexplained: {100 * each.share:.0f} % of joint {each.joint}, by {', '.join(each.depends_on)}"
    if diagnosis.fit:
        yield "  joint   refitted      found      noise   gap closed   (rms on data that took no part)"
    for fit in diagnosis.fit:
        closed = format_gap(fit.gap_closed)
        errors = "".join(f"{format_number(value):>11}" for value in (fit.before, fit.after, fit.noise_floor))
        yield f"  {fit.joint:>5}{errors}{closed:>13}   {joint_unit(diagnosis.simulation.arm, fit.joint - 1)}"


def _setup_lines(number: int, finding: SetupFinding, unit: str) -> Iterator[str]:
    lines = wrap(f"setup: {finding.text}", LINE_WIDTH - 5)
    yield f"{number:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    error = f"{format_number(finding.rms_before)} to {format_number(finding.rms_after)} {unit}"
    yield f"     held-out error of joint {finding.worst_joint}: {error}"
    for rival in finding.rivals:
        yield from (f"     {line}" for line in wrap(f"fits as well: {rival.text}", LINE_WIDTH - 5))
    if finding.next_experiment:
        yield from (f"     {line}" for line in wrap(f"to tell: {finding.next_experiment}", LINE_WIDTH - 5))


def _claim_lines(number: int, claim: Claim, unit: str) -> Iterator[str]:
    evidence = claim.evidence
    lines = wrap(f"{finding_in_words(claim)}: {claim.equation}", LINE_WIDTH - 5)
    yield f"{number:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    error = f"{format_number(evidence.rms_before)} to {format_number(evidence.rms_after)} {unit}"
    yield f"     held-out error of joint {evidence.joint + 1}: {error}; p {format_probability(evidence.corrected)}"
    rivals = ", ".join(
        f"{effect_in_words(each.effect)} ({place_in_words(each.effect, each.joint, each.joints)})"
        for each in claim.rivals
    )
    if rivals:
        yield from (f"     {line}" for line in wrap(f"fits as well: {rivals}", LINE_WIDTH - 5))
    if claim.next_experiment:
        yield from (f"     {line}" for line in wrap(f"to tell: {claim.next_experiment}", LINE_WIDTH - 5))
