"""All effects: the built-in families, and users' own of the entry-point group `armlab.effects`."""

import warnings
from importlib.metadata import EntryPoint, entry_points

from armlab.common.errors import InputError, PlugInWarning, describe_failure
from armlab.common.plug_ins import BrokenPlugInError, load_plug_in
from armlab.common.settings import suggest_name
from armlab.effects.contact import EXTERNAL_CONTACT
from armlab.effects.contract import UNKNOWN, Effect, Family
from armlab.effects.coupling import JOINT_COUPLING
from armlab.effects.drive import ROTOR_INERTIA, TORQUE_GAIN, TORQUE_OFFSET, TORQUE_SATURATION
from armlab.effects.friction import (
    ASYMMETRIC,
    COULOMB_FRICTION,
    EARLY_FRICTION,
    LOAD_DEPENDENT,
    NONLINEAR_VISCOUS,
    STRIBECK,
    VISCOUS_FRICTION,
)
from armlab.effects.friction_curve import FRICTION_CURVE
from armlab.effects.geometry import BASE_TILT, ENCODER_OFFSET, GEOMETRY_ERROR
from armlab.effects.links import INERTIAL_ERROR, PAYLOAD
from armlab.effects.memory import FRICTION_DRIFT, PRESLIDING
from armlab.effects.servo import SERVO_EFFECTS
from armlab.effects.soft_base import FLEXIBLE_BASE
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
    FLEXIBLE_BASE,
    ENCODER_OFFSET,
    GEOMETRY_ERROR,
    TIME_DELAY,
    CHANNEL_SKEW,
    EXTERNAL_CONTACT,
    TORQUE_SATURATION,
    FRICTION_CURVE,
    EARLY_FRICTION,
)
_BUILT_IN_BY_NAME = {family.effect: family for family in BUILT_IN}
WITHOUT_FAMILY = {effect.id: effect for effect in (*SERVO_EFFECTS, UNKNOWN)}
EFFECT_IDS = (*(family.effect for family in BUILT_IN), *WITHOUT_FAMILY)
ENTRY_POINT_GROUP = "armlab.effects"


class BrokenEffectError(InputError):
    """An effect of a plug-in that cannot be used."""


class BrokenEffectWarning(PlugInWarning):
    """An effect of a plug-in is left out of the library."""


def library() -> tuple[Family, ...]:
    """Built-in families in the order of the documentation, then those of plug-ins by name.

    A plug-in's entry point is a Family, a class of one that takes no arguments, or a tuple of families. One that
    cannot be imported or is something else is left out with a warning; `family_named` says why where its effect may
    be meant.
    Raises BrokenEffectError, in one line, where one has the id of another.
    """
    families, origins = list(BUILT_IN), {family.effect: "armlab" for family in BUILT_IN}
    for entry in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda entry: entry.name):
        try:
            found = _load_families(entry)
        except BrokenEffectError as error:
            warnings.warn(f"{error}; left out", BrokenEffectWarning, stacklevel=1)  # once a process
            continue
        for family in found:
            if family.effect in origins:
                both = f"{origins[family.effect]} and by {entry.value}"
                raise BrokenEffectError(f"effect {family.effect!r} is registered by {both}")
            origins[family.effect] = entry.value
            families.append(family)
    return tuple(families)


def _load_families(entry: EntryPoint) -> tuple[Family, ...]:
    try:
        found = load_plug_in(entry)
        found = found() if isinstance(found, type) else found
    except BrokenPlugInError as error:
        raise BrokenEffectError(f"effect {entry.name!r} ({entry.value}) cannot be imported: {error}") from error
    except (Exception, SystemExit) as error:  # whatever a third party's class does when it is made
        reason = describe_failure(error)
        raise BrokenEffectError(f"effect {entry.name!r} ({entry.value}) cannot be made: {reason}") from error
    families = found if isinstance(found, tuple) else (found,)
    if not all(isinstance(each, Family) for each in families):
        raise BrokenEffectError(f"effect {entry.name!r} ({entry.value}) is no armlab.effects.contract.Family")
    return families


def family_named(name: str) -> Family:
    """The family of an effect; ValueError, with the nearest id, for an unknown one.

    Plug-ins are looked at only for a name that is not built in, which none of them can take.
    """
    if name in _BUILT_IN_BY_NAME:
        return _BUILT_IN_BY_NAME[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BrokenEffectWarning)
        known = {family.effect: family for family in library()}
    if name not in known:
        for entry in entry_points(group=ENTRY_POINT_GROUP):
            _load_families(entry)  # a broken one may be the one that is meant
        raise ValueError(f"unknown effect '{name}': {suggest_name(name, list(known))}")
    return known[name]


def effect_named(name: str) -> Effect:
    """The facts of an effect, of a servo or `unknown` included; ValueError, with the nearest id, for another name."""
    return WITHOUT_FAMILY[name] if name in WITHOUT_FAMILY else family_named(name).facts
