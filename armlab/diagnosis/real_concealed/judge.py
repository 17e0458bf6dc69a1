"""Judges each case against what was concealed in it and against the control, in which nothing is concealed."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.diagnosis.real_concealed.conceal import (
    EQUIVALENT_AT_ONLY_JOINT,
    EQUIVALENT_NAMES,
    KnownNumber,
    SoughtEffect,
)
from armlab.diagnosis.real_concealed.examine import Outcome, ParameterSize, ReportedFinding, Span
from armlab.diagnosis.real_concealed.plan import Case

Answer = Literal["named", "identical", "law", "class", "cancelled", "elsewhere", "missed"]
Findings = tuple[ReportedFinding, ...]
MAX_CLASS_RIVALS = 3  # of a class that counts as an answer
UNCOMPARED_PARAMETERS = ("exponent", "rest")  # parameters that are not compared: they mean little without the others


@dataclass(frozen=True)
class ComparedNumber:
    """A number that is known and what was found of it.

    holds: whether the interval found has it, or overlaps that of the reference; None without one, and where other laws
    were found than were withheld, which share the torque in other ways.
    """

    effect: str
    truth: KnownNumber
    size: ParameterSize
    holds: bool | None


@dataclass(frozen=True)
class JudgedPart:
    """One thing that was sought. answer: its name at its place; a name that no motion separates from it; another law of
    its kind there; among the rivals of a finding; what the control names there is gone, which it cancels; its name at
    another place; or nothing of that.
    """

    sought: SoughtEffect
    answer: Answer
    said: ReportedFinding | None
    numbers: tuple[ComparedNumber, ...]


@dataclass(frozen=True)
class CaseVerdict:
    """A case in full.

    laws: further laws of a kind that was withheld at that joint. others: all other findings that are neither sought nor
    in the control. shows: the joint, from 1, where what is concealed is largest beside the error of the reference;
    strength: how large. gap: share of the gap that named findings close
    there, from the simulation handed over to what is left in the control.
    """

    case: Case
    outcome: Outcome
    judged: tuple[JudgedPart, ...]
    others: tuple[ReportedFinding, ...]
    laws: tuple[ReportedFinding, ...]
    joint_shown: int
    strength: float
    gap: float | None


def judge_case(case: Case, outcome: Outcome, wanted: tuple[SoughtEffect, ...], control: Outcome) -> CaseVerdict:
    """Judges a case."""
    court = _Judge(control, len(outcome.given))
    fresh = tuple(each for each in outcome.said if not court.is_in_control(each))
    free = tuple(each for each in fresh if not any(court.answers(each, one) for one in wanted))
    judged = tuple(court.judged(each, outcome.said, fresh, free) for each in wanted)
    used = {id(each.said) for each in judged}
    new = [each for each in free if id(each) not in used and not court.before(each)]
    laws = tuple(each for each in new if any(_is_same_kind(each, one) for one in wanted))
    others = tuple(each for each in new if each not in laws)
    over = np.array(outcome.hidden) / np.array(control.given)
    joint = int(np.argmax(over))
    before, after, floor = outcome.given[joint], outcome.named[joint], control.named[joint]
    gap = (before - after) / (before - floor) if wanted and before > floor else None
    return CaseVerdict(case, outcome, judged, others, laws, joint + 1, float(over[joint]), gap)


@dataclass(frozen=True)
class _Judge:
    """The control, and the number of joints of the arm."""

    control: Outcome
    joints: int

    def key(self, effect: str, joints: tuple[int, ...]) -> tuple[str, tuple[int, ...]]:
        """The same for names that nothing separates at a place."""
        one = EQUIVALENT_NAMES.get(effect, effect)
        return (EQUIVALENT_AT_ONLY_JOINT.get(one, one), ()) if self.joints == 1 else (one, joints)

    def before(self, said: ReportedFinding) -> list[ReportedFinding]:
        """What the control says of the same effect at the same place."""
        wanted = self.key(said.effect, said.joints)
        return [each for each in self.control.said if self.key(each.effect, each.joints) == wanted]

    def is_in_control(self, said: ReportedFinding) -> bool:
        """Whether the control says the same, its numbers within the intervals found here."""
        old = {size.name: size.value for each in self.before(said) for size in each.sizes}
        pairs = [(old[size.name], size.interval) for size in said.sizes if size.name in old]
        return bool(self.before(said)) and all(span is None or span[0] <= value <= span[1] for value, span in pairs)

    def answers(self, said: ReportedFinding, sought: SoughtEffect) -> bool:
        """Whether a finding has a name that is sought, at the place."""
        keys = {self.key(effect, sought.joints) for effect in (*sought.effects, *sought.identical)}
        return self.key(said.effect, said.joints) in keys

    def judged(self, sought: SoughtEffect, said: Findings, fresh: Findings, free: Findings) -> JudgedPart:
        """The answer to one thing that is sought. fresh: what the control does not say; free: and nobody sought."""
        own = [each for each in fresh if self.answers(each, sought)]
        named = [each for each in own if each.effect in sought.effects]
        if own:
            same = {each.effect for each in named} in ({*sought.effects}, set())
            numbers = tuple(held for each in own for held in self.numbers(sought, each, same))
            return JudgedPart(sought, "named" if named else "identical", (named or own)[0], numbers)
        kin = [each for each in free if _is_same_kind(each, sought)]
        if kin:
            return JudgedPart(sought, "law", kin[0], ())
        for each in free:
            names = {(rival.effect, rival.joints) for rival in each.rivals}
            if len(each.rivals) <= MAX_CLASS_RIVALS and any(
                (effect, sought.joints) in names for effect in sought.effects
            ):
                return JudgedPart(sought, "class", each, ())
        if self.is_cancelled(sought, said):
            return JudgedPart(sought, "cancelled", None, ())
        wanted = (*sought.effects, *sought.identical)
        away = [each for each in free if each.effect in wanted and not self.before(each)]
        if not away:
            return JudgedPart(sought, "missed", None, ())
        return JudgedPart(sought, "elsewhere", away[0], tuple(self.numbers(sought, away[0], False)))

    def is_cancelled(self, sought: SoughtEffect, said: Findings) -> bool:
        """Whether less should be left of what the control names there, and nothing of it is named now."""
        if any(self.answers(each, sought) for each in said):
            return False
        for each in (each for each in self.control.said if self.answers(each, sought)):
            for size in each.sizes:
                truth = sought.numbers.get(each.effect, {}).get(size.name)
                if truth is not None and abs(size.value + truth[0]) < abs(size.value):
                    return True
        return False

    def numbers(self, sought: SoughtEffect, said: ReportedFinding, same: bool) -> list[ComparedNumber]:
        """Numbers beside what is known; what the control says already is taken off. same: if they can be judged."""
        old = {size.name: size.value for each in self.before(said) for size in each.sizes}
        out = []
        for size in said.sizes:
            truth = sought.numbers.get(said.effect, {}).get(size.name)
            if truth is None or size.name in UNCOMPARED_PARAMETERS:
                continue
            off = old.get(size.name, 0.0)
            span = None if size.interval is None else (size.interval[0] - off, size.interval[1] - off)
            own = ParameterSize(size.name, size.value - off, span, size.unit)
            out.append(ComparedNumber(said.effect, truth, own, _interval_holds(span, truth) if same else None))
        return out


def _is_same_kind(said: ReportedFinding, sought: SoughtEffect) -> bool:
    return said.effect in sought.laws and said.joints == sought.joints


def _interval_holds(span: Span | None, truth: KnownNumber) -> bool | None:
    if span is None:
        return None
    low, high = truth[1] or (truth[0], truth[0])
    return bool(span[0] <= high and low <= span[1])
