"""From probabilities to what a finding is called: a name, a class of names, or `unknown`."""

import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any, Final

import numpy as np

from armlab.common.told import MAX_CLASS_NAMES, MIN_CAUSE_PROBABILITY, MIN_NAME_PROBABILITY
from armlab.diagnosis.choice import Weights, probabilities
from armlab.diagnosis.result import Claim, Member, Weighed, WeighedName
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.names.claims import next_experiment
from armlab.diagnosis.torque.names.findings import statement_of
from armlab.diagnosis.torque.search.search import FailedTest, Step
from armlab.diagnosis.tuning import NamingTuning
from armlab.effects.contract import UNKNOWN
from armlab.effects.friction_curve import FRICTION_CURVE_FACTS
from armlab.effects.library import effect_named

CALIBRATION_FILE: Final = "calibration.json"
LIMIT_FILE: Final = "unknown_limit.json"
MOTION_AXES: Final = ("velocity", "position", "acceleration")


@cache
def calibrated_weights(left_out: str = "") -> Weights:
    """The weights of what speaks for a name, as they were found on development sets (`armlab proof calibrate-names`).

    left_out: a public recording whose own cases they do not know.
    """
    content = _calibration()
    known = content["left_out"].get(left_out, content["all"])
    return Weights({str(key): float(value) for key, value in known["weights"].items()}, float(known["lapse"]))


def sets_of_weights() -> tuple[str, ...]:
    """The development sets from which the weights are."""
    return tuple(map(str, _calibration()["sets"]))


def _calibration() -> dict[str, Any]:
    return dict(json.loads(files(__package__).joinpath(CALIBRATION_FILE).read_text(encoding="utf-8")))


@cache
def unknown_limit() -> float:
    """How sure a finding may be that it is unknown: as often as such ones were right (`proof calibrate-unknown`)."""
    return float(json.loads(files(__package__).joinpath(LIMIT_FILE).read_text(encoding="utf-8"))["limit"])


@dataclass(frozen=True)
class Naming:
    """What a finding may be called. answers: its names, and `unknown` for none of them, the likeliest first.

    claimed: the fewest of the likeliest answers that reach the level together, `unknown` perhaps among them; empty
    where more are needed than a class may have, or their names alone are not probable enough.
    """

    answers: tuple[Member, ...]
    claimed: tuple[Member, ...]

    @property
    def is_unknown(self) -> bool:
        """Whether no name and no class of names is probable enough."""
        return not self.claimed

    def may_be(self, effect: str, joint: int | None) -> bool:
        """Whether a name is the one, or of the class, that is claimed."""
        return any(each.is_of(effect, joint) for each in self.claimed)

    def probability_of(self, effect: str, joint: int | None) -> float:
        """Of a name at a place, or of `unknown` at any."""
        named = (each for each in self.answers if each.is_of(effect, joint) or effect == each.effect == UNKNOWN.id)
        return sum(each.probability for each in named)

    def members(self, tuning: NamingTuning) -> tuple[Member, ...]:
        """What is left open: the class, or what an unknown may be; empty for one name."""
        if self.is_unknown:
            return tuple(each for each in self.answers[:MAX_CLASS_NAMES] if each.probability >= tuning.shown)
        return self.claimed if len(self.claimed) > 1 else ()


def with_probabilities(weighed: Weighed, settings: Settings) -> list[tuple[WeighedName, float]]:
    """Each name of a finding, and none of them, with its probability."""
    chances = probabilities([each.numbers for each in weighed], settings.weights or calibrated_weights())
    return [(each, float(chance)) for each, chance in zip(weighed, chances, strict=True)]


def naming_of(weighed: Weighed, settings: Settings) -> Naming:
    """The probabilities of the names of a finding, and what of that is claimed."""
    pairs = with_probabilities(weighed, settings)
    return _naming([Member(each.effect, each.joint, each.joints, chance) for each, chance in pairs], settings)


def _naming(weighed: Iterable[Member], settings: Settings) -> Naming:
    tuning = settings.tuning.naming
    answers = tuple(sorted(weighed, key=lambda each: -each.probability))
    likeliest = np.cumsum([each.probability for each in answers[:MAX_CLASS_NAMES]])
    enough = np.flatnonzero(likeliest >= MIN_NAME_PROBABILITY)
    together = answers[: enough[0] + 1] if len(enough) else ()
    named = sum(each.probability for each in together if each.effect != UNKNOWN.id)
    return Naming(answers, claimed=together if named >= tuning.least_names else ())


def named_claims(claims: Sequence[Claim], settings: Settings, plain: Collection[int] = ()) -> tuple[Claim, ...]:
    """Claims with their probabilities; names that no motion separates count together.

    Those without a name are one finding a joint; a law that loses its name and hardly lowers held-out errors is none.
    plain: joints, from 1, of whose friction the simulation says nothing. Every arm has friction and offsets: there they
    keep the law that was found, and only the law is in doubt. A link that is off keeps its name, too, where nothing is
    likelier: no simulation knows its links exactly. What follows the velocity of its joint alone and brakes is friction
    whatever its law: of a curve that none of the names is right is no answer either.
    """
    out, least = list[Claim](), settings.tuning.naming.least_unnamed_fall
    for claim in claims:
        each = _named(claim, settings, plain)
        loses_its_name = claim.effect != UNKNOWN.id and each.effect == UNKNOWN.id
        if loses_its_name and claim.evidence.fall < least:
            continue
        there = next((at for at, other in enumerate(out) if _are_one(each, other)), None)
        if there is None:
            out.append(each)
        else:
            out[there] = _together(out[there], each)
    return tuple(map(_limited, _with_curves(out, plain)))


def _with_curves(claims: Sequence[Claim], plain: Collection[int]) -> Iterator[Claim]:
    """The claims; friction that is likelier none of the formulas is a curve, where no other of its joint is told."""
    told = {each.joint for each in claims if _is_friction(each) and statement_of(each).kind != "nothing"}
    for each in claims:
        curve = next((other for other in each.members if other.effect == FRICTION_CURVE_FACTS.id), None)
        if curve is None or each.joint not in plain or each.joint in told or not _is_friction(each):
            yield each
        else:
            told |= {each.joint}
            yield _as_curve(each, curve.probability)


def _as_curve(claim: Claim, probability: float) -> Claim:
    """A claim of friction by a formula as one of friction by a curve, whose numbers are those of all friction there."""
    return replace(
        _without_law(claim),
        effect=FRICTION_CURVE_FACTS.id,
        equation=f"tau_{claim.joint} += F(velocity_{claim.joint})",
        next_experiment=FRICTION_CURVE_FACTS.experiment,
        probability=probability,
    )


def _without_law(claim: Claim) -> Claim:
    """The claim without the numbers of its law and what resembles it."""
    return replace(claim, parameters=(), rivals=(), candidate=None, coefficients=None, covariance=None)


def _is_friction(claim: Claim) -> bool:
    return claim.candidate is not None and claim.candidate.facts.cause == "friction"


def lost_names(before: Sequence[Claim], after: Sequence[Claim], settings: Settings) -> Iterator[Step]:
    """For the log: which laws of claims are not told by their name. before, after: without and with probabilities."""
    told = {(each.effect, each.joint) for each in after}
    for claim in before:
        if claim.candidate is not None and (claim.effect, claim.joint) not in told:
            chance = naming_of(claim.weighed, settings).probability_of(claim.effect, claim.joint)
            text = f"its probability is {chance:.2g}"
            failed = FailedTest("probability of the name", text, chance, MIN_NAME_PROBABILITY)
            yield replace(Step.against(claim.candidate, failed, "told without its name"), stage=named_claims.__name__)


def _limited(claim: Claim) -> Claim:
    """A finding that is no surer to have no name than such findings were right."""
    if claim.effect != UNKNOWN.id or claim.probability is None:
        return claim
    limit = unknown_limit()
    members = (
        replace(each, probability=min(each.probability, limit)) if each.effect == UNKNOWN.id else each
        for each in claim.members
    )
    return replace(claim, probability=min(claim.probability, limit), members=tuple(members))


def _named(claim: Claim, settings: Settings, plain: Collection[int]) -> Claim:
    naming, tuning = naming_of(claim.weighed, settings), settings.tuning.naming
    usual = claim.candidate is not None and (claim.candidate.facts.usual or claim.candidate.is_friction)
    has = claim.candidate is not None and (claim.candidate.facts.usual or _is_friction(claim))
    if has and (claim.evidence.joint + 1 in plain or claim.effect == FRICTION_CURVE_FACTS.id):
        naming = _naming(_given_that_it_is_there(naming.answers, claim), settings)
    identical = [each for each in claim.rivals if each.identical]
    known = {(each.effect, each.joint) for each in identical}
    own = {(claim.effect, claim.joint), *known}
    nameless = not any(naming.may_be(*each) for each in own)
    likeliest = claim.in_links and naming.answers[0].is_of(claim.effect, claim.joint)
    keeps_law = likeliest or (usual and claim.evidence.joint + 1 in plain) or _is_friction_for_sure(claim, naming)
    if claim.effect == UNKNOWN.id or (nameless and not keeps_law):
        return _without_name(claim, naming, tuning)
    chance = min(sum(naming.probability_of(*each) for each in own), 1.0)
    members = (naming.members(tuning) or naming.claimed) if chance < MIN_NAME_PROBABILITY else ()
    others = [each for each in members if each.effect != UNKNOWN.id and not each.is_of(claim.effect, claim.joint)]
    rivals = [*identical, *(each.as_rival for each in others if (each.effect, each.joint) not in known)]
    return replace(
        claim,
        probability=chance,
        members=members,
        rivals=tuple(rivals[: MAX_CLASS_NAMES - 1]),
        next_experiment=next_experiment(effect_named(claim.effect), rivals),
    )


def _is_friction_for_sure(claim: Claim, naming: Naming) -> bool:
    """Whether a law of friction is likelier friction of its joint than not, by whatever law."""
    if not _is_friction(claim):
        return False
    laws = (each for each in naming.answers if each.joint == claim.joint and each.effect != UNKNOWN.id)
    friction = sum(each.probability for each in laws if effect_named(each.effect).cause == "friction")
    return friction >= MIN_CAUSE_PROBABILITY


def _given_that_it_is_there(answers: Sequence[Member], claim: Claim) -> Iterator[Member]:
    """The names of what every arm has and the simulation does not: that none of them is right is no answer.

    Friction that is none of the formulas is friction by another curve. A constant torque has no other law: there the
    names share what `unknown` had.
    """
    none = sum(each.probability for each in answers if each.effect == UNKNOWN.id)
    names = [each for each in answers if each.effect != UNKNOWN.id]
    if not _is_friction(claim):
        yield from (replace(each, probability=each.probability / max(1 - none, 1e-300)) for each in names)
        return
    curve = Member(FRICTION_CURVE_FACTS.id, claim.joint, claim.joints, none)
    for each in names:
        if each.is_of(curve.effect, curve.joint):
            curve = replace(curve, probability=none + each.probability)
        else:
            yield each
    yield curve


def _without_name(claim: Claim, naming: Naming, tuning: NamingTuning) -> Claim:
    """The finding `unknown` in the place of a claim, with what it may be."""
    joint = claim.evidence.joint + 1
    depends_on = claim.depends_on
    if claim.candidate is not None:
        axis = claim.candidate.facts.axis
        depends_on = (f"{axis}_{joint}",) if axis in MOTION_AXES else ()
    return replace(
        _without_law(claim),
        effect=UNKNOWN.id,
        joint=joint,
        joints=(joint,),
        equation=f"tau_{joint} += f({', '.join(depends_on) or 'the motion'})",
        next_experiment=UNKNOWN.experiment,
        depends_on=depends_on,
        in_links=False,
        group=None,
        unnamed=() if claim.group is None else (claim.group,),
        probability=naming.probability_of(UNKNOWN.id, joint),
        members=tuple(each for each in naming.answers[:MAX_CLASS_NAMES] if each.probability >= tuning.shown),
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
        left_out=first.left_out + second.left_out,
        unnamed=(*first.unnamed, *second.unnamed),
        depends_on=variables,
        equation=f"tau_{first.joint} += f({', '.join(variables) or 'the motion'})",
    )
