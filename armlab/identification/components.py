"""Named terms that add to the rigid-body torque, linear in their coefficients.

Names and units are those of `recordings.vocabulary`. A spring is fitted as a q + b and told as stiffness and
rest position; a wave as a sin + b cos and told as amplitude and phase.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.library import effect_named
from problem.arm import Arm
from problem.motion import Motion

CoefficientMap = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Drive:
    """What a component may depend on, each (samples,): its own joint, and the joint that drives it.

    load: torque of the rigid model at its joint, N m; zeros where no component needs it.
    """

    position: Array
    velocity: Array
    acceleration: Array
    own_velocity: Array
    load: Array


@dataclass(frozen=True)
class Form:
    """How an effect looks: parameter names, the column of each coefficient, and held parameters.

    columns: from a drive and the value of the held parameter. named, linear: between coefficients and named
    parameters, None where they are the same.
    """

    names: tuple[str, ...]
    columns: Callable[[Drive, float], tuple[Array, ...]]
    held: str | None = None
    default: float = 1.0
    named: CoefficientMap | None = None
    linear: CoefficientMap | None = None


def spring_parameters(coefficients: Array) -> Array:
    """Stiffness and rest of a q + b."""
    slope, constant = coefficients
    return np.array([slope, -constant / slope if slope else 0.0])


def spring_coefficients(parameters: Array) -> Array:
    """Coefficients of stiffness (q - rest)."""
    stiffness, rest = parameters
    return np.array([stiffness, -stiffness * rest])


def wave_parameters(coefficients: Array) -> Array:
    """Amplitude and phase of a sin + b cos."""
    return np.array([np.hypot(*coefficients), np.arctan2(coefficients[1], coefficients[0])])


def wave_coefficients(parameters: Array) -> Array:
    """Coefficients of amplitude sin(. + phase)."""
    amplitude, phase = parameters
    return np.array([amplitude * np.cos(phase), amplitude * np.sin(phase)])


def _signed_power(velocity: Array, exponent: float) -> Array:
    return np.asarray(np.sign(velocity) * np.abs(velocity) ** exponent)


def _directional_columns(drive: Drive, exponent: float) -> tuple[Array, ...]:
    column = _signed_power(drive.velocity, exponent)
    return np.where(drive.velocity > 0, column, 0.0), np.where(drive.velocity < 0, column, 0.0)


def _wave_columns(drive: Drive, order: float) -> tuple[Array, ...]:
    return np.sin(order * drive.position), np.cos(order * drive.position)


def _spring_columns(drive: Drive, _: float) -> tuple[Array, ...]:
    return drive.position, np.ones_like(drive.position)


def _coupling_columns(drive: Drive, _: float) -> tuple[Array, ...]:
    """A motor that turns with both joints: its Coulomb friction follows the sum of the velocities."""
    return drive.velocity, np.sign(drive.velocity + drive.own_velocity), drive.acceleration


FORMS: dict[str, tuple[Form, ...]] = {
    "coulomb_friction": (Form(("level",), lambda drive, _: (np.sign(drive.velocity),)),),
    "viscous_friction": (Form(("coefficient",), lambda drive, _: (drive.velocity,)),),
    "nonlinear_viscous_friction": (
        Form(("coefficient",), lambda drive, p: (_signed_power(drive.velocity, p),), "exponent", 0.5),
    ),
    "asymmetric_friction": (Form(("positive", "negative"), _directional_columns, "exponent", 0.0),),
    "load_dependent_friction": (
        Form(("coefficient",), lambda drive, _: (np.abs(drive.load) * np.sign(drive.velocity),)),
    ),
    "rotor_inertia": (Form(("inertia",), lambda drive, _: (drive.acceleration,)),),
    "torque_offset": (Form(("offset",), lambda drive, _: (np.ones_like(drive.position),)),),
    "torque_ripple": (Form(("amplitude", "phase"), _wave_columns, "order", 1.0, wave_parameters, wave_coefficients),),
    "joint_coupling": (Form(("coefficient", "level", "inertia"), _coupling_columns),),
    "gravity_compensator": (
        Form(("stiffness", "rest"), _spring_columns, None, 1.0, spring_parameters, spring_coefficients),
        Form(("amplitude", "phase"), _wave_columns, None, 1.0, wave_parameters, wave_coefficients),
    ),
    "cable_stiffness": (
        Form(("stiffness", "rest"), _spring_columns, None, 1.0, spring_parameters, spring_coefficients),
    ),
}


@dataclass(frozen=True)
class Component:
    """One effect at a joint, counted from 1.

    driver: the joint whose motion matters, for a coupling. held: the value of the parameter that is not
    fitted (an exponent, an order). form: which of the effect's forms. Raises ValueError for an effect that is
    not linear in its parameters.
    """

    effect: str
    joint: int
    driver: int | None = None
    held: float | None = None
    form: int = 0

    def __post_init__(self) -> None:
        """Refuses what is no linear component."""
        effect_named(self.effect)
        if self.effect not in FORMS:
            raise ValueError(f"{self.effect} is not linear in its parameters: known are {', '.join(FORMS)}")
        if (self.driver is not None) != (self.effect == "joint_coupling"):
            raise ValueError(f"{self.effect} of joint {self.joint}: only a joint_coupling has a driving joint")

    @property
    def shape(self) -> Form:
        """Its form."""
        return FORMS[self.effect][self.form]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fitted parameters."""
        return self.shape.names

    @property
    def held_value(self) -> float:
        """Value of the parameter that is not fitted."""
        return self.shape.default if self.held is None else self.held

    @property
    def joints(self) -> tuple[int, ...]:
        """Where the torque appears, and where the motion is."""
        return (self.joint,) if self.driver is None else (self.joint, self.driver)

    @property
    def label(self) -> str:
        """Name for a table."""
        driver = f" from {self.driver}" if self.driver else ""
        held = f" ({self.shape.held} {self.held_value:g})" if self.shape.held else ""
        return f"{self.effect}{held}, joint {self.joint}{driver}"

    def columns(self, motion: Motion, load: Array | None = None) -> Array:
        """Columns of the torque at its joint, (samples, coefficients); load: (samples, joints), N m."""
        own, other = self.joint - 1, (self.driver or self.joint) - 1
        velocity = motion.velocity[:, other]
        drive = Drive(
            motion.position[:, other],
            velocity,
            motion.acceleration[:, other],
            motion.velocity[:, own],
            np.zeros_like(velocity) if load is None else load[:, own],
        )
        return np.column_stack(self.shape.columns(drive, self.held_value))

    def parameters(self, coefficients: Array) -> Array:
        """Named parameters of fitted coefficients."""
        return self.shape.named(coefficients) if self.shape.named else coefficients

    def coefficients(self, parameters: Mapping[str, float]) -> Array:
        """Coefficients of named parameters."""
        values = np.array([parameters[name] for name in self.names])
        return self.shape.linear(values) if self.shape.linear else values

    def unit(self, name: str, arm: Arm) -> str:
        """Unit of a parameter at this joint."""
        kind = arm.joints[self.joint - 1].kind
        if name == "exponent":
            return "1"
        unit = effect_named(self.effect).parameter(name).unit_for(kind)
        if self.effect == "asymmetric_friction" and self.held_value:
            return f"{unit}/({'rad' if kind == 'revolute' else 'm'}/s)^{self.held_value:g}"
        return unit


def every_joint(effect: str, joints: int, held: float | None = None) -> tuple[Component, ...]:
    """The effect at each joint of an arm."""
    return tuple(Component(effect, joint, held=held) for joint in range(1, joints + 1))


def neighbour_couplings(joints: int) -> tuple[Component, ...]:
    """Couplings between the last two joints, as wrists have them."""
    return (Component("joint_coupling", joints - 1, joints), Component("joint_coupling", joints, joints - 1))


def usual_components(joints: int) -> tuple[Component, ...]:
    """What every real arm has: viscous and Coulomb friction, rotor inertia, offset."""
    effects = ("viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset")
    return tuple(part for effect in effects for part in every_joint(effect, joints))
