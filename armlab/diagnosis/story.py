"""The story of a verdict: findings grouped by cause, largest first, with the share of the error that each explains.

The error is the squared held-out error over all joints, each in units of its own torque. It starts at the model found
without the torque of any finding. The torques of the causes are added one after the other, each time the one with which
the error falls most, so that the shares sum to at most one; within a cause its findings are added in the same way. A
share is of the gap between the start and the noise floor. What a surrogate predicts has the cause `unknown`: it is not
named physics, and the model found does not predict it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.data import rows_in
from armlab.diagnosis.report.words import claim_name, is_doubtful
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.effects.contract import Cause
from armlab.effects.library import effect_named
from problem.arm import Arm
from problem.joint_words import joints_in_words, links_in_words

K = TypeVar("K")
MAX_WORDS = 30  # of the sentence that tells a story
MIN_TOLD_SHARE = 0.01  # of the gap: less is not in that sentence


@dataclass(frozen=True)
class Chapter:
    """Findings with one cause. findings: their places among the claims, from 0. share: of the gap. names: theirs.

    doubtful: whether each of the findings may be nothing.
    """

    cause: Cause
    joints: tuple[int, ...]
    share: float
    findings: tuple[int, ...]
    names: tuple[str, ...]
    doubtful: bool = False


def with_story(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis, its summary beginning with the story in a sentence."""
    chapters = tell_story(diagnosis)
    if not chapters:
        return diagnosis
    sentence = story_sentence(chapters, diagnosis.simulation.arm)
    return replace(diagnosis, summary=f"{sentence} {diagnosis.summary}")


def tell_story(diagnosis: Diagnosis) -> tuple[Chapter, ...]:
    """The causes of a diagnosis, the one with the largest share first."""
    shares = [share or 0.0 for share in finding_shares(diagnosis)]
    chapters = [
        Chapter(
            cause,
            tuple(sorted({joint for place in own for joint in _joints(diagnosis, place)})),
            float(sum(shares[place] for place in own)),
            own,
            tuple(dict.fromkeys(claim_name(diagnosis.claims[place]) for place in own)),
            all(is_doubtful(diagnosis.claims[place]) for place in own),
        )
        for cause, own in _places_by_cause(diagnosis).items()
    ]
    return tuple(sorted(chapters, key=lambda each: -each.share))


def finding_shares(diagnosis: Diagnosis) -> tuple[float | None, ...]:
    """The share of the gap that each finding explains; None where there is no gap to measure it by."""
    observed, final, claims = diagnosis.observed, diagnosis.final, diagnosis.claims
    if observed is None or final is None or not claims:
        return (None,) * len(claims)
    held_out = [rows_in(observed.of_role("validate", joint), observed.rows) for joint in range(observed.joints)]
    torque = observed.torque
    scales = [max(float(np.mean(torque[rows, joint] ** 2)), 1e-300) for joint, rows in enumerate(held_out)]

    def stacked(values: Array) -> Array:
        """Held-out rows of all joints, each joint's mean square in units of its torque's."""
        units = [np.sqrt(scale * max(int(rows.sum()), 1)) for scale, rows in zip(scales, held_out, strict=True)]
        return np.concatenate([values[rows, joint] / units[joint] for joint, rows in enumerate(held_out)])

    torques = [stacked(claim.prediction) for claim in claims]
    left = stacked(final)
    floor = sum(each.noise_floor**2 / scale for each, scale in zip(diagnosis.fit, scales, strict=True))
    start = left + np.sum([stacked(claim.prediction - claim.left_out) for claim in claims], axis=0)
    gap = float(start @ start) - min(float(floor), float(left @ left))
    if gap <= 0:
        return (None,) * len(claims)
    causes = _places_by_cause(diagnosis)
    out = [0.0] * len(claims)
    remaining = start
    sums = {cause: np.sum([torques[each] for each in own], axis=0) for cause, own in causes.items()}
    for cause in add_in_order(start, sums):
        own_torques = {place: torques[place] for place in causes[cause]}
        for place, fall in add_in_order(remaining, own_torques).items():
            out[place] = fall / gap
        remaining = remaining - np.sum(list(own_torques.values()), axis=0)
    total = max(sum(max(each, 0.0) for each in out), 1.0)
    return tuple(max(each, 0.0) / total for each in out)


def add_in_order(start: Array, torques: Mapping[K, Array]) -> dict[K, float]:
    """How much the squared error falls with each torque, added to those with which it falls more."""
    left, waiting, out = start, dict(torques), dict[K, float]()
    while waiting:
        falls = {key: float(left @ left - (left - torque) @ (left - torque)) for key, torque in waiting.items()}
        best = max(falls, key=lambda key: falls[key])
        out[best] = falls[best]
        left = left - waiting.pop(best)
    return out


def claims_by_share(diagnosis: Diagnosis) -> list[tuple[Claim, float]]:
    """The findings with the share of the error that each explains, the largest first."""
    shares = [share or 0.0 for share in finding_shares(diagnosis)]
    return sorted(zip(diagnosis.claims, shares, strict=True), key=lambda each: -each[1])


def story_sentence(chapters: Sequence[Chapter], arm: Arm) -> str:
    """The causes with their shares in one sentence of at most MAX_WORDS words; a share of several is never 100 %."""
    first, *others = chapters
    most = 100 - max(round(100 * sum(each.share for each in others)), 1) if others else 100
    share = min(round(100 * first.share), most)
    is_told_alone = all(each.share < MIN_TOLD_SHARE for each in others)
    more = "More than " if is_told_alone and share < round(100 * first.share) else ""
    sentence = f"{more}{share or 'Less than 1'} % of the error comes from {_cause_in_words(first, arm)}"
    for each in others:
        longer = f"{sentence}, {100 * each.share:.0f} % from {_cause_in_words(each, arm)}"
        if each.share < MIN_TOLD_SHARE or len(longer.split()) > MAX_WORDS:
            break
        sentence = longer
    return f"{sentence}."


def _cause_in_words(each: Chapter, arm: Arm) -> str:
    """The effect itself where there is only one, else what they have in common."""
    if each.cause == "unknown":
        name = "something without a name"
    elif len(each.names) == 1:
        name = each.names[0]
    else:
        name = {"links": "masses and inertias", "drive": "the drive"}.get(each.cause, each.cause)
    name = f"perhaps {name}" if each.doubtful else name
    if not each.joints:
        return name
    links = each.cause == "links"
    where = links_in_words(arm, each.joints) if links else joints_in_words(arm, each.joints)
    return f"{name} {'of' if links and len(each.names) > 1 else 'at'} {where}"


def _places_by_cause(diagnosis: Diagnosis) -> dict[Cause, tuple[int, ...]]:
    out: dict[Cause, tuple[int, ...]] = {}
    for place, claim in enumerate(diagnosis.claims):
        cause = (effect_named(claim.effect) if claim.candidate is None else claim.candidate.facts).cause
        out[cause] = (*out.get(cause, ()), place)
    return out


def _joints(diagnosis: Diagnosis, place: int) -> tuple[int, ...]:
    """The joint or link of a finding; none for the whole robot."""
    joint = diagnosis.claims[place].joint
    return () if joint is None else (joint,)
