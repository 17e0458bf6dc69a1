"""From what is believed in the end to a diagnosis: claims, the model that is delivered, and what each part explains."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from armlab.common.errors import DataError
from armlab.diagnosis.formats import Status
from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Unexplained, Weighed
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Judge, count_looks
from armlab.diagnosis.torque.evidence.plausibility import (
    links_that_data_tell,
)
from armlab.diagnosis.torque.evidence.unknown import (
    is_form_error,
    make_unknown_claim,
    remaining,
)
from armlab.diagnosis.torque.location import locate_excess, noise_floor
from armlab.diagnosis.torque.names.claims import Names, links_claim, make_claims
from armlab.diagnosis.torque.names.decide import lost_names, named_claims, naming_of, with_probabilities
from armlab.diagnosis.torque.names.findings import stated_findings, with_minor_ones, without_lesser_unknowns
from armlab.diagnosis.torque.names.weighing import weigh_effect, weigh_link, weigh_structure
from armlab.diagnosis.torque.predict.fits import identified_model, joint_fits
from armlab.diagnosis.torque.predict.found_model import build_model
from armlab.diagnosis.torque.predict.joint_friction import joint_friction
from armlab.diagnosis.torque.predict.parts import (
    LINKS,
    as_found,
    claim_facts,
    explain_error,
    is_in_no_model,
    weigh_claims,
    weigh_parts,
)
from armlab.diagnosis.torque.predict.prediction import (
    Prediction,
    choose_smoothing,
    filtered_residual,
    fit_with_prior,
    with_smoothing_of,
    with_usual,
)
from armlab.diagnosis.torque.predict.yardstick import (
    Yardstick,
    predicts_better,
    squared_errors,
    with_claims,
)
from armlab.diagnosis.torque.rows.data import Observed, identification_runs, rows_in
from armlab.diagnosis.torque.search.fitted_model import (
    FittedModel,
    inertial_parameters,
)
from armlab.diagnosis.torque.search.search import Search
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.diagnosis.tuning import UnknownTuning, changed_numbers
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.recording import ROLES, Recording, Role

SMALLEST_SHARE = 1e-6  # of the torque


@dataclass(frozen=True, eq=False)
class NamedClaims:
    """Claims with a name, a class or none. model: with the reasons in its log. weighed: all names that were weighed.

    unknowns: structure that is a finding `unknown`; remains: all structure that is left.
    """

    model: FittedModel
    claims: tuple[Claim, ...]
    weighed: tuple[Weighed, ...]
    unknowns: Sequence[Structure]
    remains: Sequence[Structure]


def name_claims(belief: Belief) -> NamedClaims:
    """The claims of what is believed in the end, each with its name."""
    remains, names, settings = remaining(belief), _weigh_names(belief), belief.model.design.settings
    nameless = {group for group, each in names.effects.items() if naming_of(each, settings).is_unknown}
    explained = {group: each for group, each in belief.effects.items() if group not in nameless} | dict(belief.present)
    unknowns = [each for each in remains if not is_form_error(each, explained, belief.tuning.unknown)]
    model, claims = _claims_of(belief, names, remains, unknowns)
    weighed = tuple(claim.weighed for claim in claims)
    plain = model.design.simulation.joints_without_friction
    named = named_claims(claims, settings, plain)
    model = replace(model, steps=(*model.steps, *lost_names(claims, named, settings)))
    return NamedClaims(model, named, weighed, unknowns, remains)


def conclude(recording: Recording, belief: Belief) -> Diagnosis:
    """The diagnosis of a recording from what is believed in the end."""
    prediction, named = belief.prediction, name_claims(belief)
    assert prediction is not None
    claims = (*named.claims, *links_in_doubt(named.model, prediction.model, named.claims, belief.left))
    claims = stated_findings(weigh_claims(prediction.model, claims), named.model.columns.joints)
    found = _assemble(recording, named.model, prediction, claims, named.unknowns, named.remains)
    return replace(found, weighed=named.weighed)


def _weigh_names(belief: Belief) -> Names:
    """The names that each effect, and each link that is off, could have."""
    model, effects = belief.model, belief.effects
    return Names(
        {group: belief.weighed.get(group) or weigh_effect(model, group, effects, belief.left) for group in effects},
        {link: weigh_link(model, link, each, effects, belief.left) for link, each in belief.links.items()},
    )


def _claims_of(
    belief: Belief, names: Names, remains: Sequence[Structure], unknowns: Sequence[Structure]
) -> tuple[FittedModel, tuple[Claim, ...]]:
    """The model with the reasons against claims in its log, and all claims, before a name is chosen for each."""
    model, effects, links = belief.model, belief.effects, belief.links
    assert belief.prediction is not None
    claims = make_claims(model, effects, links, belief.prediction, names)
    told, claims = links_that_data_tell(model, claims, remains)
    residual = model.residual(model.fit)
    structures = (make_unknown_claim(told, each, residual, weigh_structure(told, each, effects)) for each in unknowns)
    return told, (*claims, *structures)


def links_in_doubt(
    names: FittedModel, model: FittedModel, claims: Sequence[Claim], left: Sequence[Structure]
) -> Iterator[Claim]:
    """That links are off, where no claim says so and the model that predicts holds links that are.

    names: the model of the claims, model: the one that predicts; left: what is left at the joints. Links that were
    given to be fitted are no finding. That any link is off is as probable as all names of links together.
    """
    widths = model.state.widths
    about_links = any(claim_facts(each).where == "link" for each in claims)
    if model.design.simulation.kind == "nominal" and widths is not None and any(widths) and not about_links:
        evidence = Judge(model, model.state).together()
        off = [links_claim(names, evidence, link) for link, width in enumerate(widths, 1) if width]
        together = next(part for part in weigh_parts(model, off[:1]) if part.cause == LINKS and part.joint is None)
        if together.removal is not None and not together.removal.is_minor:
            most = max(weigh_claims(model, off), key=lambda each: each.removal.growth if each.removal else 0.0)
            assert most.joint is not None
            beside = [each.group for each in claims if each.group is not None]
            weighed = weigh_link(model, most.joint - 1, evidence, beside, left)
            chances = with_probabilities(weighed, model.design.settings)
            of_links = (chance for each, chance in chances if effect_named(each.effect).where == "link")
            yield replace(most, probability=sum(of_links))


def _assemble(
    recording: Recording,
    model: FittedModel,
    prediction: Prediction,
    claims: tuple[Claim, ...],
    unknowns: Sequence[Structure],
    remains: Sequence[Structure],
) -> Diagnosis:
    """The diagnosis of a model. unknowns: structure that is a finding `unknown`; remains: all structure."""
    design, observed, tuning = model.design, model.design.observed, model.design.settings.tuning
    simulation, settings = design.simulation, _settings_used(design.settings)
    named = {each.group: each for each in claims if each.group is not None}
    notes = {
        "settings": settings,
        "white_errors_at_joints": [joint for joint, taps in enumerate(model.noise.taps, 1) if len(taps) == 1],
        "unknown": [each.equation for each in claims if each.effect == UNKNOWN.id],
        "in_links": [f"{each.effect}: {each.equation}" for each in claims if each.in_links],
    }
    plain = prediction.plain
    is_plain_best = plain is not None and simulation.kind != "simulated" and _is_beaten_by(plain, prediction)
    built = build_model(recording, simulation, prediction.model, named, notes)
    found = choose_smoothing(built, plain, observed)
    if is_plain_best:
        assert plain is not None
        found = _delivered(plain, found, observed, claims)
    alone = build_model(recording, simulation, prediction.with_names_alone(named), named, {})
    alone = with_smoothing_of(found, alone)
    final = filtered_residual(found, observed)
    rigid = identified_model(found, plain, observed, is_rigid=True)
    refit = filtered_residual(rigid, observed)
    if simulation.kind == "simulated" or (simulation.model is not None and simulation.model.effects):
        refit = model.residual(model.solver.fit(State((), None)))  # links beside what else the simulation has
    start = refit if simulation.kind == "refit" else design.target
    noise = final.copy()
    for each in unknowns:
        noise[:, each.joint] -= each.prediction
    floor = noise_floor(noise, design.features, observed, tuning)
    fits = joint_fits(refit, (rigid, found, alone), plain, floor, observed, tuning)
    parts = explain_error(prediction.model, observed, claims, (start, final), floor)
    claims = without_lesser_unknowns(claims, parts)
    parts = explain_error(prediction.model, observed, claims, (start, final), floor)
    errors = {each.joint - 1: each.after for each in fits}
    parts = tuple(replace(each, removal=as_found(each.removal, errors, observed)) for each in parts)
    claims = tuple(
        each if is_in_no_model(each) else replace(each, removal=as_found(each.removal, errors, observed))
        for each in claims
    )
    claims = with_minor_ones(claims, parts)
    unnamed = _unnamed_gain(fits, tuning.unknown) if not claims else None
    status: Status = "mismatch" if claims else "none" if unnamed is None else "inconclusive"
    base, covariance = prediction.model.base_parameters()
    held = fit_with_prior(design, model.noise, model.state.widths)
    return Diagnosis(
        recording=recording,
        simulation=simulation,
        status=status,
        observed=observed,
        nominal=design.target,
        refit=refit,
        final=final,
        inertial=inertial_parameters(prediction.model),
        model=found,
        named_model=alone,
        base_values=base,
        base_covariance=covariance,
        claims=claims,
        parts=parts,
        is_plain=is_plain_best,
        friction=joint_friction(replace(held, state=with_usual(held, _beside_friction(model, named)))),
        located=locate_excess(start, floor, observed, tuning) if claims else (),
        unexplained=tuple(
            Unexplained(each.joint + 1, float(np.clip(each.share, 0, 1)), each.depends_on) for each in remains
        ),
        fit=fits,
        steps=model.steps,
        not_taken=tuple(Search(model.solver, design.settings, True, 0).not_taken(model.state)),
        looks=count_looks(model),
        settings=settings,
        unnamed=unnamed,
        left=_shares_left(found, prediction.judged),
    )


def _beside_friction(model: FittedModel, claimed: Collection[int]) -> tuple[int, ...]:
    """The effects of a model beside which friction is measured.

    What follows a velocity, is no friction, and is not claimed would take the place of friction.
    """
    facts = {group: model.candidate(group).facts for group in model.state.groups}
    takes = {
        group for group, each in facts.items() if each.axis == "velocity" and not model.candidate(group).is_friction
    }
    return tuple(group for group in model.state.groups if group in claimed or group not in takes)


def _shares_left(model: TorqueModel, observed: Observed) -> dict[Role, float]:
    """What a model leaves of the torque of each role: over its scatter, geometric mean over the joints."""
    residual, out = filtered_residual(model, observed), {}
    for role in ROLES:
        rows = rows_in(observed.of_role(role), observed.rows)
        spread = np.std(observed.torque[rows], axis=0)
        left = np.sqrt(np.mean(residual[rows] ** 2, axis=0))[spread > 0] / spread[spread > 0]
        out[role] = float(np.exp(np.mean(np.log(np.maximum(left, SMALLEST_SHARE)))))
    return out


def _unnamed_gain(fits: Sequence[JointFit], tuning: UnknownTuning) -> JointFit | None:
    """The joint whose held-out error falls most with parts that are present and not claimed, where that is much."""
    worst = min(fits, key=lambda each: each.after / max(each.before, 1e-300))
    return worst if worst.after < (1 - tuning.unclaimed_fall) * worst.before else None


def _is_beaten_by(plain: Yardstick, prediction: Prediction) -> bool:
    """Whether plain least squares predicts blocks of the runs that identify better than the model that predicts."""
    try:
        errors = squared_errors(plain, prediction.judged, prediction.block)
    except DataError:
        return False
    return predicts_better(
        errors, prediction.squared_errors, prediction.model.design.settings.tuning.prediction.min_trial_gain
    )


def _delivered(plain: Yardstick, found: TorqueModel, observed: Observed, claims: Sequence[Claim]) -> TorqueModel:
    """Plain least squares in the place of a model, with its robot and provenance."""
    model = with_claims(
        plain.as_torque_model(identification_runs(observed)), [(each.effect, each.joint) for each in claims]
    )
    return replace(model, robot=found.robot, provenance={**found.provenance, "model": "plain least squares"})


def _settings_used(settings: Settings) -> dict[str, float | str | bool]:
    """Guards, cut-off, and the tuning numbers that are not as usual."""
    changed = changed_numbers(settings.tuning)
    shown = {name: str(list(each)) if isinstance(each, tuple) else each for name, each in changed.items()}
    return {**asdict(settings.guards), "cutoff_hz": settings.tuning.data.cutoff_hz, **shown}
