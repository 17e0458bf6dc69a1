"""From a pruned model to claims: names, numbers, equations and rivals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim, Rival, Weighed
from armlab.diagnosis.torque.columns.links import Widths
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.names.intervals import ShapedFit, extend_with_shapes
from armlab.diagnosis.torque.predict.prediction import Prediction
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.effects.contract import Candidate, Effect
from armlab.effects.links import INERTIAL_ERROR_FACTS, LinkLaw, felt_by_ten, link_law
from armlab.effects.parameters import parameter_values


@dataclass(frozen=True)
class Names:
    """What was weighed for the findings of a model: by group of an effect, and by link (from 0)."""

    effects: Mapping[int, Weighed]
    links: Mapping[int, Weighed]


def make_claims(
    model: FittedModel,
    effects: Mapping[int, Evidence],
    links: Mapping[int, Evidence],
    prediction: Prediction,
    names: Names,
) -> tuple[Claim, ...]:
    """All claims of a model, the strongest first, without probabilities.

    Numbers are of the model on which the names were tested: beside parts that are only present they are less sure.
    """
    if not effects and not links:
        return ()
    wide = extend_with_shapes(model)
    claims = [
        replace(_effect_claim(model, wide, group, prediction.places[group], each), weighed=names.effects[group])
        for group, each in effects.items()
    ]
    claims += _link_claims(model, wide, links, names.links)
    known = list(dict.fromkeys(group.candidate.facts for group in model.solver.groups))
    claims = [_with_equal_sums(claim, claims, known) for claim in claims]
    return tuple(sorted(claims, key=lambda claim: -claim.evidence.score))


def next_experiment(effect: Effect, rivals: Sequence[Rival]) -> str | None:
    """What would tell a claim from its rivals; None where there is nothing to tell."""
    return effect.experiment or None if rivals else None


def _with_equal_sums(claim: Claim, claims: Sequence[Claim], known: Sequence[Effect]) -> Claim:
    """The claim with effects as rivals that equal its sum with another claim at its joint, for any motion.

    What not every arm has keeps its name: the rival stands beside the usual part of the sum.
    """
    here = {other.effect for other in claims if other.joint == claim.joint}
    equal = [each for each in known if any(claim.effect in pair and set(pair) <= here for pair in each.equal_sums)]
    if claim.candidate is None or not claim.candidate.facts.usual or not equal:
        return claim
    names = {each.id for each in equal}
    sums = [Rival(each.id, claim.joint, claim.joints, True) for each in equal]
    rivals = (*sums, *(each for each in claim.rivals if each.effect not in names))
    return replace(claim, rivals=rivals, next_experiment=next_experiment(claim.candidate.facts, rivals))


def _effect_claim(model: FittedModel, wide: ShapedFit, group: int, place: int, evidence: Evidence) -> Claim:
    """group: of the model; place: of the same law in the model that predicts."""
    solver = model.solver
    columns = solver.groups[group].columns
    coefficients, covariance = solver.values(model.fit, group), wide.covariance(group)
    candidate = solver.candidate(group).first_name(coefficients, model.design.scenes)
    own = np.zeros(model.moments.size)
    own[columns] = coefficients
    rivals = tuple(Rival(name, candidate.joint, candidate.joints, True) for name in candidate.identical)
    simulated = _parameters_of_simulation(candidate, model.design.simulation.coefficients_of(candidate))
    return Claim(
        effect=candidate.effect,
        joint=candidate.joint,
        joints=candidate.joints,
        parameters=parameter_values(candidate, coefficients, covariance, wide.factor),
        equation=candidate.equation(coefficients),
        evidence=evidence,
        prediction=model.columns.torque_of(own),
        rivals=rivals,
        next_experiment=next_experiment(candidate.facts, rivals),
        candidate=candidate,
        coefficients=coefficients,
        covariance=covariance,
        group=place,
        simulated=simulated,
    )


def _parameters_of_simulation(candidate: Candidate, present: Array) -> dict[str, float]:
    """Scalar parameters of a law as the simulation has it, those of its shape left out; none without such a law."""
    if not present.any():
        return {}
    shapes, values = candidate.parameters(np.zeros_like(present)), candidate.parameters(present)
    return {name: value for name, value in values.items() if isinstance(value, float) and value != shapes[name]}


def _link_claims(
    model: FittedModel, wide: ShapedFit, links: Mapping[int, Evidence], names: Mapping[int, Weighed]
) -> list[Claim]:
    """One claim for each link that is off: its ten parameters, given what the joints feel of all links."""
    design, widths = model.design, model.fit.state.widths
    if not links or design.prior is None or widths is None:
        return []
    base, covariance = wide.base()
    mean, spread = design.prior.deviations(widths, base, covariance)
    claims = []
    for link, evidence in links.items():
        place = slice(10 * link, 10 * link + 10)
        added = is_outlying(widths, link, design.settings.tuning.claims.outlying_factor)
        law = link_law(design.simulation.arm, link + 1, mean[place], spread[place, place], added=added)
        if law is not None:  # else these data tell of something that is no link
            claim = _link_claim(model, wide.factor, law, mean[place], spread[place, place], evidence)
            claims.append(replace(claim, weighed=names[link]))
    return claims


def _link_claim(
    model: FittedModel, factor: float, law: LinkLaw, mean: Array, spread: Array, evidence: Evidence
) -> Claim:
    """The claim about one link. mean (10,), spread (10, 10): what it has more than its simulation."""
    design, candidate = model.design, law.candidate
    link = candidate.joints[0]
    turn = felt_by_ten(design.simulation.arm, link)
    coefficients, covariance = turn @ mean, turn @ spread @ turn.T
    change, torque = np.zeros(10 * len(design.simulation.arm)), np.zeros(model.moments.size)
    change[10 * link - 10 : 10 * link] = mean
    torque[: len(design.base)] = design.base.grouping @ change
    rivals = tuple(Rival(each, link, (), True) for each in law.rivals)
    return Claim(
        effect=candidate.effect,
        joint=link,
        joints=(),
        parameters=parameter_values(candidate, coefficients, covariance, factor),
        equation=candidate.equation(coefficients),
        evidence=evidence,
        prediction=model.columns.torque_of(torque),
        rivals=rivals,
        next_experiment=next_experiment(candidate.facts, rivals),
        candidate=candidate,
        coefficients=coefficients,
        covariance=covariance,
        in_links=True,
    )


def links_claim(model: FittedModel, evidence: Evidence, link: int) -> Claim:
    """That links are off, where these data do not tell which: no numbers.

    evidence: for all of them together. model: on whose rows it is predicted. link: the one that is missed most, from 1.
    """
    torque, own = model.coefficients(model.fit), np.zeros(model.moments.size)
    own[: model.columns.base] = torque[: model.columns.base]
    return Claim(
        effect=INERTIAL_ERROR_FACTS.id,
        joint=link,
        joints=(),
        parameters=(),
        equation="tau += Y(q, qd, qdd) delta_phi",
        evidence=evidence,
        prediction=model.columns.torque_of(own),
        in_links=True,
    )


def is_outlying(widths: Widths, link: int, factor: float) -> bool:
    """Whether a link (from 0) is off `factor` times more than the others: something was added to it."""
    others = [width for other, width in enumerate(widths) if other != link]
    return not others or widths[link] >= factor * float(np.median(others))
