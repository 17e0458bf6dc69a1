"""How large an effect may plausibly be: coefficients are drawn to zero as weakly as these scales say.

Columns that nearly cancel would otherwise be fitted with sizes that no arm has, a link 20 cm too long beside a payload
of a hundred kilograms. A normal prior of a generous width costs a real effect nothing.
"""

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate

PRIOR_SCALES = {  # of coefficients, SI units
    "geometry_error": 0.02,  # m or rad
    "encoder_offset": 0.05,  # rad
    "base_tilt": 0.5,  # m/s2
    "torque_gain_error": 0.2,
    "time_delay": 0.01,  # s
    "channel_skew": 0.01,  # s
    "backlash": 0.01,  # rad
    "joint_elasticity": 1e-3,  # rad/(N m)
    "torque_saturation": 1.0,
    "load_dependent_friction": 0.3,
}
MAX_SCALE_RATIO = 3.0  # times its scale: a coefficient that no arm has
MAX_STATIC_RATIO = 4.0  # static over sliding friction
MAX_PAYLOAD_RATIO = 3.0  # times the mass of the links that carry a payload: in the mean square


def prior_scale(candidate: Candidate, inertial: Array | None) -> float:
    """Standard deviation of a candidate's coefficients; infinite where nothing is known. inertial: of all links."""
    if candidate.effect == "payload" and candidate.form == "point" and inertial is not None:
        return MAX_PAYLOAD_RATIO * float(np.mean(inertial[::10]))
    return PRIOR_SCALES.get(candidate.effect, np.inf)


def reason_implausible(candidate: Candidate, coefficients: Array) -> str | None:
    """What is absurd about the size of an effect; None where it may be."""
    if candidate.effect == "stribeck_friction":
        named = candidate.parameters(coefficients)
        if abs(float(np.sum(named["static_level"]))) > MAX_STATIC_RATIO * abs(float(np.sum(named["level"]))):
            return "friction that falls to a small part as the joint begins to move"
    scale = PRIOR_SCALES.get(candidate.effect, np.inf)
    largest = float(np.abs(coefficients).max(initial=0.0))
    return f"{largest:.3g} is more than any arm has" if largest > MAX_SCALE_RATIO * scale else None
