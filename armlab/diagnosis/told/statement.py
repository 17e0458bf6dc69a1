"""How a finding may be stated: by its name, as one of a few names, as a cause without its law, or not at all."""

from collections.abc import Sequence, Set
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
    return state_name(claim.effect, claim.probability, claim.members, {claim.joint, *claim.joints})


def state_name(effect: str, probability: float, members: Sequence[Member], places: Set[int | None]) -> Statement:
    """How an effect with a probability is stated, of a class of names with theirs. places: joints of the finding."""
    if probability >= MIN_NAME_PROBABILITY:
        return Statement("name", (effect,), probability)
    here = [each for each in members if each.effect != UNKNOWN.id and each.joint in places]
    names = sorted(here, key=lambda each: -each.probability)
    effects, total = list[str](), 0.0
    for each in names[:MAX_CLASS_NAMES]:
        effects.append(each.effect)
        total += each.probability
        if total >= MIN_NAME_PROBABILITY:
            kind: Kind = "class" if effect in effects else "nothing"
            return Statement(kind, tuple(effects), total)
    chance = max(probability, _probability_of_friction(effect, names))
    return Statement("cause" if chance >= MIN_CAUSE_PROBABILITY else "nothing", (effect,), chance)


def _probability_of_friction(effect: str, names: Sequence[Member]) -> float:
    """All laws of friction together, of an effect that is one; else 0."""
    if effect_named(effect).cause != FRICTION:
        return 0.0
    return sum(each.probability for each in names if effect_named(each.effect).cause == FRICTION)
