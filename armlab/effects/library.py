"""All effects: the built-in families, and users' own of the entry-point group `armlab.effects`."""

from armlab.effects.contact import EXTERNAL_CONTACT
from armlab.effects.contract import Family
from armlab.effects.coupling import JOINT_COUPLING
from armlab.effects.drive import ROTOR_INERTIA, TORQUE_GAIN, TORQUE_OFFSET, TORQUE_SATURATION
from armlab.effects.extras import BrokenEffectError, registered_effects
from armlab.effects.friction import (
    ASYMMETRIC,
    COULOMB_FRICTION,
    LOAD_DEPENDENT,
    NONLINEAR_VISCOUS,
    STRIBECK,
    VISCOUS_FRICTION,
)
from armlab.effects.geometry import BASE_TILT, ENCODER_OFFSET, GEOMETRY_ERROR
from armlab.effects.links import INERTIAL_ERROR, PAYLOAD
from armlab.effects.memory import FRICTION_DRIFT, PRESLIDING
from armlab.effects.springs import CABLE_STIFFNESS, GRAVITY_COMPENSATOR, TORQUE_RIPPLE
from armlab.effects.timing import CHANNEL_SKEW, TIME_DELAY
from armlab.effects.transmission import BACKLASH, JOINT_ELASTICITY

BUILT_IN: tuple[Family, ...] = (
    COULOMB_FRICTION,
    VISCOUS_FRICTION,
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
    for origin, family in registered_effects():
        if any(family is own for own in BUILT_IN):  # armlab's own entry point, by which `predict` finds them
            continue
        if not isinstance(family, Family):
            raise BrokenEffectError(f"effect {family.effect!r} ({origin}) is no armlab.effects.contract.Family")
        if family.effect in origins:
            raise BrokenEffectError(
                f"effect {family.effect!r} is registered by {origins[family.effect]} and by {origin}"
            )
        origins[family.effect] = origin
        families.append(family)
    return tuple(families)
