"""Questions that users ask of a diagnosis, answered by computation: friction, wrist couplings, payload, skew, level."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, norm

from armlab.common.errors import InputError
from armlab.common.report.wording import format_number, format_unit
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.effects.contract import Candidate
from armlab.effects.coupling import JOINT_COUPLING
from armlab.effects.library import effect_named
from armlab.effects.parameters import ParameterValue
from armlab.effects.timing import CHANNEL_SKEW, TIME_DELAY
from armlab.effects.transmission import BACKLASH
from armlab.identification.identifier import Identifier
from armlab.proof.open.real_arms.direct_reading import DirectLevel, direct_levels
from armlab.proof.open.real_arms.judged_run import joint_rms
from armlab.proof.open.real_arms.one_arm import ArmStudy
from armlab.proof.open.real_identification.published import compare_with_published, fit_published_structure
from armlab.recordings.recording import Recording
from armlab.report.words import effect_in_words, format_probability, joint_unit, parameter_rows

MIN_FRICTION_SHARE = 0.15  # of the held-out error: what leaving friction out has to raise it by
MIN_AGREEMENT_P_VALUE = 0.01
MAX_STANDARD_ERRORS = 2.0  # combined standard errors
MIN_PUBLISHED_SHARE = 0.95  # of the base parameters: what so many standard errors hold of normal errors
SKEW_ASKED = ("emps",)
PUBLISHED = ("staubli-tx40",)
FRICTION_DEVICES = ("friction-damper",)  # robots whose force is friction: it shows the level by itself
LEVEL_DIRECTIONS = {"level": (1, -1), "positive": (1,), "negative": (-1,)}  # parameters, and where they act


@dataclass(frozen=True)
class Check:
    """asked: the question. holds: the answer, None where the data allow none. found: the numbers behind it."""

    arm: str
    baseline: str
    asked: str
    holds: bool | None
    found: str


def check_arm(study: ArmStudy) -> Iterator[Check]:
    """All checks of an arm."""
    yield from _friction_checks(study)
    for baseline, diagnosis in study.diagnoses.items():
        for joints in coupled_joints(study.recording):
            yield _coupling_check(study.name, baseline, diagnosis, joints)
        if study.name in SKEW_ASKED:
            yield _skew_check(study.name, baseline, diagnosis)
        if study.recording.robot in FRICTION_DEVICES:
            yield level_check(study.name, baseline, diagnosis, read_levels(study.recording))
            yield _play_check(study.name, baseline, diagnosis)
    if study.alone:
        yield _payload_check(study)
    if study.name in PUBLISHED:
        yield _published_check(study)


def claims_at(diagnosis: Diagnosis, joint: int) -> tuple[Claim, ...]:
    """The claims of a friction law at a joint; friction behind play is one."""
    return tuple(
        each for each in diagnosis.claims if each.candidate is not None and each.candidate.is_friction_of(joint)
    )


def _friction_checks(study: ArmStudy) -> Iterator[Check]:
    """By the chosen structure of `identify`: fitted again without the friction laws of one joint."""
    before = joint_rms(study.judged, study.identified.chosen.model_)
    for joint in range(1, len(study.recording.arm) + 1):
        fitted = _without_friction(study.identified.chosen, study.recording, joint)
        if fitted is None:
            continue
        after = joint_rms(study.judged, fitted.model_)[joint - 1]
        raised = float(after / before[joint - 1] - 1)
        unit = joint_unit(study.recording.arm, joint - 1)
        errors = f"{format_number(float(before[joint - 1]))} to {format_number(float(after))} {unit}"
        if raised < MIN_FRICTION_SHARE:
            continue
        asked = f"friction at joint {joint} is named"
        for baseline, diagnosis in study.diagnoses.items():
            laws = ", ".join(effect_in_words(each.effect) for each in claims_at(diagnosis, joint))
            found = f"{laws or 'none'}; without it {errors} (+{100 * raised:.0f} %)"
            yield Check(study.name, baseline, asked, bool(laws), found)


def _without_friction(chosen: Identifier, recording: Recording, joint: int) -> Identifier | None:
    """The identification without friction laws of a joint; None where it has none."""
    parts = tuple(chosen.components or ())
    kept: tuple[Candidate, ...] = tuple(each for each in parts if not each.is_friction_of(joint))
    if len(kept) == len(parts):
        return None
    return replace(chosen, components=kept).fit(recording.with_role("identify"))


def coupled_joints(recording: Recording) -> tuple[tuple[int, int], ...]:
    """Pairs (joint of the torque, joint of the motion), from 1, of joints whose drives the transmission couples."""
    mixed = np.abs(recording.transmission.position) > 0
    pairs = {(i + 1, j + 1) for i, j in np.argwhere(mixed).tolist() if i != j}
    return tuple(sorted(pairs | {(j, i) for i, j in pairs}))


def _coupling_check(arm: str, baseline: str, diagnosis: Diagnosis, joints: tuple[int, int]) -> Check:
    claims = [each for each in diagnosis.claims if each.effect == JOINT_COUPLING.effect and each.joints == joints]
    found = "; ".join(numbers_in_words(each) for each in claims) or "not named"
    return Check(arm, baseline, f"coupling at joint {joints[0]} from joint {joints[1]} is named", bool(claims), found)


def _skew_check(arm: str, baseline: str, diagnosis: Diagnosis) -> Check:
    claims = [each for each in diagnosis.claims if each.effect in (CHANNEL_SKEW.effect, TIME_DELAY.effect)]
    found = "; ".join(f"{effect_in_words(each.effect)}: {numbers_in_words(each)}" for each in claims) or "not named"
    return Check(arm, baseline, "neither skew nor delay is named", not claims, found)


def numbers_in_words(claim: Claim) -> str:
    """The parameters of a claim with their 95 % intervals; of a link without its inertias."""
    shown = [each for each in claim.parameters if not _is_inertia_of_link(claim, each)]
    texts = []
    for parameter in shown:
        for row in parameter_rows(parameter):
            interval = "" if is_held(parameter) else f" ({row.interval})"
            texts.append(f"{row.name} {row.value} {row.unit}".strip() + interval)
    return ", ".join(texts)


def _is_inertia_of_link(claim: Claim, parameter: ParameterValue) -> bool:
    return effect_named(claim.effect).where == "link" and parameter.unit == "kg.m2"


def is_held(parameter: ParameterValue) -> bool:
    """Whether a parameter has no interval, or one without width, because it was not fitted."""
    return parameter.interval is None or bool(np.all(np.ptp(np.array(parameter.interval).reshape(-1, 2), axis=1) == 0))


def _play_check(arm: str, baseline: str, diagnosis: Diagnosis) -> Check:
    """Whether play is named, or is among what a name cannot be told from."""
    claims = [
        each for each in diagnosis.claims if BACKLASH.effect in {each.effect, *(own.effect for own in each.rivals)}
    ]
    found = "; ".join(f"{effect_in_words(each.effect)}: {numbers_in_words(each)}" for each in claims) or "not named"
    return Check(arm, baseline, "play is named, or in a class with what is", bool(claims), found)


# --- level of friction, read directly


def read_levels(recording: Recording) -> tuple[DirectLevel, ...]:
    """The levels that the force of every run shows by itself."""
    return tuple(each for run in recording.runs for each in direct_levels(run))


def level_check(arm: str, baseline: str, diagnosis: Diagnosis, read: Sequence[DirectLevel]) -> Check:
    """Whether every level of friction that is claimed, with its interval, overlaps what the force shows."""
    unit = joint_unit(diagnosis.simulation.arm, 0)
    levels = [
        parameter
        for claim in claims_at(diagnosis, 1)
        for parameter in claim.parameters
        if parameter.name in LEVEL_DIRECTIONS and format_unit(parameter.unit) == unit
    ]
    named = ", ".join(f"{row.name} {row.value} ({row.interval})" for each in levels for row in parameter_rows(each))
    shown = "; ".join(
        f"{each.run} {'forward' if each.direction > 0 else 'back'} {format_number(each.median, 4)} "
        f"({format_number(each.lowest, 4)} to {format_number(each.highest, 4)}, {each.strokes} strokes)"
        for each in read
    )
    holds = bool(levels) and all(_overlaps(each, read) for each in levels)
    inside = sum(any(_contains(level, each) for level in levels) for each in read)
    found = f"{named or 'no level named'}; force shows {shown} {unit}; {inside} of {len(read)} lie in the interval"
    return Check(arm, baseline, "level of friction agrees with the force itself", holds, found)


def _overlaps(level: ParameterValue, read: Sequence[DirectLevel]) -> bool:
    ways = LEVEL_DIRECTIONS[level.name]
    own = np.abs(np.array(level.interval or (level.value, level.value), dtype=float))
    low = min(each.lowest for each in read if each.direction in ways)
    high = max(each.highest for each in read if each.direction in ways)
    return bool(own.min() <= high and own.max() >= low)


def _contains(level: ParameterValue, read: DirectLevel) -> bool:
    """Whether the interval of a level contains the median that the force shows in a direction that it acts in."""
    own = np.abs(np.array(level.interval or (level.value, level.value), dtype=float))
    return read.direction in LEVEL_DIRECTIONS[level.name] and bool(own.min() <= read.median <= own.max())


# --- the load of an arm from each of its runs


def mass_claims(diagnosis: Diagnosis) -> tuple[Claim, ...]:
    """Claims about the inertial parameters of a link."""
    return tuple(each for each in diagnosis.claims if effect_named(each.effect).where == "link")


@dataclass(frozen=True)
class Mass:
    """A mass that a run names, kg. links: the link that carries it, and others that fit as well."""

    links: tuple[int, ...]
    mass: ParameterValue


def named_mass(diagnosis: Diagnosis) -> Mass | None:
    """The mass with the smallest interval that a diagnosis names; None where it names none with an interval."""
    found = [
        Mass((claim.joint, *_other_links(claim)), parameter)
        for claim in mass_claims(diagnosis)
        for parameter in claim.parameters
        if claim.joint is not None and parameter.name == "mass" and parameter.interval is not None
    ]
    return min(found, key=lambda each: _interval_width(each.mass), default=None)


def _other_links(claim: Claim) -> Iterator[int]:
    for rival in claim.rivals:
        if rival.joint not in (None, claim.joint) and effect_named(rival.effect).where == "link":
            yield rival.joint


def _payload_check(study: ArmStudy) -> Check:
    masses = {each.run: named_mass(each.diagnosis) for each in study.alone}
    texts = []
    for run, found in masses.items():
        if found is None:
            texts.append(f"{run} tells of none")
        else:
            (row,) = parameter_rows(found.mass)
            links = " or ".join(str(each) for each in found.links)
            texts.append(f"{run} link {links}, {row.value} {format_unit(row.unit)} ({row.interval})")
    sized = [each for each in masses.values() if each is not None]
    sentence, p_value = mass_agreement([each.mass for each in sized])
    one_link = bool(sized) and bool(set.intersection(*(set(each.links) for each in sized)))
    holds = None if p_value is None else one_link and p_value > MIN_AGREEMENT_P_VALUE
    asked = "runs that alone tell of a load agree on it and its link"
    return Check(study.name, "nominal", asked, holds, f"{'; '.join(texts)}. {sentence}")


def _interval_width(parameter: ParameterValue) -> float:
    return float(np.ptp(np.array(parameter.interval, dtype=float)))


def mass_agreement(masses: Sequence[ParameterValue]) -> tuple[str, float | None]:
    """Whether masses with intervals can be one mass, and the p-value: chi-square of their weighted mean."""
    if len(masses) < 2:
        return "Too few of them give a mass to be compared.", None
    values = np.array([each.value for each in masses], dtype=float)
    widths = np.array([_interval_width(each) for each in masses])
    weights = 1 / (widths / (2 * float(norm.ppf(0.975)))) ** 2
    mean = float(weights @ values / weights.sum())
    p_value = float(chi2.sf(float(weights @ (values - mean) ** 2), len(values) - 1))
    word = "agree" if p_value > MIN_AGREEMENT_P_VALUE else "do not agree within their intervals"
    text = f"{len(values)} masses, weighted mean {mean:.4g} kg: they {word} (p {format_probability(p_value)})."
    return text, p_value


def _published_check(study: ArmStudy) -> Check:
    """Base parameters of `identify` with the terms of the published model, beside the published ones."""
    choice = study.identified.selection.choice
    share, errors = f"{100 * MIN_PUBLISHED_SHARE:.0f} %", f"{MAX_STANDARD_ERRORS:g} combined standard errors"
    asked = f"{share} of the published base parameters lie within {errors}"
    model = fit_published_structure(study.recording, choice.cutoff_hz, choice.position_factor)
    try:
        rows = compare_with_published(model)
    except InputError as error:
        return Check(study.name, "identify", asked, None, f"not compared: {error}")
    close = sum(each.ratio < MAX_STANDARD_ERRORS for each in rows)
    return Check(study.name, "identify", asked, close >= MIN_PUBLISHED_SHARE * len(rows), f"{close} of {len(rows)}")
