"""Findings whose numbers no engineer believes, or that say nothing: no names, with the reason in the log.

What an effect's parameters are on arms stands on the effect (`Parameter.plausible`, with its source). A law that fits
with other numbers stands for structure that the library lacks. An interval that holds zero, several orders of magnitude
or a whole circle is no knowledge of a parameter.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.evidence.added_body import mass_found_anew
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.evidence.pruning import first_failed_test
from armlab.diagnosis.torque.evidence.unknown import remaining
from armlab.diagnosis.torque.names.intervals import extend_with_shapes
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import FailedTest, Step
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.diagnosis.tuning import PlausibilityTuning
from armlab.effects.contract import Candidate, Kind, Parameter
from armlab.effects.library import effect_named
from armlab.effects.links import SolidBody
from armlab.effects.parameters import ParameterValue, parameter_values
from problem.arm import PARAMETER_NAMES

NOT_CLAIMED = "present, not claimed"
NEVER_NEGATIVE = ("mass", "m", "Ixx", "Iyy", "Izz")
SMALLEST_TORQUE = 1e-12  # N m; less is rounding


def unclaim_implausible(belief: Belief) -> Belief:
    """The effects whose numbers can be believed; the log says why not. The others stay as present, not claimed.

    A shift in time below one sampling interval is told by a model alone that leaves nothing structured: beside what is
    unknown it is how the log was made.
    """
    model, settings = belief.model, belief.model.design.settings
    doubts = doubtful_names(model, belief.effects, exact=not remaining(belief))
    held = {group: each for group, each in belief.present.items() if group in model.state.groups}
    failed = {group: test for group, each in held.items() if (test := first_failed_test(each, settings)) is not None}
    steps = [Step.against(model.candidate(group), test, NOT_CLAIMED) for group, test in (failed | doubts).items()]
    kept = {group: each for group, each in belief.effects.items() if group not in doubts}
    present = held | {group: belief.effects[group] for group in doubts}
    return replace(belief.with_steps(*steps), effects=kept, present=present)


def doubtful_names(
    model: FittedModel, effects: Mapping[int, Evidence], *, exact: bool = False
) -> dict[int, FailedTest]:
    """Why the numbers of a name cannot be believed, for each group of which that is so; exact: of a model that is."""
    if not effects or not model.design.settings.guards.physics_signs:
        return {}
    wide, observed = extend_with_shapes(model), model.design.observed
    tuning = model.design.settings.tuning
    out = {}
    for group in effects:
        coefficients = model.solver.values(model.fit, group)
        candidate = model.candidate(group).first_name(coefficients, model.design.scenes)
        covariance = wide.covariance(group)
        values = parameter_values(candidate, coefficients, covariance, wide.factor)
        if model.solver.simulated[group].any():
            values = tuple(map(_as_difference, values))
        reason = reason_implausible(candidate, values, observed, exact=exact, tuning=tuning.plausibility)
        if len(coefficients) == 1 and abs(coefficients[0]) <= wide.factor * np.sqrt(covariance[0, 0]):
            reason = reason or "its size may be zero"
        if reason is not None:
            out[group] = FailedTest("numbers that can be believed", reason)
    return out


def _as_difference(each: ParameterValue) -> ParameterValue:
    """A scalar that takes off what the simulation has of a law, by its size: the difference has either sign."""
    ends = _interval(each)
    if isinstance(each.value, tuple) or each.value >= 0 or ends is None:
        return each
    return replace(each, value=-each.value, interval=(-ends[1], -ends[0]))


def links_that_data_tell(
    model: FittedModel, claims: Sequence[Claim], left: Sequence[Structure]
) -> tuple[FittedModel, tuple[Claim, ...]]:
    """The claims without those on a link or a load of which these data do not tell; the log says why not.

    Structure is left without a name that could be much of what the claim explains; structure of the friction of a joint
    speaks of links at the joint alone that shows the claim best; at a joint beyond the link any structure speaks
    against it, because a later link may carry what was found. Or a load has another mass where it is found anew beside
    all that is named. left: what is structured beyond chance.
    """
    kept, steps, noise = [], list(model.steps), model.residual(model.fit)
    for each in left:
        noise[:, each.joint] -= each.prediction
    size = np.maximum(np.std(noise, axis=0), SMALLEST_TORQUE)
    for claim in claims:
        reason = reason_link_unknown(claim, left, size)
        reason = reason or _reason_other_mass(model, claim) or reason_no_body(model.design.simulation.inertial, claim)
        if reason is None:
            kept.append(claim)
        else:
            failed = FailedTest("links of which these data tell", reason)
            steps.append(Step(f"{NOT_CLAIMED}: {claim.effect} {claim.joint}: {reason}", 0.0, failed))
    return replace(model, steps=tuple(steps)), tuple(kept)


def reason_link_unknown(claim: Claim, left: Sequence[Structure], noise: Array) -> str | None:
    """Why these data do not tell of a claim about a link or its load; None where they do, and for other claims.

    noise: (joints,), N m, what is left at each joint beside structure. A joint tells of the claim by the square of its
    torque over the noise, and its share in what all joints tell is its weight. Structure could be so much of the claim:
    its size over that torque, times the weight of its joint.
    """
    if claim.candidate is None or claim.candidate.facts.where != "link":
        return None
    felt, link = np.std(claim.prediction, axis=0) / noise, claim.candidate.joints[0]
    for each in left:
        if each.joint != claim.evidence.joint and _is_of_friction(each):
            continue
        if each.joint >= link:
            return f"what is left without a name at joint {each.joint + 1} may be of a body that a later link carries"
        unnamed = float(np.std(each.prediction) / noise[each.joint])
        share = float(unnamed * felt[each.joint] / (felt @ felt))
        if share > 1 / 2:
            return f"what is left without a name at joint {each.joint + 1} could be {share:.0%} of it"
    return None


def _is_of_friction(each: Structure) -> bool:
    """Whether structure depends on the velocity and the load of its own joint alone: no link does that."""
    joint = each.joint + 1
    return bool(each.depends_on) and {*each.depends_on} <= {f"velocity_{joint}", f"torque_{joint}"}


def _reason_other_mass(model: FittedModel, claim: Claim) -> str | None:
    if not isinstance(claim.candidate, SolidBody):
        return None
    mass, found = claim.parameters[0], mass_found_anew(model, claim.candidate.joints[0])
    if found is None or mass.interval is None:
        return None
    low, high = np.ravel(mass.interval)
    if low <= found <= high:
        return None
    return f"found anew beside all that is named its mass is {found:.4g} kg, outside its interval"


def reason_no_body(given: Array | None, claim: Claim) -> str | None:
    """Why a link could not exist with what a claim adds to it: its mass or a moment of inertia is surely below zero.

    given: (10 * joints,) of the links of the simulation, None without one. An interval that reaches zero is no reason:
    a body with other numbers of the link within their intervals may exist.
    """
    if given is None or claim.joint is None or effect_named(claim.effect).where != "link":
        return None
    link = dict(zip(PARAMETER_NAMES, given[10 * (claim.joint - 1) : 10 * claim.joint].tolist(), strict=True))
    for each in claim.parameters:
        own, ends = link.get("m" if each.name == "mass" else each.name), _interval(each)
        if each.name in NEVER_NEGATIVE and own is not None and ends is not None and own + ends[1] < 0:
            return f"{each.name} of the link would be {own + ends[1]:.3g} {each.unit} at most"
    return None


def reason_implausible(
    candidate: Candidate,
    values: tuple[ParameterValue, ...],
    observed: Observed,
    *,
    exact: bool,
    tuning: PlausibilityTuning,
) -> str | None:
    """Why these parameters are not believed, in a few words; None where they are.

    exact: whether the model leaves nothing structured, so that a shift may be shorter than a sampling interval.
    """
    for parameter, each, value in _known_scalars(candidate, values):
        reason = None if exact else _reason_below_sampling(parameter, value, observed)
        reason = reason or _reason_unknown(parameter, each, tuning)
        reason = reason or _reason_out_of_range(parameter, each, candidate)
        if reason is not None:
            return reason
    return None


def is_of_no_arm(candidate: Candidate, values: tuple[ParameterValue, ...]) -> bool:
    """Whether a parameter is outside what arms have, its whole interval."""
    known = _known_scalars(candidate, values)
    return any(_reason_out_of_range(parameter, each, candidate) is not None for parameter, each, _ in known)


def _known_scalars(
    candidate: Candidate, values: tuple[ParameterValue, ...]
) -> Iterator[tuple[Parameter, ParameterValue, float]]:
    """Scalars that the effect names: the parameter, and its value with and without an interval."""
    facts = {each.name: each for each in candidate.facts.parameters}
    for each in values:
        if each.name in facts and not isinstance(each.value, tuple):
            yield facts[each.name], each, each.value


def _reason_below_sampling(parameter: Parameter, value: float, observed: Observed) -> str | None:
    interval = max(1 / each.run.rate_hz for each in observed.signals)
    if not parameter.sampled or abs(value) >= interval:
        return None
    return f"{parameter.name} {value:.3g}: less than one sampling interval ({interval:.3g} s) is how a log is made"


def _reason_unknown(parameter: Parameter, each: ParameterValue, tuning: PlausibilityTuning) -> str | None:
    """An interval that holds zero, spans orders of magnitude or is too wide for its parameter."""
    if parameter.detail:
        return None
    ends = _interval(each)
    if ends is None:
        return f"{each.name} is not determined" if parameter.positive else None
    low, high = ends
    shown = f"{each.name} is between {low:.3g} and {high:.3g} {each.unit}"
    if high - low > parameter.max_width:
        return f"{shown}: wider than {parameter.max_width:.3g} says nothing"
    if parameter.positive and low <= 0:
        return f"{shown}: it may be zero"
    if parameter.positive and high > tuning.max_interval_ratio * low:
        return f"{shown}: not even its order of magnitude is known"
    return None


def _reason_out_of_range(parameter: Parameter, each: ParameterValue, candidate: Candidate) -> str | None:
    """A parameter whose whole interval is outside what arms have."""
    if parameter.plausible is None or isinstance(each.value, tuple):
        return None
    kind: Kind = getattr(candidate, "kind", "revolute")
    lowest, highest = parameter.plausible.limits(kind)
    low, high = _interval(each) or (each.value, each.value)
    if high >= lowest and low <= highest:
        return None
    usual = f"{lowest:.3g} to {highest:.3g} {each.unit} ({parameter.plausible.source})"
    return f"{each.name} {each.value:.3g} {each.unit} is not plausible: {usual}"


def _interval(each: ParameterValue) -> tuple[float, float] | None:
    """The interval of a scalar parameter."""
    if each.interval is None or isinstance(each.value, tuple):
        return None
    low, high = each.interval
    return (float(low), float(high)) if not isinstance(low, tuple) and not isinstance(high, tuple) else None
