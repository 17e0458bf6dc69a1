"""Findings, answers and numbers of a case in words."""

import math
from collections.abc import Sequence

from diagnosis.real_concealed.judge import Held, Judged
from diagnosis.real_concealed.outcome import Outcome, Said
from diagnosis.report.words import number, place, plain, unit

ANSWERS = {
    "named": "named at its place",
    "identical": "named as what no motion separates from it",
    "law": "another law named",
    "class": "among the rivals of a finding",
    "cancelled": "cancels what the control names, which is gone",
    "elsewhere": "named at another place",
    "missed": "missed",
}


def finding(said: Said) -> str:
    """A finding with its place."""
    joint = said.joints[0] if said.joints else None
    return f"{plain(said.effect)}, {place(said.effect, joint, said.joints)}"


def answer(judged: Judged) -> str:
    """The answer, and the finding where that is another."""
    told = ANSWERS[judged.answer]
    return told if judged.answer == "named" or judged.said is None else f"{told} ({finding(judged.said)})"


def sizes(judged: Judged) -> str:
    """True or reference's value -> found with interval, and whether they fit; the law where none is comparable."""
    law = "–" if judged.said is None else f"`{judged.said.equation}`".replace("|", "\\|")
    return "; ".join(_size(each) for each in judged.numbers) or law


def _size(held: Held) -> str:
    truth, span = held.truth[1], held.size.interval
    known = number(held.truth[0]) + ("" if truth is None else f" ({number(truth[0])} to {number(truth[1])})")
    own = number(held.size.value) + ("" if span is None else f" ({number(span[0])} to {number(span[1])})")
    fits = {True: "", False: ", **no**", None: ""}[held.holds]
    return f"{held.size.name} {known} → {own} {unit(held.size.unit)}".rstrip() + fits


def percent(outcome: Outcome, errors: Sequence[float]) -> str:
    """Of the measured torque, over all joints."""
    return f"{100 * math.hypot(*errors) / math.hypot(*outcome.torque):.1f} %"


def share(value: float | None) -> str:
    """A share with two decimals."""
    return "–" if value is None else f"{value:.2f}".replace("-", "−")


def listed(said: Sequence[Said]) -> str:
    """Findings in a cell."""
    return "; ".join(finding(each) for each in said) or "–"
