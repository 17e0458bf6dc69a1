"""Which findings there are, and which of them are told: the others are minor."""

from collections.abc import Sequence
from dataclasses import replace

from armlab.diagnosis.parts import UNKNOWN_CAUSE, cause_of
from armlab.diagnosis.result import Claim, Part
from armlab.diagnosis.told.causes import MAX_TOLD_CAUSES, causes_of, leading_causes
from armlab.diagnosis.told.statement import statement_of
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named

MAX_TOLD_OF_JOINT = 2  # findings
ROUNDING = 1e-4  # of a held-out error: a removal that changes less changes nothing that is shown


def stated_findings(claims: Sequence[Claim], joints: int) -> tuple[Claim, ...]:
    """The findings among claims: what may be stated, and is missed where it is taken away.

    An effect of the whole robot that is missed at one joint at most is minor. joints: of the arm.
    """
    stated = (each for each in claims if statement_of(each).kind != "nothing" and _is_missed(each))
    return tuple(replace(each, minor=True) if _is_of_one_place(each, joints) else each for each in stated)


def _is_missed(claim: Claim) -> bool:
    return claim.removal is None or claim.removal.growth > ROUNDING


def _is_of_one_place(claim: Claim, joints: int) -> bool:
    """Whether an effect of the whole robot is missed at one joint at most, or the error of another falls without it."""
    removal = claim.removal
    if removal is None or joints == 1 or effect_named(claim.effect).where != "robot":
        return False
    return len(removal.joints) <= 1 or bool(removal.better)


def without_lesser_unknowns(claims: Sequence[Claim], parts: Sequence[Part]) -> tuple[Claim, ...]:
    """The findings without those that have no name, but where they are a leading cause."""
    leads = any(each.cause == UNKNOWN_CAUSE for each in leading_causes(causes_of(parts)))
    return tuple(each for each in claims if each.effect != UNKNOWN.id or leads)


def with_minor_ones(claims: Sequence[Claim], parts: Sequence[Part]) -> tuple[Claim, ...]:
    """The findings, those marked that are minor.

    Minor are all findings about a part that nobody would miss; of a joint or a link those beyond two, of which
    the most missed one of each cause comes first; and those of causes beyond the four largest.
    """
    out = list(claims)
    for part in parts:
        if part.removal is not None and part.removal.is_minor:
            _mark(out, part.claims)
    places: dict[tuple[bool, int | None], list[int]] = {}
    for number, claim in enumerate(out):
        if not claim.minor:
            places.setdefault((effect_named(claim.effect).where == "link", claim.joint), []).append(number)
    for numbers in places.values():
        _mark(out, _by_weight(numbers, out)[MAX_TOLD_OF_JOINT:])
    told = [each for each in causes_of(parts) if not all(out[number].minor for number in each.findings)]
    for each in told[MAX_TOLD_CAUSES:]:
        _mark(out, each.findings)
    return tuple(out)


def _by_weight(numbers: Sequence[int], claims: Sequence[Claim]) -> list[int]:
    """Findings of one place: of each cause the one that is missed most, then the others, those missed most first."""
    missed = sorted(numbers, key=lambda each: -_growth(claims[each]))
    first = {cause_of(effect_named(claims[each].effect)): each for each in reversed(missed)}.values()
    return sorted(missed, key=lambda each: each not in first)


def _growth(claim: Claim) -> float:
    return claim.removal.growth if claim.removal is not None else float("inf")


def _mark(claims: list[Claim], numbers: Sequence[int]) -> None:
    for number in numbers:
        claims[number] = replace(claims[number], minor=True)
