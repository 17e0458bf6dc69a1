"""How a finding may be stated: by its name, as one of a few names, as a cause without its law, or not at all."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from armlab.diagnosis.naming.decide import MIN_CAUSE_PROBABILITY
from armlab.diagnosis.result import Claim, Member
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named

MIN_NAME_PROBABILITY = 0.9  # of a name, and of all names of a class together
MAX_CLASS_NAMES = 3
FRICTION = "friction"

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
    if claim.probability >= MIN_NAME_PROBABILITY:
        return Statement("name", (claim.effect,), claim.probability)
    names = sorted(_names_here(claim), key=lambda each: -each.probability)
    effects, total = list[str](), 0.0
    for each in names[:MAX_CLASS_NAMES]:
        effects.append(each.effect)
        total += each.probability
        if total >= MIN_NAME_PROBABILITY:
            kind: Kind = "class" if claim.effect in effects else "nothing"
            return Statement(kind, tuple(effects), total)
    probability = max(claim.probability, _probability_of_friction(claim, names))
    return Statement("cause" if probability >= MIN_CAUSE_PROBABILITY else "nothing", (claim.effect,), probability)


def _names_here(claim: Claim) -> list[Member]:
    """The names of a class at the places of the finding, `unknown` left out."""
    places = {claim.joint, *claim.joints}
    return [each for each in claim.members if each.effect != UNKNOWN.id and each.joint in places]


def _probability_of_friction(claim: Claim, names: Sequence[Member]) -> float:
    """All laws of friction together, of a finding that is one; else 0."""
    if effect_named(claim.effect).cause != FRICTION:
        return 0.0
    return sum(each.probability for each in names if effect_named(each.effect).cause == FRICTION)
