"""All effects: the built-in families, and users' own of the entry-point group `armlab.effects`."""

from diagnosis.effects.asymmetry import ASYMMETRIC
from diagnosis.effects.compensator import GRAVITY_COMPENSATOR
from diagnosis.effects.contact import EXTERNAL_CONTACT
from diagnosis.effects.contract import Family
from diagnosis.effects.coupling import JOINT_COUPLING
from diagnosis.effects.drive import ROTOR_INERTIA, TORQUE_GAIN, TORQUE_OFFSET, TORQUE_SATURATION
from diagnosis.effects.friction import COULOMB, NONLINEAR_VISCOUS, VISCOUS
from diagnosis.effects.friction_drift import FRICTION_DRIFT
from diagnosis.effects.hysteresis import PRESLIDING
from diagnosis.effects.inertial_error import INERTIAL_ERROR
from diagnosis.effects.kinematics import ENCODER_OFFSET, GEOMETRY_ERROR
from diagnosis.effects.load_friction import LOAD_DEPENDENT
from diagnosis.effects.mounting import BASE_TILT
from diagnosis.effects.payload import PAYLOAD
from diagnosis.effects.ripple import TORQUE_RIPPLE
from diagnosis.effects.spring import CABLE_STIFFNESS
from diagnosis.effects.stribeck import STRIBECK
from diagnosis.effects.timing import CHANNEL_SKEW, TIME_DELAY
from diagnosis.effects.transmission import BACKLASH, JOINT_ELASTICITY
from identification.extras import BrokenEffectError, registered

BUILT_IN: tuple[Family, ...] = (
    COULOMB,
    VISCOUS,
    NONLINEAR_VISCOUS,
    STRIBECK,
    ASYMMETRIC,
    LOAD_DEPENDENT,
    PRESLIDING,
    FRICTION_DRIFT,
    ROTOR_INERTIA,
    TORQUE_GAIN,
    TORQUE_OFFSET,
    TORQUE_RIPPLE,
    JOINT_ELASTICITY,
    BACKLASH,
    JOINT_COUPLING,
    GRAVITY_COMPENSATOR,
    CABLE_STIFFNESS,
    PAYLOAD,
    INERTIAL_ERROR,
    BASE_TILT,
    ENCODER_OFFSET,
    GEOMETRY_ERROR,
    TIME_DELAY,
    CHANNEL_SKEW,
    EXTERNAL_CONTACT,
    TORQUE_SATURATION,
)


def library() -> tuple[Family, ...]:
    """Built-in families in the order of the vocabulary, then users' own by name.

    An entry point is a Family, a class of one that takes no arguments, or a tuple of families. Raises
    BrokenEffectError, in one line, where one cannot be imported, is something else, or has the id of another.
    """
    families, origins = list(BUILT_IN), {family.effect: "armlab" for family in BUILT_IN}
    for origin, family in registered():
        if any(family is own for own in BUILT_IN):  # armlab's own entry point, by which `predict` finds them
            continue
        if not isinstance(family, Family):
            raise BrokenEffectError(f"effect {family.effect!r} ({origin}) is no diagnosis.effects.contract.Family")
        if family.effect in origins:
            raise BrokenEffectError(
                f"effect {family.effect!r} is registered by {origins[family.effect]} and by {origin}"
            )
        origins[family.effect] = origin
        families.append(family)
    return tuple(families)
