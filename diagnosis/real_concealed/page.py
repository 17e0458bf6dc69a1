"""`concealed.md`: what was concealed in real recordings and what came of it."""

from collections.abc import Iterator, Sequence

import numpy as np

from diagnosis.real_concealed.judge import Verdict
from diagnosis.real_concealed.study import Study
from diagnosis.real_concealed.words import ANSWERS, answer, finding, listed, percent, share, sizes

PICTURE = "concealed.svg"
INTRODUCTION = f"""\
# Real recordings with something concealed

A complete model of each arm is identified from its identification runs (components and filters by cross-validation,
links that bodies can have). Either a part of that reference is withheld, or a known disturbance is added to the torque
of every run. The diagnosis gets the recording and the model, and has to say what is concealed. All errors are those of
the filtered torque on runs that took no part; every look at those is logged.

![What was found]({PICTURE})

*Strength*: RMS of the torque that is concealed over the error of the reference, at the joint where that is largest.
*Recovered*: share of the concealed torque that the findings sought hold. *Gap*: from the error of the model handed
over (0) to what is left of the untouched recording with the findings of the control (1), at that joint, by named
findings alone. *Others*: findings that are neither sought nor in the control. Where the control names the same effect
at the same place, its number is taken off (not from *recovered*), and it counts only beyond its interval. **no**: the
interval does not hold the truth, or does not overlap that of the reference; friction is so judged only where the very
laws are found that were withheld, for others share the same torque in other ways.
"""


def markdown(studies: Sequence[Study]) -> str:
    """The whole page."""
    parts = (_counts(studies), *(_study(each) for each in studies))
    return INTRODUCTION + "".join(f"\n{line}" for part in parts for line in part) + "\n"


def count_lines(verdicts: Sequence[Verdict], title: str) -> Iterator[str]:
    """What was sought and found, in lines."""
    if not verdicts:
        return
    answers = [each.answer for verdict in verdicts for each in verdict.judged]
    tally = ", ".join(f"{answers.count(name)} {told}" for name, told in ANSWERS.items() if name in answers)
    held = [
        each.holds for verdict in verdicts for one in verdict.judged for each in one.numbers if each.holds is not None
    ]
    gaps = [verdict.gap for verdict in verdicts if verdict.gap is not None]
    named = [each for verdict in verdicts for each in verdict.others if each.effect != "unknown"]
    unknown = sum(len(verdict.others) for verdict in verdicts) - len(named)
    yield (
        f"- {title}: {len(verdicts)} cases, {len(answers)} things to name: {tally}. "
        f"{sum(held)} of {len(held)} intervals fit. Median gap closed {np.median(gaps):.2f}. "
        f"Other new findings: {len(named)} names, {unknown} unknown."
    )


def _counts(studies: Sequence[Study]) -> Iterator[str]:
    every = [each for one in studies for each in one.verdicts]
    yield from count_lines([each for each in every if each.case.injected is None], "Withheld")
    yield from count_lines([each for each in every if each.case.injected is not None], "Injected")
    for low, high in ((0.0, 1.0), (1.0, 3.0), (3.0, np.inf)):
        own = [each for each in every if each.case.injected is not None and low <= each.strength < high]
        upper = "" if np.isinf(high) else f" to {high:g}"
        yield from count_lines(own, f"Injected, strength {low:g}{upper}{' and more' if np.isinf(high) else ''}")
    yield ""


def _study(found: Study) -> Iterator[str]:
    control = found.control
    yield f"## {found.name}\n"
    yield f"Reference: {found.reference.told}. "
    yield f"Error {percent(control, control.given)}, {percent(control, control.named)} with what the control names.\n"
    said = "; ".join(finding(each) for each in control.said) or "nothing"
    yield f"Control, nothing concealed: {said}.\n"
    withheld = [each for each in found.verdicts if each.case.injected is None]
    injected = [each for each in found.verdicts if each.case.injected is not None]
    yield "| withheld | strength | error handed over / reference / found | recovered | gap | further laws | others |"
    yield "|---|---:|---|---:|---:|---|---|"
    for each in withheld:
        yield _withheld(each, found)
    yield ""
    yield "| withheld | sought | answer | reference → found |"
    yield "|---|---|---|---|"
    for each in withheld:
        for one in each.judged:
            yield f"| {each.case.name} | {one.sought.label} | {answer(one)} | {sizes(one)} |"
    yield ""
    yield "| injected | strength | answer | truth → found | recovered | gap | others |"
    yield "|---|---:|---|---|---:|---:|---|"
    for each in injected:
        yield _injected(each)
    yield ""


def _withheld(verdict: Verdict, found: Study) -> str:
    outcome = verdict.outcome
    errors = (outcome.given, found.control.given, outcome.named)
    told = " / ".join(percent(outcome, each) for each in errors)
    shares = f"{share(outcome.recovered)} | {share(verdict.gap)}"
    further = f"{listed(verdict.laws)} | {listed(verdict.others)}"
    return f"| {verdict.case.name} | {verdict.strength:.1f} | {told} | {shares} | {further} |"


def _injected(verdict: Verdict) -> str:
    (one,) = verdict.judged
    shares = f"{share(verdict.outcome.recovered)} | {share(verdict.gap)}"
    told = f"{answer(one)} | {sizes(one)}"
    return f"| {verdict.case.name} | {verdict.strength:.1f} | {told} | {shares} | {listed(verdict.others)} |"
