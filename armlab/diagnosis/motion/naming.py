"""The names of a difference of a servo with their probabilities.

As for torque (`armlab.diagnosis.torque.names`): a finding has its own name and those of its rivals, or none of them is
right. What speaks against all of them is how little the number changes the replay, and how near it is to the
simulation's.
"""

import math

import numpy as np

from armlab.diagnosis.motion.motion_result import ServoFinding
from armlab.diagnosis.result import Weighed, WeighedName
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.names.decide import Naming, naming_of
from armlab.diagnosis.torque.names.weighing import negative_logarithm
from armlab.effects.contract import UNKNOWN

LAST_LINK_EFFECTS = ("payload",)  # rivals that are at the link of the tool
LARGEST_P_DIGITS, LARGEST_DISTANCE = 30, 100.0  # beyond which more says no more


def weigh_servo(finding: ServoFinding, last: int) -> Weighed:
    """The names of a finding. last: the link that carries the tool, from 1."""
    low, high = finding.interval
    half = max((high - low) / 2, 1e-300)
    stated = math.isfinite(finding.nominal)
    distance = abs(finding.value - finding.nominal) / half if stated else LARGEST_DISTANCE
    none = {
        "servo none": 1.0,
        "servo p": negative_logarithm(finding.p_value, LARGEST_P_DIGITS) / 10,
        "servo gain": float(np.log(max(finding.before / max(finding.after, 1e-300), 1.0))),
        "servo distance": float(np.log1p(min(distance, LARGEST_DISTANCE))),
        "servo not stated": float(not stated),
    }
    names = [_name(finding.effect, finding.joint, searched=True)]
    names += [
        _name(rival, last if rival in LAST_LINK_EFFECTS else finding.joint, searched=False) for rival in finding.rivals
    ]
    return (*names, WeighedName(UNKNOWN.id, finding.joint, (finding.joint,), none))


def servo_naming(finding: ServoFinding, last: int) -> Naming:
    """The probabilities of the names of a finding."""
    return naming_of(weigh_servo(finding, last), Settings())


def _name(effect: str, joint: int, *, searched: bool) -> WeighedName:
    return WeighedName(effect, joint, (joint,), {f"is {effect} of a servo": 1.0, "servo searched": float(searched)})
