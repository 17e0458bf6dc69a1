"""The diagnosis of a recording, step by step.

`diagnose` is the whole flow: filter the runs and make the columns (`prepare`), fit links and usual friction
(`fit_background`), search effects (`search_effects`), test and name them
(`find_names`), state their numbers (`state_numbers`).
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from armlab.common.errors import DataError
from armlab.diagnosis.formats import Status
from armlab.diagnosis.result import Claim, Diagnosis, JointFit, Unexplained
from armlab.diagnosis.settings import Baseline, Settings
from armlab.diagnosis.torque.columns.design import DesignMatrix, build_design_matrix
from armlab.diagnosis.torque.columns.links import link_prior
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.added_body import possible_links, with_possible_bodies
from armlab.diagnosis.torque.evidence.evidence import Evidence, Judge, count_looks
from armlab.diagnosis.torque.evidence.friction_curves import find_friction_curves, name_friction_curves
from armlab.diagnosis.torque.evidence.location import locate_excess, noise_floor
from armlab.diagnosis.torque.evidence.plausibility import (
    links_that_data_tell,
    unclaim_implausible,
    withdraw_implausible,
)
from armlab.diagnosis.torque.evidence.pruning import Pruned, prefer_one_body, prune, scan_what_is_left, withdraw
from armlab.diagnosis.torque.evidence.unknown import (
    is_form_error,
    is_structured,
    make_unknown_claim,
    names_contradicted_by_residual,
    predict_residual_structure,
)
from armlab.diagnosis.torque.names.additions import Additions, add_probable, with_likeliest_names
from armlab.diagnosis.torque.names.claims import Names, links_claim, make_claims
from armlab.diagnosis.torque.names.decide import named_claims
from armlab.diagnosis.torque.names.expected_parts import claim_expected_parts
from armlab.diagnosis.torque.names.findings import stated_findings, with_minor_ones, without_lesser_unknowns
from armlab.diagnosis.torque.names.weighing import weigh_effect, weigh_link, weigh_structure
from armlab.diagnosis.torque.predict.fits import joint_fits
from armlab.diagnosis.torque.predict.found_model import build_model
from armlab.diagnosis.torque.predict.joint_friction import joint_friction
from armlab.diagnosis.torque.predict.parts import LINKS, as_found, claim_facts, explain_error, weigh_claims, weigh_parts
from armlab.diagnosis.torque.predict.prediction import (
    Prediction,
    choose_smoothing,
    filtered_residual,
    fit_prediction,
    identification_runs,
    with_smoothing_of,
    with_usual,
)
from armlab.diagnosis.torque.predict.yardstick import (
    Yardstick,
    fit_yardstick,
    predicts_better,
    squared_errors,
    with_claims,
)
from armlab.diagnosis.torque.rows.data import Observed, in_fixed_order, observe
from armlab.diagnosis.torque.rows.simulation import read_simulation, reason_misread
from armlab.diagnosis.torque.search.fitted_model import (
    FittedModel,
    Progress,
    fit_background,
    fit_coloured_noise,
    inertial_parameters,
    search_effects,
)
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.diagnosis.tuning import ClaimTuning, changed_numbers
from armlab.effects.library import library
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.check import signs_of_wrong_reading
from armlab.recordings.identifiable import reason_not_identifiable
from armlab.recordings.reading.answer import Answer, read_rightly
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import Recording
from problem.base_parameters import base_parameters
from problem.pseudo_inertia import are_bodies


def diagnose(
    recording: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    settings: Settings | None = None,
    progress: Progress = lambda message: None,
    as_read: bool = False,
    only_setup: bool = False,
) -> Diagnosis:
    """Where the simulation and the recording differ, what physics is missing, and how much better it then predicts.

    baseline: what is compared; the simulation where there is one if left out. seed: of the surrogates' random waves.
    progress: is told what is being done. as_read: the recording and the robot file are not doubted. only_setup: nothing
    but the reading is asked. Raises InputError where the wanted baseline is not there.
    """
    started, settings = time.perf_counter(), settings or Settings()
    signs = signs_of_wrong_reading(recording)
    setup = None if as_read else find_setup(recording, baseline, settings, progress)
    read_after = time.perf_counter() - started
    if setup is not None:
        recording = setup.recording
        signs += tuple(each.finding for each in setup.doubts)
    if only_setup or (setup is not None and setup.is_lost):
        return with_setup(replace(_reading_alone(recording, baseline, settings, setup), signs=signs), setup, read_after)
    design = prepare(recording, baseline, settings, progress)
    if isinstance(design, Diagnosis):
        return with_setup(replace(design, signs=signs), setup, read_after)
    numbered = state_numbers(recording, find_names(design, seed, progress), progress)
    numbered = _only_if_explained(numbered, setup, settings.tuning.reading)
    found = replace(numbered, signs=signs, seconds=time.perf_counter() - started)
    return with_setup(found, setup, read_after)


def _only_if_explained(found: Diagnosis, setup: Answer | None, tuning: ReadingTuning) -> Diagnosis:
    """The diagnosis, or an inconclusive one where neither a reading nor physics explains the torque."""
    observed = found.observed
    if observed is None or found.simulation.kind == "simulated":
        return found
    held_out = np.concatenate([observed.torque[each.start : each.stop] for each in observed.of_role("validate")])
    left = np.array([each.after for each in found.fit]) / np.maximum(np.std(held_out, axis=0), SMALLEST_TORQUE)
    share = float(np.exp(np.mean(np.log(np.maximum(left, SMALLEST_SHARE)))))
    if share <= tuning.max_unexplained:
        return found
    tried = f", however it is read ({setup.looks} readings were tried)" if setup is not None and setup.looks > 1 else ""
    reason = (
        f"Links, friction and all other physics leave {share:.0%} of the recorded torque{tried}: another robot, or "
        "torque that is none? Move one joint alone and see which columns change."
    )
    return Diagnosis(found.recording, found.simulation, "inconclusive", reason, observed)


SMALLEST_TORQUE, SMALLEST_SHARE = 1e-12, 1e-6  # N m; of the torque


def _reading_alone(
    recording: Recording, baseline: Baseline | None, settings: Settings, setup: Answer | None
) -> Diagnosis:
    """What is said where physics is not asked. setup: how the recording is to be read, if that was asked."""
    simulation = read_simulation(recording, baseline)
    reason = reason_not_identifiable(recording)
    if reason is None and setup is not None and setup.looks == 0 and not setup.is_lost:
        reason = TOO_SHORT_TO_READ
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason)
    right = "Nothing else is wrong" if setup is not None and setup.sentence else "Nothing is wrong"
    return Diagnosis(recording, simulation, "none", f"{right} with the reading; physics was not asked.")


TOO_SHORT_TO_READ = (
    "The runs are too short, or the transmission cannot be undone, to tell how the recording is to be read: "
    "record longer runs."
)


def find_setup(
    recording: Recording, baseline: Baseline | None, settings: Settings, progress: Progress
) -> Answer | None:
    """How the recording and the robot file are to be read.

    None for a recording that cannot be used anyhow, and where the links of the robot file play no part.
    """
    simulation = read_simulation(recording, baseline)
    if simulation.kind == "simulated" or reason_not_identifiable(recording) is not None:
        return None
    progress("reading the recording rightly")
    return read_rightly(recording, simulation.inertial, settings.tuning.reading)


def with_setup(diagnosis: Diagnosis, setup: Answer | None, seconds: float) -> Diagnosis:
    """The diagnosis of a recording read rightly, with the mistakes of its reading."""
    if setup is None or not setup.findings:
        return replace(diagnosis, setup=setup, setup_seconds=seconds)
    return replace(diagnosis, status="mismatch", setup=setup, setup_seconds=seconds)


def prepare(
    recording: Recording, baseline: Baseline | None, settings: Settings, progress: Progress
) -> DesignMatrix | Diagnosis:
    """The runs filtered, and the columns of the links; a diagnosis where nothing can be said, and why."""
    simulation = read_simulation(recording, baseline)
    reason = reason_not_identifiable(recording)
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason)
    progress("filtering")
    observed = observe(in_fixed_order(recording.runs), simulation.arm, simulation.inertial, settings)
    reason = observed.reason_too_short(simulation.arm) or reason_misread(
        observed, simulation, settings.tuning.soundness
    )
    if reason is not None:
        return Diagnosis(recording, simulation, "inconclusive", reason, observed)
    base = base_parameters(simulation.arm)
    links = simulation.inertial
    prior = None if links is None or not are_bodies(links) else link_prior(simulation.arm, base, links)
    return build_design_matrix(observed, simulation, base, prior, settings)


def conclude(recording: Recording, searched: FittedModel, progress: Progress) -> Diagnosis:
    """Tests what a search found, withdraws names that do not hold, fits the model that predicts, and states numbers."""
    return state_numbers(recording, _keep_what_holds(searched, progress), progress)


def state_numbers(recording: Recording, named: "NamedEffects", progress: Progress) -> Diagnosis:
    """Adds what is probable, fits the model that predicts beside names that hold, and states numbers."""
    progress("weighing names")
    named, added = _with_probable(named)
    progress("fitting the model that predicts")
    prediction = with_possible_bodies(fit_prediction(named.model))
    progress("stating numbers")
    tuning = named.model.design.settings.tuning
    remains = [each for each in named.left if is_structured(each, tuning)]
    model, effects = unclaim_implausible(*claim_expected_parts(named.model, named.effects, prediction), remains)
    unknowns = [each for each in remains if not is_form_error(each, named.effects, tuning.unknown)]
    residual = model.residual(model.fit)
    names = Names(
        {group: added.names.get(group) or weigh_effect(model, group, effects, named.left) for group in effects},
        {link: weigh_link(model, link, each, effects, named.left) for link, each in named.links.items()},
    )
    model, claims = links_that_data_tell(model, make_claims(model, effects, named.links, prediction, names), remains)
    claims += tuple(
        make_unknown_claim(model, each, residual, weigh_structure(model, each, effects)) for each in unknowns
    )
    claims += tuple(_without_prediction_of(each, unknowns) for each in added.unnamed)
    weighed = (*(claim.weighed for claim in claims), *added.nothing)
    claims = named_claims(claims, named.model.design.settings, named.model.design.simulation.joints_without_friction)
    claims = (*claims, *links_in_doubt(model, prediction.model, claims))
    claims = stated_findings(weigh_claims(prediction.model, claims), model.columns.joints)
    return replace(_assemble(recording, model, prediction, claims, unknowns, remains), weighed=weighed)


def links_in_doubt(names: FittedModel, model: FittedModel, claims: Sequence[Claim]) -> Iterator[Claim]:
    """That links are off, where no claim says so and the model that predicts holds links that are.

    names: the model of the claims, model: the one that predicts. Links that were given to be fitted are no finding.
    """
    widths = model.state.widths
    about_links = any(claim_facts(each).where == "link" for each in claims)
    if model.design.simulation.kind == "nominal" and widths is not None and any(widths) and not about_links:
        evidence = Judge(model, model.state).together()
        off = [links_claim(names, evidence, link) for link, width in enumerate(widths, 1) if width]
        together = next(part for part in weigh_parts(model, off[:1]) if part.cause == LINKS and part.joint is None)
        if together.removal is not None and not together.removal.is_minor:
            yield max(weigh_claims(model, off), key=lambda each: each.removal.growth if each.removal else 0.0)


def _without_prediction_of(claim: Claim, unknowns: Sequence[Structure]) -> Claim:
    """An unnamed claim beside structure that is a finding, too: at one joint, the structure holds what it predicts."""
    same = any(each.joint + 1 == claim.joint for each in unknowns)
    return replace(claim, prediction=np.zeros_like(claim.prediction), left_out=0.0) if same else claim


def _with_probable(named: "NamedEffects") -> tuple["NamedEffects", Additions]:
    """Names that hold, the likeliest in each place, what is probable beside them, and what was weighed for that."""
    model, effects = with_likeliest_names(named.model, named.effects, named.left)
    named = replace(named, model=model, effects=effects)
    added = add_probable(named.model, named.left)
    effects = {each: evidence for each, evidence in named.effects.items() if each in added.model.state.groups}
    named = replace(named, model=added.model, effects=effects | added.effects)
    if added.effects and named.model.design.settings.guards.unknown:
        named = replace(named, left=predict_residual_structure(named.model, fit_coloured_noise(named.model)))
    return named, added


def find_names(design: DesignMatrix, seed: int, progress: Progress) -> "NamedEffects":
    """The effects that a search finds and that pass all tests."""
    return _keep_what_holds(search_effects(fit_background(design, library(), seed, progress), progress), progress)


def _keep_what_holds(searched: FittedModel, progress: Progress) -> "NamedEffects":
    progress("testing claims")
    return name_effects(prefer_one_body(find_friction_curves(scan_what_is_left(prune(searched)))))


@dataclass(frozen=True, eq=False)
class NamedEffects:
    """A model with the names that hold, by group and by link (from 0), and the structure that it leaves."""

    model: FittedModel
    effects: dict[int, Evidence]
    links: dict[int, Evidence]
    left: tuple[Structure, ...]


def name_effects(pruned: Pruned) -> NamedEffects:
    """Withdraws names that what is left at their joint contradicts; all are kept without the guard `unknown`."""
    model, effects, links = withdraw_implausible(pruned)
    tuning = model.design.settings.tuning
    if not model.design.settings.guards.unknown:
        return NamedEffects(model, effects, links, ())
    left, withdrawn = predict_residual_structure(model, fit_coloured_noise(model)), frozenset[int]()
    while doubtful := names_contradicted_by_residual(effects, left, tuning) - withdrawn:
        withdrawn |= doubtful
        contradicted = withdraw(model, doubtful, "what is left at its joint is no less structured", withdrawn)
        model, effects, links = withdraw_implausible(contradicted)
        left = predict_residual_structure(model, fit_coloured_noise(model))
    wrong = names_contradicted_by_residual(links, left, tuning)
    links = {link: each for link, each in links.items() if link not in wrong}
    (model, effects, links), left = name_friction_curves((model, effects, links), left)
    model, links = possible_links(model, links)
    return NamedEffects(model, effects, links, left)


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
        "unknown": [each.equation for each in claims if each.candidate is None],
        "in_links": [f"{each.effect}: {each.equation}" for each in claims if each.in_links],
    }
    plain = fit_yardstick(simulation.arm, observed)
    is_plain_best = plain is not None and simulation.kind != "simulated" and _is_beaten_by(plain, prediction)
    found = choose_smoothing(
        build_model(recording, simulation, prediction.model, named, notes), observed, tuning.prediction
    )
    if is_plain_best:
        assert plain is not None
        found = _delivered(plain, found, observed, claims)
    alone = build_model(recording, simulation, prediction.with_names_alone(named), named, {})
    alone = with_smoothing_of(found, alone)
    final = filtered_residual(found, observed, simulation)
    refit = model.residual(model.solver.fit(State((), None)))
    start = refit if simulation.kind == "refit" else design.target
    noise = final.copy()
    for each in unknowns:
        noise[:, each.joint] -= each.prediction
    floor = noise_floor(noise, design.features, observed, tuning.surrogate)
    fits = joint_fits(refit, (found, alone), plain, floor, observed, simulation, tuning)
    parts = explain_error(prediction.model, observed, claims, (start, final), floor)
    claims = without_lesser_unknowns(claims, parts)
    parts = explain_error(prediction.model, observed, claims, (start, final), floor)
    errors = [each.after for each in fits]
    parts = tuple(replace(each, removal=as_found(each.removal, errors, observed)) for each in parts)
    claims = tuple(replace(each, removal=as_found(each.removal, errors, observed)) for each in claims)
    claims = with_minor_ones(claims, parts)
    unnamed = _unnamed_gain(fits, tuning.claims) if not claims else None
    status: Status = "mismatch" if claims else "none" if unnamed is None else "inconclusive"
    base, covariance = prediction.model.base_parameters()
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
        friction=joint_friction(replace(model, state=with_usual(model, model.state.groups))),
        located=locate_excess(start, floor, observed, tuning.location) if claims else (),
        unexplained=tuple(
            Unexplained(each.joint + 1, float(np.clip(each.share, 0, 1)), each.depends_on) for each in remains
        ),
        fit=fits,
        steps=model.steps,
        looks=count_looks(model),
        settings=settings,
        unnamed=unnamed,
    )


def _unnamed_gain(fits: Sequence[JointFit], tuning: ClaimTuning) -> JointFit | None:
    """The joint whose held-out error falls most with parts that are present and not claimed, where that is much."""
    worst = min(fits, key=lambda each: each.after / max(each.before, 1e-300))
    return worst if worst.after < (1 - tuning.max_unnamed_gain) * worst.before else None


def _is_beaten_by(plain: Yardstick, prediction: Prediction) -> bool:
    """Whether plain least squares predicts blocks of the runs that identify better than the model that predicts."""
    judged, arm = prediction.judged, prediction.model.design.simulation.arm
    try:
        errors = squared_errors(arm, judged, prediction.block, plain.cutoff_hz)
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
