"""The vocabulary of effects: ids, the parameters of each effect, and their units.

The models of `identify`, the verdicts of `diagnose` and the answers of concealed recordings use the same names.
"""

from dataclasses import dataclass
from typing import Literal

from armlab.common.settings import suggest_name

Kind = Literal["revolute", "prismatic"]
TORQUE, ANGLE, INERTIA = "{torque}", "{position}", "{inertia}"  # by how the joint moves
UNITS: dict[Kind, dict[str, str]] = {
    "revolute": {"torque": "N.m", "position": "rad", "inertia": "kg.m2"},
    "prismatic": {"torque": "N", "position": "m", "inertia": "kg"},
}


@dataclass(frozen=True)
class Parameter:
    """A parameter's name, its unit, and whether physics wants it positive."""

    name: str
    unit: str
    positive: bool = False

    def unit_for(self, kind: Kind = "revolute") -> str:
        """The unit at a joint that turns or slides."""
        return self.unit.format(**UNITS[kind])


@dataclass(frozen=True)
class Effect:
    """One effect: what it is in a line, and the parameters that a finding may give.

    where: `joint` for an effect at one joint, `coupling` where the torque and the motion are at two joints,
    `link` for parameters of a link, `robot` for an effect of the whole arm (its joint is null).
    """

    id: str
    meaning: str
    parameters: tuple[Parameter, ...] = ()
    where: Literal["joint", "coupling", "link", "robot"] = "joint"

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name; ValueError, with the right names, for an unknown one."""
        found = {parameter.name: parameter for parameter in self.parameters}
        if name not in found:
            raise ValueError(f"'{name}' is no parameter of {self.id}: {suggest_name(name, list(found))}")
        return found[name]


COULOMB = Parameter("level", TORQUE, positive=True)
VISCOUS = Parameter("coefficient", f"{TORQUE}.s/{ANGLE}", positive=True)
STIFFNESS = Parameter("stiffness", f"{TORQUE}/{ANGLE}", positive=True)
BODY = (Parameter("mass", "kg"), Parameter("centre", "m"), Parameter("inertia", "kg.m2"))
EFFECTS = (
    Effect("coulomb_friction", "constant torque against the motion", (COULOMB,)),
    Effect("viscous_friction", "torque proportional to velocity", (VISCOUS,)),
    Effect(
        "nonlinear_viscous_friction",
        "torque that grows with a power of velocity",
        (
            Parameter("coefficient", f"{TORQUE}/({ANGLE}/s)^exponent", positive=True),
            Parameter("exponent", "1", positive=True),
        ),
    ),
    Effect(
        "stribeck_friction",
        "friction that falls as slow motion gets faster",
        (
            COULOMB,
            Parameter("static_level", TORQUE, positive=True),
            Parameter("velocity", f"{ANGLE}/s", positive=True),
            Parameter("exponent", "1", positive=True),
        ),
    ),
    Effect(
        "asymmetric_friction",
        "friction that differs by direction",
        (Parameter("positive", TORQUE), Parameter("negative", TORQUE)),
    ),
    Effect(
        "load_dependent_friction",
        "friction that grows with the transmitted torque",
        (Parameter("coefficient", "1", positive=True),),
    ),
    Effect(
        "presliding_hysteresis",
        "friction that follows the way since a reversal",
        (COULOMB, STIFFNESS),
    ),
    Effect(
        "friction_drift",
        "viscous friction that changes as the joint warms",
        (
            Parameter("initial", f"{TORQUE}.s/{ANGLE}", positive=True),
            Parameter("final", f"{TORQUE}.s/{ANGLE}", positive=True),
            Parameter("time_constant", "s", positive=True),
        ),
    ),
    Effect("rotor_inertia", "inertia of the motor behind the gear", (Parameter("inertia", INERTIA, positive=True),)),
    Effect("torque_gain_error", "torque read too large or too small", (Parameter("gain", "1", positive=True),)),
    Effect("torque_offset", "constant torque", (Parameter("offset", TORQUE),)),
    Effect(
        "torque_ripple",
        "torque that waves with the joint angle",
        (
            Parameter("order", "1/rev", positive=True),
            Parameter("amplitude", TORQUE, positive=True),
            Parameter("phase", "rad"),
        ),
    ),
    Effect("joint_elasticity", "a spring in the drive train", (STIFFNESS,)),
    Effect("backlash", "a dead zone in the drive train", (Parameter("gap", ANGLE, positive=True),)),
    Effect(
        "joint_coupling",
        "torque from the motion of another joint",
        (VISCOUS, COULOMB, Parameter("inertia", INERTIA)),
        "coupling",
    ),
    Effect(
        "gravity_compensator",
        "a spring, linkage or gas cylinder against gravity",
        (
            STIFFNESS,
            Parameter("rest", ANGLE),
            Parameter("amplitude", TORQUE),
            Parameter("phase", "rad"),
            Parameter("offset", TORQUE),
        ),
    ),
    Effect(
        "cable_stiffness",
        "hoses and cables that pull the joint to a rest position",
        (STIFFNESS, Parameter("rest", ANGLE)),
    ),
    Effect("payload", "a body carried by a link", BODY, "link"),
    Effect(
        "inertial_parameter_error",
        "a link that is not as the simulation has it",
        BODY,
        "link",
    ),
    Effect("base_tilt", "gravity in another direction", (Parameter("gravity", "m/s2"),), "robot"),
    Effect("encoder_offset", "a joint's zero at another place", (Parameter("offset", ANGLE),)),
    Effect("geometry_error", "a link of another length", (Parameter("offset", "m"),)),
    Effect("time_delay", "torque recorded later than the motion", (Parameter("seconds", "s"),), "robot"),
    Effect("channel_skew", "one channel recorded later than the others", (Parameter("seconds", "s"),)),
    Effect(
        "external_contact",
        "a push during a stretch of time",
        (Parameter("start", "s"), Parameter("end", "s"), Parameter("peak", TORQUE)),
    ),
    Effect("torque_saturation", "torque that stays below a limit", (Parameter("limit", TORQUE, positive=True),)),
    Effect("unknown", "structure that no effect of this library explains"),
)
EFFECT_IDS = tuple(effect.id for effect in EFFECTS)


def effect_named(name: str) -> Effect:
    """The effect with an id; ValueError, with the nearest id, for an unknown one."""
    for effect in EFFECTS:
        if effect.id == name:
            return effect
    raise ValueError(f"unknown effect '{name}': {suggest_name(name, EFFECT_IDS)}")
