"""What separates rivals where no motion does, or not clearly: a known load, a tilted base, a data sheet, or a second
encoder.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.next.first_run import PresentModel
from armlab.diagnosis.next.moments import Index
from armlab.diagnosis.next.prepare import PreparedQuestions
from armlab.diagnosis.next.question import (
    CLEAR_SEPARATION,
    Layout,
    Question,
    RivalLaw,
    build_layout,
    inseparable_rivals,
)
from armlab.effects.transmission import Transmission
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.joint_words import joint_in_words, links_in_words
from problem.motion import Motion
from problem.transforms import rotation_x

LOAD_KG = 1.0
LOAD_POSITION = (0.0, 0.0, 0.05)  # m, in the last link's frame
TILT_DEG = 10.0
ENCODER_NOISE = 2e-5  # rad (m): noise of a second encoder


@dataclass(frozen=True)
class Remedy:
    """A measure that separates rivals. separation: standard errors between them with it."""

    what: str
    separation: float


def find_remedies(
    prepared: PreparedQuestions, question: Question, pair: tuple[int, int], motion: Motion, times: Array
) -> list[Remedy]:
    """Remedies for a pair that separate it by more than one standard error, the best first.

    motion, times: of a run in which the remedy is used.
    """
    rivals = tuple(question.rivals[number] for number in pair)
    every = [
        *_remedy_by_load(prepared, question, rivals, motion, times),
        *_remedy_by_tilt(prepared, question, rivals, motion, times),
        *_remedy_by_removal(prepared, question, rivals, motion, times),
        *_remedy_by_data_sheet(prepared, rivals),
        *_remedy_by_encoder(prepared, rivals, motion, times),
    ]
    return sorted((each for each in every if each.separation > 1), key=lambda each: -each.separation)


def _remedy_by_load(
    prepared: PreparedQuestions, question: Question, rivals: tuple[RivalLaw, ...], motion: Motion, times: Array
) -> Iterator[Remedy]:
    """The same motion with and without a load that is known."""
    x, y, z = LOAD_POSITION
    moments = [1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    body = np.zeros(len(prepared.present.inertial))
    body[-10:] = LOAD_KG * np.array(moments)
    loaded = replace(prepared.present, inertial=prepared.present.inertial + body)
    grams = [prepared.moments(each.scene(motion, times)).gram for each in (prepared.present, loaded)]
    separation = _pair_separation(rivals, question.free, prepared.layout.prior + grams[0] + grams[1])
    yield Remedy(f"the motion with and without a known load of {LOAD_KG:g} kg at the flange", separation)


def _remedy_by_tilt(
    prepared: PreparedQuestions, question: Question, rivals: tuple[RivalLaw, ...], motion: Motion, times: Array
) -> Iterator[Remedy]:
    """The same motion on the level and on a base that is tilted by a known angle."""
    arm = _tilt_base(prepared.present.arm)
    base, layout = base_parameters(arm), prepared.layout
    prior = np.zeros((len(base), len(base)))
    present = prepared.present
    other = build_layout(base, list(layout.candidates), present.scene(motion, times), prior)
    free = [each for each, at in zip(layout.candidates, layout.places, strict=True) if at[0] in question.free]
    index = np.concatenate([np.arange(len(base)), *(other.indices_of(each) for each in free)]).astype(np.intp)
    keep, sampling = prepared.sampling.filter(len(times)), prepared.sampling
    tilted = PresentModel(arm, present.inertial, present.parts)
    grams = [other.moments(each.scene(motion, times), keep, sampling).gram for each in (present, tilted)]
    separation = _pair_separation(tuple(_rival_in_layout(each, other) for each in rivals), index, grams[0] + grams[1])
    yield Remedy(f"the motion on the level and with the base tilted by {TILT_DEG:g} degrees", separation)


def _tilt_base(arm: Arm) -> Arm:
    x, y, z = (rotation_x(np.deg2rad(TILT_DEG))[:3, :3].T @ np.array(arm.gravity)).tolist()
    return replace(arm, gravity=(x, y, z))


def _rival_in_layout(rival: RivalLaw, layout: Layout) -> RivalLaw:
    return replace(rival, laws=tuple(replace(law, columns=layout.indices_of(law.candidate)) for law in rival.laws))


def _pair_separation(rivals: tuple[RivalLaw, ...], free: Index, gram: Array) -> float:
    question = Question(rivals, free, free, inseparable_rivals(rivals, free, gram))
    return question.separation(gram, 0, 1)


def _remedy_by_removal(
    prepared: PreparedQuestions, question: Question, rivals: tuple[RivalLaw, ...], motion: Motion, times: Array
) -> Iterator[Remedy]:
    """The same motion with and without what a link carries: a load is gone then, a wrong link is still wrong."""
    for rival in rivals:
        facts = rival.name.facts
        if facts.where == "link" and not facts.in_links:
            with_it = prepared.moments(prepared.present.scene(motion, times)).gram
            without = with_it.copy()
            for law in rival.laws:
                without[law.columns] = 0
                without[:, law.columns] = 0
            separation = _pair_separation(rivals, question.free, prepared.layout.prior + with_it + without)
            link = links_in_words(prepared.present.arm, rival.laws[0].candidate.joints[:1])
            yield Remedy(f"the motion with and without the load on {link}", separation)


def _remedy_by_data_sheet(prepared: PreparedQuestions, rivals: tuple[RivalLaw, ...]) -> Iterator[Remedy]:
    """A value that the maker states."""
    for rival in rivals:
        armature = rival.laws[0].candidate.joint_fields(rival.values).get("armature")
        if armature is not None:
            accuracy = abs(armature) / CLEAR_SEPARATION
            own = joint_in_words(prepared.present.arm, rival.laws[0].candidate.joints[0])
            what = f"a data sheet that gives the rotor inertia of {own} to {accuracy:.3g} kg m2"
            yield Remedy(what, CLEAR_SEPARATION)


def _remedy_by_encoder(
    prepared: PreparedQuestions, rivals: tuple[RivalLaw, ...], motion: Motion, times: Array
) -> Iterator[Remedy]:
    """An encoder behind the gear measures the twist of the drive train."""
    for rival in rivals:
        candidate, size = rival.laws[0].candidate, float(rival.values[0])
        if isinstance(candidate, Transmission) and size > 0:
            torque = prepared.present.scene(motion, times).torque[:, candidate.index]
            twist = size * _static_twist(candidate, torque)
            separation = float(np.sqrt(np.sum((twist - twist.mean()) ** 2))) / ENCODER_NOISE
            own = joint_in_words(prepared.present.arm, candidate.index + 1)
            what = f"a second encoder behind the gear of {own} with {ENCODER_NOISE:g} rad of noise"
            yield Remedy(what, separation)


def _static_twist(candidate: Transmission, torque: Array) -> Array:
    """Twist (samples,), rad (m), under a slow torque (samples,), N m (N), for a coefficient of one."""
    law, coefficient = candidate.law
    twist = np.sign(torque) * law.gap / 2 if law.gap > 0 else torque / law.stiffness
    return np.asarray(twist / coefficient)
