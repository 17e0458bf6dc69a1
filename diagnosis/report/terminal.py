"""The diagnosis as a few lines for the terminal."""

from collections.abc import Iterator
from textwrap import wrap

from armlab.diagnosis.result import Claim, Diagnosis
from diagnosis.report.words import joint_unit, number, place, plain, probability, told, verdict_sentences

WIDTH = 110


def terminal_lines(diagnosis: Diagnosis) -> Iterator[str]:
    """The verdict, each finding with its equation, errors before and after, and what to do next."""
    first, second = verdict_sentences(diagnosis)
    yield from wrap(f"{diagnosis.status.upper()}: {first} {second}", WIDTH)
    for number_, claim in enumerate(diagnosis.claims, 1):
        yield from _claim(number_, claim, joint_unit(diagnosis.simulation.arm, claim.evidence.joint))
    for each in diagnosis.unexplained:
        yield f"  unexplained: {100 * each.share:.0f} % of joint {each.joint}, by {', '.join(each.depends_on)}"
    if diagnosis.fit:
        yield "  joint   refitted      found      noise   gap closed   (rms on data that took no part)"
    for fit in diagnosis.fit:
        closed = "-" if fit.gap_closed is None else f"{100 * fit.gap_closed:.1f} %"
        errors = "".join(f"{number(value):>11}" for value in (fit.before, fit.after, fit.noise_floor))
        yield f"  {fit.joint:>5}{errors}{closed:>13}   {joint_unit(diagnosis.simulation.arm, fit.joint - 1)}"


def _claim(number_: int, claim: Claim, size: str) -> Iterator[str]:
    evidence = claim.evidence
    lines = wrap(f"{told(claim)}: {claim.equation}", WIDTH - 5)
    yield f"{number_:>3}. {lines[0]}"
    yield from (f"     {line}" for line in lines[1:])
    error = f"{number(evidence.rms_before)} to {number(evidence.rms_after)} {size}"
    yield f"     held-out error of joint {evidence.joint + 1}: {error}; p {probability(evidence.corrected)}"
    rivals = ", ".join(f"{plain(each.effect)} ({place(each.effect, each.joint, each.joints)})" for each in claim.rivals)
    if rivals:
        yield from (f"     {line}" for line in wrap(f"fits as well: {rivals}", WIDTH - 5))
    if claim.next_experiment:
        yield from (f"     {line}" for line in wrap(f"to tell: {claim.next_experiment}", WIDTH - 5))
