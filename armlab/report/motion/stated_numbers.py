"""What is said of a diagnosis of motion only, by the rule of `armlab.report.account`: errors are of the replay."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from armlab.diagnosis.motion.motion_result import MotionDiagnosis, ServoFinding
from armlab.diagnosis.motion.naming import servo_naming
from armlab.diagnosis.result import MAX_MINOR_GROWTH
from armlab.diagnosis.torque.names.decide import Naming
from armlab.diagnosis.torque.names.findings import (
    MAX_STATED_CAUSES,
    MAX_STATED_OF_JOINT,
    StatedCause,
    Statement,
    state_name,
)
from armlab.diagnosis.torque.predict.parts import cause_of
from armlab.diagnosis.tuning import NamingTuning
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named

MAX_GAIN_ERROR = 0.2  # of the simulation's: a gain that is further off is never minor


@dataclass(frozen=True)
class StatedNumber:
    """A number of a servo with how it is stated. effect: `unknown` where its name is not probable enough.

    share: of the squared replay error that all findings take away. minor: nobody would miss it.
    """

    finding: ServoFinding
    naming: Naming
    effect: str
    statement: Statement
    share: float
    minor: bool

    @property
    def cause(self) -> str:
        """See `armlab.diagnosis.torque.predict.parts.cause_of`."""
        return cause_of(effect_named(self.effect))


def stated_numbers(diagnosis: MotionDiagnosis) -> tuple[StatedNumber, ...]:
    """The findings that may be stated, in the order of the law, those marked that are minor."""
    last = diagnosis.simulation.last_link
    known = [(each, servo_naming(each, last)) for each in diagnosis.findings]
    stated = [(each, naming, *_statement(each, naming, last)) for each, naming in known]
    kept = [row for row in stated if row[3].kind != "nothing"]
    gains = [max(each.before**2 - each.after**2, 0.0) for each, *_ in kept]
    whole = max(sum(gains), 1e-300)
    sample = max((1 / run.rate_hz for run in diagnosis.recording.runs), default=0.0)
    out = [
        StatedNumber(*row, share=gain / whole, minor=is_minor(row[0], sample))
        for row, gain in zip(kept, gains, strict=True)
    ]
    return _within_limits(out, sample)


def _statement(each: ServoFinding, naming: Naming, last: int) -> tuple[str, Statement]:
    effect = UNKNOWN.id if naming.is_unknown else each.effect
    probability = naming.probability_of(effect, each.joint)
    return effect, state_name(effect, probability, naming.members(NamingTuning()), {each.joint, last})


def is_always_stated(each: ServoFinding, sample: float) -> bool:
    """Whether it is a delay of more than a sample, s, or a gain that is off by a fifth: these are never minor."""
    if each.parameter.key == "delay":
        return abs(each.value - each.nominal) > sample
    return each.parameter.key == "kp" and not abs(each.value / each.nominal - 1) <= MAX_GAIN_ERROR


def is_minor(each: ServoFinding, sample: float) -> bool:
    """Whether the replay error without it is nearly as small."""
    if is_always_stated(each, sample) or not math.isfinite(each.nominal):
        return False
    return each.before < (1 + MAX_MINOR_GROWTH) * each.after


def _within_limits(numbers: Sequence[StatedNumber], sample: float) -> tuple[StatedNumber, ...]:
    """Of each joint the two that explain most, of four causes at most; the others but what is always told are minor."""
    out, fixed = list(numbers), {at for at, each in enumerate(numbers) if is_always_stated(each.finding, sample)}
    stated_at = [at for at, each in enumerate(out) if not each.minor]
    ordered = sorted(stated_at, key=lambda at: (at not in fixed, -out[at].share))
    causes: dict[str, float] = {}
    for at in ordered:
        causes[out[at].cause] = causes.get(out[at].cause, 0.0) + out[at].share
    main_causes = sorted(causes, key=lambda cause: -causes[cause])[:MAX_STATED_CAUSES]
    places: dict[int, int] = {}
    for at in ordered:
        joint = out[at].finding.joint
        places[joint] = places.get(joint, 0) + 1
        if at not in fixed and (places[joint] > MAX_STATED_OF_JOINT or out[at].cause not in main_causes):
            out[at] = replace(out[at], minor=True)
    return tuple(out)


def stated_causes(numbers: Sequence[StatedNumber]) -> tuple[StatedCause, ...]:
    """The causes of the findings, the one that explains most of the replay error first."""
    grouped: dict[str, list[int]] = {}
    for at, each in enumerate(numbers):
        grouped.setdefault(each.cause, []).append(at)
    causes = [
        StatedCause(
            cause,
            tuple(sorted({numbers[at].finding.joint for at in own})),
            sum(numbers[at].share for at in own),
            tuple(own),
        )
        for cause, own in grouped.items()
    ]
    return tuple(sorted(causes, key=lambda each: -each.share))
