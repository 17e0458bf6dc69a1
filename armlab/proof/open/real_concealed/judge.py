"""Judges each case against what was concealed in it and against the control, in which nothing is concealed."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.errors import InputError
from armlab.proof.open.real_concealed.conceal import (
    EQUIVALENT_AT_ONLY_JOINT,
    EQUIVALENT_NAMES,
    KnownNumber,
    SoughtEffect,
)
from armlab.proof.open.real_concealed.examine import ExaminedCase, ParameterSize, ReportedFinding, Span
from armlab.proof.open.real_concealed.fixed_plan import Case

Answer = Literal["named", "identical", "law", "class", "cancelled", "elsewhere", "missed"]
Findings = tuple[ReportedFinding, ...]
MAX_CLASS_RIVALS = 3  # of a class that counts as an answer
UNCOMPARED_PARAMETERS = ("exponent", "rest")  # parameters that are not compared: they mean little without the others


@dataclass(frozen=True)
class ComparedNumber:
    """A known number and the one that was found.

    holds: whether the interval found contains the known number, or overlaps its interval. None without an interval, and
    where the laws found are not those withheld: other laws share the same torque in another way.
    """

    effect: str
    truth: KnownNumber
    size: ParameterSize
    holds: bool | None


@dataclass(frozen=True)
class JudgedPart:
    """One thing that was sought, and how a diagnosis answered.

    named: its name at its place. identical: a name that no motion separates from it. law: another law of its kind
    there. class: among the rivals of a finding. cancelled: a finding of the control there is gone, because the two add
    to less. elsewhere: its name at another place. missed: none of these.
    """

    sought: SoughtEffect
    answer: Answer
    finding: ReportedFinding | None
    numbers: tuple[ComparedNumber, ...]


@dataclass(frozen=True)
class CaseVerdict:
    """A case with all its answers.

    laws: further laws of a kind that was withheld at that joint. others: all other findings that are neither sought nor
    in the control. joint_shown: the joint, from 1, at which the concealed torque is largest relative to the error of
    the reference. strength: this ratio. gap: share of the error there that named findings remove, from the simulation
    handed over (0) to what is left in the control (1).
    """

    case: Case
    outcome: ExaminedCase
    parts: tuple[JudgedPart, ...]
    others: tuple[ReportedFinding, ...]
    laws: tuple[ReportedFinding, ...]
    joint_shown: int
    strength: float
    gap: float | None


def judge_case(
    case: Case, outcome: ExaminedCase, wanted: tuple[SoughtEffect, ...], control: ExaminedCase
) -> CaseVerdict:
    """Judges a case. wanted: what should be named. control: the outcome with nothing concealed.

    Raises InputError where the diagnosis refused the case or the control.
    """
    for each in (outcome, control):
        if each.refused:
            raise InputError(f"{case.recording}, {each.case}: {each.refused}")
    judge = BesideControl(control, len(outcome.given))
    new = tuple(each for each in outcome.findings if not judge.is_in_control(each))
    unsought = tuple(each for each in new if not any(judge.answers(each, one) for one in wanted))
    parts = tuple(judge.judge_part(each, outcome.findings, new, unsought) for each in wanted)
    used = {id(each.finding) for each in parts}
    left = [each for each in unsought if id(each) not in used and not judge.findings_in_control(each)]
    laws = tuple(each for each in left if any(is_same_kind(each, one) for one in wanted))
    others = tuple(each for each in left if each not in laws)
    over = np.array(outcome.hidden) / np.array(control.given)
    joint = int(np.argmax(over))
    before, after, floor = outcome.given[joint], outcome.found[joint], control.found[joint]
    gap = (before - after) / (before - floor) if wanted and before > floor else None
    return CaseVerdict(case, outcome, parts, others, laws, joint + 1, float(over[joint]), gap)


@dataclass(frozen=True)
class BesideControl:
    """What a finding means beside the control. joints: of the arm."""

    control: ExaminedCase
    joints: int

    def common_key(self, effect: str, joints: tuple[int, ...]) -> tuple[str, tuple[int, ...]]:
        """Effect and joints, equal for two names that nothing separates at a place."""
        one = EQUIVALENT_NAMES.get(effect, effect)
        return (EQUIVALENT_AT_ONLY_JOINT.get(one, one), ()) if self.joints == 1 else (one, joints)

    def findings_in_control(self, finding: ReportedFinding) -> list[ReportedFinding]:
        """What the control says of the same effect at the same place."""
        wanted = self.common_key(finding.effect, finding.joints)
        return [each for each in self.control.findings if self.common_key(each.effect, each.joints) == wanted]

    def is_in_control(self, finding: ReportedFinding) -> bool:
        """Whether the control says the same, its numbers within the intervals found here."""
        old = {size.name: size.value for each in self.findings_in_control(finding) for size in each.sizes}
        pairs = [(old[size.name], size.interval) for size in finding.sizes if size.name in old]
        return bool(self.findings_in_control(finding)) and all(
            span is None or span[0] <= value <= span[1] for value, span in pairs
        )

    def answers(self, finding: ReportedFinding, sought: SoughtEffect) -> bool:
        """Whether a finding has a name that is sought, at the place."""
        return self.common_key(finding.effect, finding.joints) in self.common_keys(sought)

    def common_keys(self, sought: SoughtEffect) -> set[tuple[str, tuple[int, ...]]]:
        """The same of all names that answer."""
        return {self.common_key(effect, sought.joints) for effect in (*sought.effects, *sought.identical)}

    def judge_part(self, sought: SoughtEffect, findings: Findings, new: Findings, unsought: Findings) -> JudgedPart:
        """The answer to one thing that is sought.

        findings: all of the case. new: those that the control does not have. unsought: those of them with a name that
        is not sought at that place.
        """
        answering = [each for each in new if self.answers(each, sought)]
        named = [each for each in answering if each.effect in sought.effects]
        if answering:
            same = {each.effect for each in named} in ({*sought.effects}, set())
            numbers = tuple(held for each in answering for held in self.compare_numbers(sought, each, same))
            return JudgedPart(sought, "named" if named else "identical", (named or answering)[0], numbers)
        same_kind = [each for each in unsought if is_same_kind(each, sought)]
        if same_kind:
            return JudgedPart(sought, "law", same_kind[0], ())
        for each in unsought:
            names = {(rival.effect, rival.joints) for rival in each.rivals}
            if len(each.rivals) <= MAX_CLASS_RIVALS and any(
                (effect, sought.joints) in names for effect in sought.effects
            ):
                return JudgedPart(sought, "class", each, ())
        if self.is_cancelled(sought, findings):
            return JudgedPart(sought, "cancelled", None, ())
        wanted = (*sought.effects, *sought.identical)
        elsewhere = [each for each in unsought if each.effect in wanted and not self.findings_in_control(each)]
        if not elsewhere:
            return JudgedPart(sought, "missed", None, ())
        return JudgedPart(sought, "elsewhere", elsewhere[0], tuple(self.compare_numbers(sought, elsewhere[0], False)))

    def is_cancelled(self, sought: SoughtEffect, findings: Findings) -> bool:
        """Whether less should be left of what the control names there, and nothing of it is named now."""
        if any(self.answers(each, sought) for each in findings):
            return False
        for each in (each for each in self.control.findings if self.answers(each, sought)):
            for size in each.sizes:
                truth = sought.numbers.get(each.effect, {}).get(size.name)
                if truth is not None and abs(size.value + truth[0]) < abs(size.value):
                    return True
        return False

    def compare_numbers(self, sought: SoughtEffect, finding: ReportedFinding, same: bool) -> list[ComparedNumber]:
        """Numbers beside what is known, less the number of the control. same: whether their intervals can be judged."""
        old = {size.name: size.value for each in self.findings_in_control(finding) for size in each.sizes}
        compared = []
        for size in finding.sizes:
            truth = sought.numbers.get(finding.effect, {}).get(size.name)
            if truth is None or size.name in UNCOMPARED_PARAMETERS:
                continue
            control_value = old.get(size.name, 0.0)
            span = None
            if size.interval is not None:
                span = size.interval[0] - control_value, size.interval[1] - control_value
            beyond = ParameterSize(size.name, size.value - control_value, span, size.unit)
            holds = _interval_holds(span, truth) if same else None
            compared.append(ComparedNumber(finding.effect, truth, beyond, holds))
        return compared


def is_same_kind(finding: ReportedFinding, sought: SoughtEffect) -> bool:
    """Whether it is another law of a kind that is withheld at the joint."""
    return finding.effect in sought.laws and finding.joints == sought.joints


def _interval_holds(span: Span | None, truth: KnownNumber) -> bool | None:
    if span is None:
        return None
    low, high = truth[1] or (truth[0], truth[0])
    return bool(span[0] <= high and low <= span[1])
