"""From probabilities to what a finding is called: a name, a class of names, or `unknown`."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Final

import numpy as np

from armlab.diagnosis.claims import next_experiment
from armlab.diagnosis.naming.choice import Numbers, probabilities
from armlab.diagnosis.result import Claim, Member, Weighed, WeighedName
from armlab.diagnosis.tuning import NamingTuning
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named

CALIBRATION_FILE: Final = "calibration.json"
MOTION_AXES: Final = ("velocity", "position", "acceleration")


@cache
def calibrated_weights() -> Numbers:
    """The weights of what speaks for a name, as they were found on development sets (`armlab calibrate`)."""
    content = json.loads(files(__package__).joinpath(CALIBRATION_FILE).read_text(encoding="utf-8"))
    return {str(key): float(value) for key, value in content["weights"].items()}


@dataclass(frozen=True)
class Naming:
    """What a finding may be called. answers: its names, and `unknown` for none of them, the likeliest first.

    open: how many of the likeliest answers reach the level together; 0 where more are needed than a class may have.
    sure: whether names alone reach it, without `unknown`.
    """

    answers: tuple[Member, ...]
    open: int
    sure: bool

    @property
    def is_unknown(self) -> bool:
        """Whether no name can be claimed: too many are open, or none of them is likelier than that none is right."""
        return self.open == 0 or self.answers[0].effect == UNKNOWN.id

    def probability_of(self, effect: str, joint: int | None) -> float:
        """Of a name at a place, or of `unknown` at any."""
        named = (each for each in self.answers if each.is_of(effect, joint) or effect == each.effect == UNKNOWN.id)
        return sum(each.probability for each in named)

    def members(self, tuning: NamingTuning) -> tuple[Member, ...]:
        """What is left open: the class, or what an unknown may be; empty for one name."""
        if self.is_unknown:
            return tuple(each for each in self.answers[: tuning.max_class] if each.probability >= tuning.shown)
        return self.answers[: self.open] if self.open > 1 else ()


def with_probabilities(weighed: Weighed) -> list[tuple[WeighedName, float]]:
    """Each name of a finding, and none of them, with its probability."""
    chances = probabilities([each.numbers for each in weighed], calibrated_weights())
    return [(each, float(chance)) for each, chance in zip(weighed, chances, strict=True)]


def naming_of(weighed: Weighed, tuning: NamingTuning) -> Naming:
    """The probabilities of the names of a finding, and what of that is claimed."""
    pairs = sorted(with_probabilities(weighed), key=lambda pair: -pair[1])
    names = [chance for each, chance in pairs if not each.is_none]
    enough = np.flatnonzero(np.cumsum([chance for _, chance in pairs])[: tuning.max_class] >= tuning.level)
    return Naming(
        answers=tuple(Member(each.effect, each.joint, each.joints, chance) for each, chance in pairs),
        open=int(enough[0]) + 1 if len(enough) else 0,
        sure=sum(names[: tuning.max_class]) >= tuning.level,
    )


def named_claims(claims: Sequence[Claim], tuning: NamingTuning) -> tuple[Claim, ...]:
    """Claims with their probabilities; names that no motion separates count together.

    Those without a name are one finding a joint.
    """
    out = list[Claim]()
    for each in (_named(claim, tuning) for claim in claims):
        there = next((at for at, other in enumerate(out) if _are_one(each, other)), None)
        if there is None:
            out.append(each)
        else:
            out[there] = _together(out[there], each)
    return tuple(out)


def _named(claim: Claim, tuning: NamingTuning) -> Claim:
    naming = naming_of(claim.weighed, tuning)
    # friction and offsets are on every arm: the law may be another one, but something of the kind is there
    expected = claim.candidate is not None and (claim.candidate.facts.usual or claim.candidate.is_friction)
    if claim.effect == UNKNOWN.id or (naming.is_unknown and not expected):
        return _without_name(claim, naming, tuning)
    identical = [each for each in claim.rivals if each.identical]
    known = {(each.effect, each.joint) for each in identical}
    chance = sum(naming.probability_of(*each) for each in {(claim.effect, claim.joint), *known})
    members = naming.members(tuning) if chance < tuning.level else ()
    others = [each for each in members if each.effect != UNKNOWN.id and not each.is_of(claim.effect, claim.joint)]
    rivals = [*identical, *(each.as_rival for each in others if (each.effect, each.joint) not in known)]
    return replace(
        claim,
        probability=chance,
        members=members,
        rivals=tuple(rivals[: tuning.max_class - 1]),
        next_experiment=next_experiment(effect_named(claim.effect), rivals),
    )


def _without_name(claim: Claim, naming: Naming, tuning: NamingTuning) -> Claim:
    """The finding `unknown` in the place of a claim, with what it may be."""
    joint = claim.evidence.joint + 1
    depends_on = claim.depends_on
    if claim.candidate is not None:
        axis = claim.candidate.facts.axis
        depends_on = (f"{axis}_{joint}",) if axis in MOTION_AXES else ()
    return replace(
        claim,
        effect=UNKNOWN.id,
        joint=joint,
        joints=(joint,),
        parameters=(),
        equation=f"tau_{joint} += f({', '.join(depends_on) or 'the motion'})",
        rivals=(),
        next_experiment=UNKNOWN.experiment,
        candidate=None,
        coefficients=None,
        covariance=None,
        depends_on=depends_on,
        in_links=False,
        group=None,
        probability=naming.probability_of(UNKNOWN.id, joint),
        members=naming.members(tuning) if naming.is_unknown else naming.answers[: naming.open],
    )


def _are_one(one: Claim, other: Claim) -> bool:
    return one.effect == other.effect == UNKNOWN.id and one.joint == other.joint


def _together(one: Claim, other: Claim) -> Claim:
    """Two findings without a name at one joint: one finding, as unknown as the more unknown one."""
    first, second = (one, other) if (one.probability or 0.0) >= (other.probability or 0.0) else (other, one)
    variables = tuple(dict.fromkeys((*first.depends_on, *second.depends_on)))
    return replace(
        first,
        prediction=first.prediction + second.prediction,
        depends_on=variables,
        equation=f"tau_{first.joint} += f({', '.join(variables) or 'the motion'})",
    )
