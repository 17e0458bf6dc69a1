"""The names that were weighed in a random case, and which of them are right: what probabilities are learnt from."""

from collections.abc import Iterator
from dataclasses import dataclass

from armlab.diagnosis.result import WeighedName
from armlab.proof.open.real_concealed.beside_control import BesideControl, is_same_kind
from armlab.proof.open.real_concealed.conceal import SoughtEffect
from armlab.proof.open.real_concealed.examine import ExaminedCase, ReportedFinding, joints_of


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
