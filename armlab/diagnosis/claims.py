"""From a pruned model to claims: names, numbers, equations and rivals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.added_body import bodies_that_fit, neighbours_that_fit
from armlab.diagnosis.evidence import Evidence
from armlab.diagnosis.fitted_model import FittedModel
from armlab.diagnosis.intervals import ShapedFit, extend_with_shapes
from armlab.diagnosis.links import Widths
from armlab.diagnosis.prediction import Prediction
from armlab.diagnosis.result import Claim, Rival
from armlab.diagnosis.search import Search
from armlab.diagnosis.solver import State
from armlab.effects.contract import Candidate, Effect
from armlab.effects.links import LinkLaw, felt_values, link_law
from armlab.effects.parameters import parameter_values


def make_claims(
    model: FittedModel, effects: dict[int, Evidence], links: dict[int, Evidence], prediction: Prediction
) -> tuple[Claim, ...]:
    """All claims of a model, the strongest first.

    Numbers are of the model on which the names were tested: beside parts that are only present they are less sure.
    """
    if not effects and not links:
        return ()
    wide = extend_with_shapes(model)
    claims = [_effect_claim(model, wide, group, prediction.places[group], each) for group, each in effects.items()]
    claims += _link_claims(model, wide, links)
    known = list(dict.fromkeys(group.candidate.facts for group in model.solver.groups))
    most = model.design.settings.tuning.claims.max_rivals
    claims = [_with_equal_sums(claim, claims, known, most) for claim in claims]
    return tuple(sorted(claims, key=lambda claim: -claim.evidence.score))


def next_experiment(effect: Effect, rivals: Sequence[Rival]) -> str | None:
    """What would tell a claim from its rivals; None where there is nothing to tell."""
    return effect.experiment or None if rivals else None


def _with_equal_sums(claim: Claim, claims: Sequence[Claim], known: Sequence[Effect], most: int) -> Claim:
    """The claim with effects as rivals that equal its sum with another claim at its joint, for any motion.

    What not every arm has keeps its name: the rival stands beside the usual part of the sum. most: rivals of a claim.
    """
    here = {other.effect for other in claims if other.joint == claim.joint}
    equal = [each for each in known if any(claim.effect in pair and set(pair) <= here for pair in each.equal_sums)]
    if claim.candidate is None or not claim.candidate.facts.usual or not equal:
        return claim
    names = {each.id for each in equal}
    sums = [Rival(each.id, claim.joint, claim.joints, True) for each in equal]
    rivals = (*sums, *(each for each in claim.rivals if each.effect not in names))[:most]
    return replace(claim, rivals=rivals, next_experiment=next_experiment(claim.candidate.facts, rivals))


def _effect_claim(model: FittedModel, wide: ShapedFit, group: int, place: int, evidence: Evidence) -> Claim:
    """group: of the model; place: of the same law in the model that predicts."""
    solver = model.solver
    columns = solver.groups[group].columns
    coefficients, covariance = solver.values(model.fit, group), wide.covariance(group)
    candidate = solver.groups[group].candidate.first_name(coefficients, model.design.scenes)
    own = np.zeros(model.moments.size)
    own[columns] = coefficients
    rivals = (*neighbours_that_fit(model, group), *find_rivals(model, group, candidate))
    rivals = rivals[: model.design.settings.tuning.claims.max_rivals]
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
    )


def find_rivals(model: FittedModel, group: int, own: Candidate) -> tuple[Rival, ...]:
    """What these data cannot tell from a group of a model; the best first. own: its candidate, first name."""
    solver, state, tuning = model.solver, model.state, model.design.settings.tuning.claims
    out = [Rival(name, own.joint, own.joints, True) for name in own.identical]
    search = Search(solver, model.design.settings, True, 0)
    without = state.minus(group)
    scores = search.gains(without)
    full = model.moments.heldout_error(model.fit.coefficients)
    for number in np.argsort(-scores):
        rival = int(number)
        deficit = float(scores[group] - scores[rival])
        if deficit > tuning.max_deficit or len(out) >= tuning.max_rivals:
            break
        candidate = solver.groups[rival].candidate
        same = candidate.effect == own.effect and candidate.joint == own.joint
        known = any((each.effect, each.joint) == (candidate.effect, candidate.joint) for each in out)
        if same or known or search.excluded(without, rival):
            continue
        other = search.with_group(without, rival)
        if search.objection(other, rival) is None and _predicts_as_well(model, other, full):
            out.append(Rival(candidate.effect, candidate.joint, candidate.joints, False, max(deficit, 0.0)))
    return tuple(out)


def _predicts_as_well(model: FittedModel, other: State, full: Array) -> bool:
    error = model.moments.heldout_error(model.solver.fit(other).coefficients)
    return bool(np.all(error <= (1 + model.design.settings.tuning.claims.held_out_tolerance) * full))


def _link_claims(model: FittedModel, wide: ShapedFit, links: dict[int, Evidence]) -> list[Claim]:
    """One claim for each link that is off: its ten parameters, given what the joints feel of all links."""
    bench, widths = model.design, model.fit.state.widths
    if not links or bench.prior is None or widths is None:
        return []
    base, covariance = wide.base()
    mean, spread = bench.prior.deviations(widths, base, covariance)
    claims = []
    for link, evidence in links.items():
        place = slice(10 * link, 10 * link + 10)
        added = is_outlying(widths, link, bench.settings.tuning.claims.outlying_factor)
        law = link_law(bench.simulation.arm, link + 1, mean[place], spread[place, place], added=added)
        claims.append(_link_claim(model, wide.factor, law, mean[place], spread[place, place], evidence))
    return claims


def _link_claim(
    model: FittedModel, factor: float, law: LinkLaw, mean: Array, spread: Array, evidence: Evidence
) -> Claim:
    """The claim about one link. mean (10,), spread (10, 10): what it has more than its simulation."""
    bench, candidate = model.design, law.candidate
    link = candidate.joints[0]
    turn = np.column_stack([felt_values(bench.simulation.arm, link, unit) for unit in np.eye(10)])
    coefficients, covariance = turn @ mean, turn @ spread @ turn.T
    change, torque = np.zeros(10 * len(bench.simulation.arm)), np.zeros(model.moments.size)
    change[10 * link - 10 : 10 * link] = mean
    torque[: len(bench.base)] = bench.base.grouping @ change
    rivals = tuple(Rival(each, link, (), True) for each in law.rivals)
    known = {(candidate.effect, link), *((each.effect, each.joint) for each in rivals)}
    rivals += tuple(each for each in bodies_that_fit(model, link) if (each.effect, each.joint) not in known)
    rivals = rivals[: bench.settings.tuning.claims.max_rivals]
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


def is_outlying(widths: Widths, link: int, factor: float) -> bool:
    """Whether a link (from 0) is off `factor` times more than the others: something was added to it."""
    others = [width for other, width in enumerate(widths) if other != link]
    return not others or widths[link] >= factor * float(np.median(others))
