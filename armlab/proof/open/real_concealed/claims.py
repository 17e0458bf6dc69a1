"""Judges a random case: each claim that is new against the control, each thing that was sought, and which of the names
that were weighed are right, from which probabilities are learnt.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from armlab.diagnosis.result import WeighedName
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import EFFECT_IDS, effect_named
from armlab.proof.open.real_concealed.beside_control import BesideControl, Findings, is_same_kind
from armlab.proof.open.real_concealed.conceal import SoughtEffect
from armlab.proof.open.real_concealed.draw import DrawnCase
from armlab.proof.open.real_concealed.examine import ExaminedCase, ReportedFinding, joints_of

ClaimVerdict = Literal["right", "class", "law", "unknown", "wrong"]
SoughtAnswer = Literal["named", "class", "law", "cancelled", "absorbed", "unknown", "another name", "missed"]
MAX_CLASS_SIZE = 4  # names of a class that counts as an answer
Name = tuple[str, tuple[int, ...]]  # effect and joints


@dataclass(frozen=True)
class JudgedClaim:
    """A claim that the control does not make.

    verdict: right where its first name is sought, or is one that no motion separates from it; class where another name
    of its class of four at most is; law for another law of friction where friction is withheld, which is neither right
    nor wrong; unknown without a name; wrong otherwise. probability: of its first name together with those that no
    motion separates from it.
    """

    finding: ReportedFinding
    verdict: ClaimVerdict
    class_size: int
    probability: float | None


@dataclass(frozen=True)
class AnsweredPart:
    """One thing that was sought, and what the new claims say of it.

    answer: named, class and law as in `JudgedClaim`; cancelled where it only takes away what the control names;
    absorbed where a law that the control names there holds it as a part, and has other numbers now; unknown or another
    name at its joint (its name at another joint counts as another name); missed without any.
    """

    sought: SoughtEffect
    answer: SoughtAnswer


@dataclass(frozen=True)
class DrawnVerdict:
    """A random case with its new claims and what was sought."""

    drawn: DrawnCase
    outcome: ExaminedCase
    claims: tuple[JudgedClaim, ...]
    parts: tuple[AnsweredPart, ...]


def with_own_findings(
    control: ExaminedCase, cases: Sequence[tuple[ExaminedCase, tuple[SoughtEffect, ...]]], joints: int
) -> ExaminedCase:
    """The control with what it misses by chance: what half of the cases of the recording name, or more, though it is
    not concealed there. Each case conceals something else, so that is of the arm or of how it was recorded.

    cases: each with what is concealed in it. joints: of the arm.
    """
    judge = BesideControl(control, joints)
    counts, found = Counter[Name](), dict[Name, ReportedFinding]()
    for outcome, wanted in cases:
        new = (each for each in outcome.findings if each.effect != UNKNOWN.id and _is_new(judge, each, ()))
        own = {judge.common_key(each.effect, each.joints): each for each in new}
        sought = {key for each in wanted for key in judge.common_keys(each)}
        counts.update(own.keys() - sought)
        found |= own
    often = tuple(found[key] for key, count in counts.items() if 2 * count >= len(cases) > 2)
    return replace(control, findings=(*control.findings, *often))


def judge_drawn(
    drawn: DrawnCase, outcome: ExaminedCase, wanted: tuple[SoughtEffect, ...], control: ExaminedCase, joints: int
) -> DrawnVerdict:
    """Judges a case. wanted: what is concealed. joints: of the arm."""
    judge = BesideControl(control, joints)
    new = tuple(each for each in outcome.findings if _is_new(judge, each, wanted))
    claims = tuple(_judged_claim(judge, each, wanted) for each in new)
    parts = tuple(AnsweredPart(each, _answer(judge, each, outcome.findings, claims)) for each in wanted)
    return DrawnVerdict(drawn, outcome, claims, parts)


def _is_new(judge: BesideControl, finding: ReportedFinding, wanted: tuple[SoughtEffect, ...]) -> bool:
    """Whether the control does not name the effect there; of what is sought, whether it does not name that size."""
    if any(judge.answers(finding, each) or is_same_kind(finding, each) for each in wanted):
        return not judge.is_in_control(finding)
    return not judge.findings_in_control(finding)


def _judged_claim(judge: BesideControl, finding: ReportedFinding, wanted: tuple[SoughtEffect, ...]) -> JudgedClaim:
    size, chance = len(_class_names(judge, finding)), finding.probability
    own = judge.common_key(finding.effect, finding.joints)
    alike = [each for each in finding.members if judge.common_key(each.effect, each.joints) == own]
    if chance is not None and finding.effect != UNKNOWN.id:
        chance = max(chance, sum(each.probability for each in alike))
    return JudgedClaim(finding, _claim_verdict(judge, finding, wanted), size, chance)


def _claim_verdict(judge: BesideControl, finding: ReportedFinding, wanted: tuple[SoughtEffect, ...]) -> ClaimVerdict:
    """The verdict on one new claim."""
    if finding.effect == UNKNOWN.id:
        return "unknown"
    if any(judge.answers(finding, each) for each in wanted):
        return "right"
    if any(is_same_kind(finding, each) for each in wanted):
        return "law"
    return "class" if any(_is_in_class(judge, finding, each) for each in wanted) else "wrong"


def _class_names(judge: BesideControl, finding: ReportedFinding) -> set[Name]:
    """The names that a finding leaves open, its own included; those that nothing separates count once."""
    if finding.effect == UNKNOWN.id:
        return {(UNKNOWN.id, finding.joints)}
    names = [(finding.effect, finding.joints)]
    names += [(each.effect, each.joints) for each in finding.rivals]
    names += [(each.effect, each.joints) for each in finding.members]
    return {judge.common_key(*each) for each in names}


def _is_in_class(judge: BesideControl, finding: ReportedFinding, sought: SoughtEffect) -> bool:
    """Whether a class of four names at most holds one that is sought, at the place."""
    names = _class_names(judge, finding)
    return len(names) <= MAX_CLASS_SIZE and not names.isdisjoint(judge.common_keys(sought))


def _answer(
    judge: BesideControl, sought: SoughtEffect, findings: Findings, claims: tuple[JudgedClaim, ...]
) -> SoughtAnswer:
    """The best answer of the new claims to one thing. findings: all of the case."""
    names = [each.finding for each in claims if each.verdict != "unknown"]
    if any(judge.answers(each, sought) for each in names):
        return "named"
    if any(is_same_kind(each, sought) for each in names):
        return "law"
    if any(_is_in_class(judge, each, sought) for each in names):
        return "class"
    if judge.is_cancelled(sought, findings):
        return "cancelled"
    if any(_absorbs(judge, each, sought) for each in findings):
        return "absorbed"
    wrong = [each.finding for each in claims if each.verdict == "wrong"]
    unknown = [each.finding for each in claims if each.verdict == "unknown"]
    if any(_is_there(each, sought) or each.effect in (*sought.effects, *sought.identical) for each in wrong):
        return "another name"
    return "unknown" if any(_is_there(each, sought) for each in unknown) else "missed"


MORE_PARTS = {"asymmetric_friction": ("torque_offset",)}  # Coulomb friction that differs by direction, and an offset


def _absorbs(judge: BesideControl, finding: ReportedFinding, sought: SoughtEffect) -> bool:
    """Whether the law of a finding holds what is sought as a part, and the control names it with other numbers."""
    if finding.joints != sought.joints or finding.effect not in EFFECT_IDS or not judge.findings_in_control(finding):
        return False
    parts = (*effect_named(finding.effect).contains, *MORE_PARTS.get(finding.effect, ()))
    return set(sought.effects) <= set(parts) and not judge.is_in_control(finding)


def _is_there(finding: ReportedFinding, sought: SoughtEffect) -> bool:
    """Whether a finding is at the joint of what is sought; all joints are there for a delay of the whole arm."""
    return not sought.joints or finding.joints[:1] == sought.joints[:1]


@dataclass(frozen=True)
class LabelledFinding:
    """numbers: what speaks for each name, by what it says, and for none of them. right: which of them hold.

    background: whether the control has the name that the search took. Nobody knows whether that is right, so no name of
    it is called right.
    """

    numbers: tuple[dict[str, float], ...]
    right: tuple[bool, ...]
    background: bool


def label_weighed(
    outcome: ExaminedCase, wanted: tuple[SoughtEffect, ...], control: ExaminedCase, joints: int
) -> Iterator[LabelledFinding]:
    """Each finding of a case. wanted: what is concealed. joints: of the arm.

    A name is right where it is sought; another law of friction is, where friction is withheld. None of the names is
    right where nothing of the kind is concealed, though the arm itself may have it.
    """
    judge = BesideControl(control, joints)
    for weighed in outcome.weighed:
        sought = [not each.is_none and _is_sought(judge, each, wanted) for each in weighed]
        background = not sought[0] and _is_in_control(judge, weighed[0])
        right = (
            not background and (own or (each.is_none and not any(sought)))
            for own, each in zip(sought, weighed, strict=True)
        )
        yield LabelledFinding(tuple(dict(each.numbers) for each in weighed), tuple(right), background)


def _is_sought(judge: BesideControl, name: WeighedName, wanted: tuple[SoughtEffect, ...]) -> bool:
    finding = _as_finding(name)
    return any(judge.answers(finding, each) or is_same_kind(finding, each) for each in wanted)


def _is_in_control(judge: BesideControl, name: WeighedName) -> bool:
    return not name.is_none and bool(judge.findings_in_control(_as_finding(name)))


def _as_finding(name: WeighedName) -> ReportedFinding:
    return ReportedFinding(name.effect, joints_of(name.joint, name.joints), "", (), ())
