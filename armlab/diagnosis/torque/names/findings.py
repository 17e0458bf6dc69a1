"""Findings: how each may be stated, which causes they have, and which of them are minor.

A finding is stated by its name, as one of a few names, as a cause without its law, or not at all. Causes count by the
share of the error that they explain.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from typing import Literal

from armlab.common.told import MAX_CLASS_NAMES, MIN_CAUSE_PROBABILITY, MIN_NAME_PROBABILITY
from armlab.diagnosis.result import Claim, Member, Part
from armlab.diagnosis.torque.predict.parts import UNKNOWN_CAUSE, is_in_no_model
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named

FRICTION = "friction"
STATED_SHARE = 0.95  # of the error: causes are told until they explain as much
MAX_STATED_CAUSES = 4
MAX_STATED_OF_JOINT = 2  # findings
SMALLEST_CHANGE = 1e-4  # of a held-out error: less changes nothing that is shown

Kind = Literal["name", "class", "cause", "nothing"]


@dataclass(frozen=True)
class Statement:
    """effects: ids, the likeliest first: one of a name or a cause, two or three of a class. probability: of them."""

    kind: Kind
    effects: tuple[str, ...]
    probability: float


def statement_of(claim: Claim) -> Statement:
    """How a finding is stated. A finding whose names were not weighed has its name."""
    if claim.probability is None:
        return Statement("name", (claim.effect,), 1.0)
    return state_name(claim.effect, claim.probability, claim.members, {claim.joint, *claim.joints})


def state_name(effect: str, probability: float, members: Sequence[Member], places: Set[int | None]) -> Statement:
    """How an effect with a probability is stated, of a class of names with theirs. places: joints of the finding."""
    if probability >= MIN_NAME_PROBABILITY:
        return Statement("name", (effect,), probability)
    here = [each for each in members if each.effect != UNKNOWN.id and each.joint in places]
    names = sorted(here, key=lambda each: -each.probability)
    if told := sure_together(names):
        effects = tuple(each.effect for each in told)
        return Statement("class" if effect in effects else "nothing", effects, sum(each.probability for each in told))
    chance = max(probability, _probability_of_friction(effect, names))
    return Statement("cause" if chance >= MIN_CAUSE_PROBABILITY else "nothing", (effect,), chance)


def sure_together(names: Sequence[Member]) -> tuple[Member, ...]:
    """The first of some names, the likeliest first, that reach the probability of a name together; else none."""
    total = 0.0
    for count, each in enumerate(names[:MAX_CLASS_NAMES], 1):
        total += each.probability
        if total >= MIN_NAME_PROBABILITY:
            return tuple(names[:count])
    return ()


def _probability_of_friction(effect: str, names: Sequence[Member]) -> float:
    """All laws of friction together, of an effect that is one; else 0."""
    if effect_named(effect).cause != FRICTION:
        return 0.0
    return sum(each.probability for each in names if effect_named(each.effect).cause == FRICTION)


@dataclass(frozen=True)
class StatedCause:
    """Findings with one cause. joints: from 1, none for the whole robot. findings: their places among the claims.

    share: of the error above the noise.
    """

    cause: str
    joints: tuple[int, ...]
    share: float
    findings: tuple[int, ...]


def causes_of(parts: Sequence[Part]) -> tuple[StatedCause, ...]:
    """The causes with findings, the one with the largest share first."""
    grouped: dict[str, list[Part]] = {}
    for part in parts:
        if part.claims:
            grouped.setdefault(part.cause, []).append(part)
    causes = [
        StatedCause(
            cause,
            tuple(sorted({part.joint for part in own if part.joint is not None})),
            float(sum(part.share for part in own)),
            tuple(sorted({number for part in own for number in part.claims})),
        )
        for cause, own in grouped.items()
    ]
    return tuple(sorted(causes, key=lambda each: -each.share))


def told_causes(parts: Sequence[Part], claims: Sequence[Claim]) -> tuple[StatedCause, ...]:
    """The causes, counted by those parts of the model of which a finding is told."""
    return causes_of([each for each in parts if not all(claims[number].minor for number in each.claims)])


def minor_causes(parts: Sequence[Part], claims: Sequence[Claim]) -> tuple[StatedCause, ...]:
    """The causes, counted by those parts of the model of which no finding is told."""
    return causes_of([each for each in parts if all(claims[number].minor for number in each.claims)])


def leading_causes(causes: Sequence[StatedCause]) -> tuple[StatedCause, ...]:
    """The largest causes, until they explain nearly all; what explains less than the rest that may stay open is none.

    The largest leads whatever it explains.
    """
    out, told = list[StatedCause](), 0.0
    for each in causes[:MAX_STATED_CAUSES]:
        if out and (told >= STATED_SHARE or each.share < 1 - STATED_SHARE):
            break
        out.append(each)
        told += each.share
    return tuple(out)


def finding_shares(parts: Sequence[Part], findings: int) -> tuple[float, ...]:
    """The share of the error that each finding explains; those of a cause sum to its own."""
    shares = [0.0] * findings
    for part in parts:
        for number, share in zip(part.claims, part.shares, strict=True):
            shares[number] += share
    return tuple(shares)


def stated_findings(claims: Sequence[Claim], joints: int) -> tuple[Claim, ...]:
    """The findings among claims: what may be stated, and is missed where it is taken away.

    What the held-out runs do not need, because they do not move in that way, is a finding only with a sure name.
    An effect of the whole robot that is missed at one joint at most is minor. joints: of the arm.
    """
    stated = (each for each in claims if _is_stated(each))
    return tuple(replace(each, minor=True) if _is_of_one_place(each, joints) else each for each in stated)


def _is_stated(claim: Claim) -> bool:
    kind = statement_of(claim).kind
    least = -SMALLEST_CHANGE if kind == "name" else SMALLEST_CHANGE
    return kind != "nothing" and (claim.removal is None or claim.removal.growth > least)


def _is_of_one_place(claim: Claim, joints: int) -> bool:
    """Whether an effect of the whole robot is missed at one joint at most, or the error of another falls without it."""
    removal = claim.removal
    if removal is None or joints == 1 or effect_named(claim.effect).where != "robot":
        return False
    return len(removal.joints) <= 1 or bool(removal.better)


def without_lesser_unknowns(claims: Sequence[Claim], parts: Sequence[Part]) -> tuple[Claim, ...]:
    """The findings without those that have no name: where they are a leading cause, those stay that make it one."""
    leads = any(each.cause == UNKNOWN_CAUSE for each in leading_causes(causes_of(parts)))
    shares = finding_shares(parts, len(claims))
    unnamed = [share for share, each in zip(shares, claims, strict=True) if each.effect == UNKNOWN.id]
    least = min(1 - STATED_SHARE, max(unnamed, default=0.0)) if leads else float("inf")
    kept = (each.effect != UNKNOWN.id or share >= least for share, each in zip(shares, claims, strict=True))
    return tuple(each for each, keep in zip(claims, kept, strict=True) if keep)


def with_minor_ones(claims: Sequence[Claim], parts: Sequence[Part]) -> tuple[Claim, ...]:
    """The findings, those marked that are minor.

    Minor are all findings about a part that nobody would miss; of a joint or a link those beyond the two that explain
    most; and those of causes beyond the four largest.
    """
    out = list(claims)
    for part in parts:
        if part.removal is not None and part.removal.is_minor:
            _mark(out, part.claims)
    alone = [number for number, each in enumerate(claims) if is_in_no_model(each)]
    _mark(out, [each for each in alone if (removal := claims[each].removal) is not None and removal.is_minor])
    places: dict[tuple[bool, int | None], list[int]] = {}
    for number, claim in enumerate(out):
        if not claim.minor:
            places.setdefault((effect_named(claim.effect).where == "link", claim.joint), []).append(number)
    shares = finding_shares(parts, len(claims))
    for numbers in places.values():
        numbers.sort(key=lambda each: (-shares[each], -_growth(out[each])))
        _mark(out, numbers[MAX_STATED_OF_JOINT:])
    for each in told_causes(parts, out)[MAX_STATED_CAUSES:]:
        _mark(out, each.findings)
    return tuple(out)


def _growth(claim: Claim) -> float:
    return claim.removal.growth if claim.removal is not None else float("inf")


def _mark(claims: list[Claim], numbers: Sequence[int]) -> None:
    for number in numbers:
        claims[number] = replace(claims[number], minor=True)
