"""Friction without memory: Coulomb, viscous, powers of velocity, Stribeck, by direction, by load."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import (
    ANGLE,
    COULOMB_LEVEL,
    TORQUE,
    VISCOUS_COEFFICIENT,
    Effect,
    Parameter,
    Range,
    Scene,
    Value,
)
from armlab.effects.sensitivity import delay_signal
from armlab.effects.term import SIGN_SIGMAS, EveryJoint, Term, format_number, format_sum, top_speed
from problem.arm import Arm

POWER_EXPONENTS_SEEN = Range((0.2, 3.5), "from the root law to cubic friction (Bittencourt and Gunnarsson 2012)")
STRIBECK_SPEEDS_SEEN = Range(
    (1e-3, 0.5),
    "0.025 to 0.05 rad/s on geared arms (Bittencourt and Gunnarsson 2012), a tenth to ten times",
    (1e-4, 0.1),
)
LOAD_SHARES_SEEN = Range((0.0, 0.5), "what gears lose: half of the torque at most")

COULOMB_FACTS = Effect(
    "coulomb_friction",
    "constant torque against the motion",
    (COULOMB_LEVEL, Parameter("velocity", f"{ANGLE}/s", positive=True, detail=True)),
    law=r"\Delta\tau_j = \text{level} \; \operatorname{sgn} \dot{q}_j",
    title="Coulomb friction",
    usual=True,
    dissipates=True,
    sticks=True,
    common=True,
    axis="velocity",
    experiment="record several constant speeds in both directions, slow ones too, with many reversals",
    figures="{level}",
)
VISCOUS_FACTS = Effect(
    "viscous_friction",
    "torque proportional to velocity",
    (VISCOUS_COEFFICIENT,),
    law=r"\Delta\tau_j = \text{coefficient} \; \dot{q}_j",
    usual=True,
    dissipates=True,
    common=True,
    axis="velocity",
    experiment="record the same speeds at different frequencies of motion, and several constant speeds",
    figures="{coefficient}",
)
NONLINEAR_VISCOUS_FACTS = Effect(
    "nonlinear_viscous_friction",
    "torque that grows with a power of velocity",
    (
        Parameter("coefficient", f"{TORQUE}/({ANGLE}/s)^exponent", positive=True),
        Parameter("exponent", "1", positive=True, plausible=POWER_EXPONENTS_SEEN),
    ),
    law=r"\Delta\tau_j = \text{coefficient} \; |\dot{q}_j|^{\text{exponent}} \operatorname{sgn} \dot{q}_j",
    dissipates=True,
    contains=("coulomb_friction", "viscous_friction"),
    one_of="friction laws",
    common=True,
    axis="velocity",
    experiment="record constant speeds up to the top of the speed range",
)
STRIBECK_FACTS = Effect(
    "stribeck_friction",
    "friction that falls as slow motion gets faster",
    (
        COULOMB_LEVEL,
        Parameter("static_level", TORQUE, positive=True),
        Parameter("velocity", f"{ANGLE}/s", positive=True, plausible=STRIBECK_SPEEDS_SEEN),
        Parameter("exponent", "1", positive=True, detail=True),
    ),
    law=(
        r"\Delta\tau_j = \left( \text{level} + (\text{static level} - \text{level}) \, e^{-(|\dot{q}_j| / "
        r"\text{velocity})^{\text{exponent}}} \right) \operatorname{sgn} \dot{q}_j"
    ),
    title="Stribeck friction",
    dissipates=True,
    sticks=True,
    contains=("coulomb_friction", "viscous_friction"),
    one_of="friction laws",
    axis="velocity",
    experiment="record slow creeping below three times the Stribeck velocity, in both directions",
)
ASYMMETRIC_FACTS = Effect(
    "asymmetric_friction",
    "friction that differs by direction",
    (Parameter("positive", TORQUE), Parameter("negative", TORQUE)),
    law=(
        r"\Delta\tau_j = \begin{cases} \text{positive} & \dot{q}_j > 0 \\ "
        r"-\text{negative} & \dot{q}_j < 0 \end{cases}"
    ),
    figures="{positive} forwards and {negative} backwards",
    dissipates=True,
    sticks=True,
    contains=("coulomb_friction", "viscous_friction"),
    one_of="friction laws",
    equal_sums=(("coulomb_friction", "torque_offset"), ("coulomb_friction", "cable_stiffness")),
    common=True,
    axis="velocity",
    experiment="pass the same poses in both directions at the same speeds",
)
LOAD_DEPENDENT_FACTS = Effect(
    "load_dependent_friction",
    "friction that grows with the transmitted torque",
    (Parameter("coefficient", "1", positive=True, plausible=LOAD_SHARES_SEEN),),
    law=r"\Delta\tau_j = \text{coefficient} \; |\tau_{\text{rigid},j}| \, \operatorname{sgn} \dot{q}_j",
    title="load-dependent friction",
    dissipates=True,
    sticks=True,
    contains=("coulomb_friction", "viscous_friction"),
    prior_scale=0.3,
    common=True,
    experiment="repeat one motion with two payloads, or one speed in two poses of different load",
    figures="{coefficient}",
)

EARLY_FACTS = Effect(
    "early_friction",
    "friction that turns before the joint does",
    (Parameter("impulse", f"{TORQUE}.s", positive=True), Parameter("lead", "s", detail=True)),
    law=r"\Delta\tau_j = \text{impulse} \; "
    r"(\operatorname{sgn} \dot{q}_j(t + \text{lead}) - \operatorname{sgn} \dot{q}_j(t)) / \text{lead}",
    title="friction that turns early",
    sentence="Friction turns before {place} does, which sticks at its reversals",
    prior_scale=0.1,
    common=True,
    axis="velocity",
    origin="friction",
    experiment="record faster reversals: the time for which the joint sticks becomes shorter, a delay does not",
    figures="{impulse}",
)

PARTS_PER_SAMPLE = 4  # of a sample's interval, for friction with memory


def direction_of_motion(scene: Scene, *joints: int) -> Array:
    """Mean of sgn(qd) over the interval from half a sample before to half a sample after, (samples,).

    joints: from 0; of several, the sign of the sum of their velocities. The velocity is taken as a straight line
    within the interval. The sign at the sample itself is off by up to one at each reversal, and by as much as the
    sampling is slow.
    """
    velocity = scene.motion.velocity[:, list(joints)].sum(axis=1)
    change = np.abs(scene.motion.acceleration[:, list(joints)].sum(axis=1)) * scene.step / 2
    steady = change <= np.abs(velocity)
    return np.asarray(np.where(steady, np.sign(velocity), velocity / np.where(steady, 1.0, change)))


def directions_apart(scene: Scene, joint: int) -> tuple[Array, Array]:
    """Shares of that interval that a joint, from 0, moves forwards, and (negative) backwards: (samples,) each."""
    side = direction_of_motion(scene, joint)
    return (1 + side) / 2, (side - 1) / 2


def positions_within_samples(scene: Scene, joint: int) -> Array:
    """Positions of a joint, from 0, at the middles of four parts of each sample's interval: (4 * samples,)."""
    motion = scene.motion
    shift = ((np.arange(PARTS_PER_SAMPLE) + 0.5) / PARTS_PER_SAMPLE - 0.5) * scene.step
    way = motion.velocity[:, joint, None] * shift + motion.acceleration[:, joint, None] * shift**2 / 2
    way[0] = np.where(shift > 0, way[0], 0.0)  # at rest before the run
    return np.asarray((motion.position[:, joint, None] + way).ravel())


def mean_within_samples(fine: Array) -> Array:
    """Means over the parts of each sample's interval, (samples,)."""
    return np.asarray(fine.reshape(-1, PARTS_PER_SAMPLE).mean(axis=1))


EARLY_LEADS = (0.003, 0.012)  # s, of a first look
EARLY_LEAD_RANGE = (0.001, 0.02)  # s
POWER_EXPONENTS = (0.3, 0.5, 0.7, 1.5, 2.0, 3.0)
POWER_EXPONENT_RANGE = (0.25, 4.0)


@dataclass(frozen=True)
class CoulombFriction(Term):
    """level sgn(qd)."""

    facts = COULOMB_FACTS
    names = ("level",)

    def columns(self, scene: Scene) -> Array:
        return self._stacked(direction_of_motion(scene, self.own))

    def joint_fields(self, coefficients: Array) -> dict[str, float]:
        """`frictionloss` of a simulator's joint."""
        return {"frictionloss": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        return f"tau_{self.joint} += {format_number(coefficients[0])} sgn(qd_{self.joint})"


@dataclass(frozen=True)
class SmoothCoulombFriction(Term):
    """level tanh(qd / velocity); turning: the velocity, rad/s (m/s), which is chosen and not fitted.

    The sign of the velocity of a joint that rests is that of the noise of its encoder. Here its friction is small.
    """

    turning: float = 1.0

    facts = COULOMB_FACTS
    names = ("level", "velocity")

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """None: as a candidate it would be a second name of the same law."""
        return []

    def columns(self, scene: Scene) -> Array:
        return self._stacked(np.tanh(scene.motion.velocity[:, self.own] / self.turning))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        return {"level": float(coefficients[0]), "velocity": self.turning}

    def joint_fields(self, coefficients: Array) -> dict[str, float]:
        """`frictionloss` of a simulator's joint, which has no such velocity."""
        return {"frictionloss": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        level, velocity = format_number(coefficients[0]), format_number(self.turning)
        return f"tau_{self.joint} += {level} tanh(qd_{self.joint} / {velocity})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        return cls.at(arm, joints[0], turning=float(parameters["velocity"])), np.array([parameters["level"]])


@dataclass(frozen=True)
class EarlyFriction(Term):
    """Friction at a reversal that turns before the joint does; shape: by how much at most, s.

    A joint that sticks stands still while its friction goes from one side to the other, and then sets off slowly.
    Motion that was smoothed seems to turn in the middle of that, later than the friction did. Where all friction, of
    level F, turns early by the lead, the impulse is F times the lead; where it goes over slowly, it is less.
    """

    facts = EARLY_FACTS
    names = ("impulse", "lead")
    of_time = True

    def columns(self, scene: Scene) -> Array:
        direction, lead = direction_of_motion(scene, self.own), self.shape[0]
        return self._stacked((delay_signal(scene, direction, -lead) - direction) / lead)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        return {"impulse": float(coefficients[0]), "lead": self.shape[0]}

    def equation(self, coefficients: Array) -> str:
        lead, impulse = format_number(self.shape[0]), format_number(coefficients[0])
        return f"tau_{self.joint} += {impulse} (sgn(qd_{self.joint}(t + {lead})) - sgn(qd_{self.joint}(t))) / {lead}"

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        return [cls.at(arm, joint, shape=(lead,), bounds=(EARLY_LEAD_RANGE,)) for lead in EARLY_LEADS]

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        lead = float(parameters["lead"])
        return cls.at(arm, joints[0], shape=(lead,), bounds=(EARLY_LEAD_RANGE,)), np.array([parameters["impulse"]])


@dataclass(frozen=True)
class ViscousFriction(Term):
    """coefficient qd."""

    facts = VISCOUS_FACTS
    names = ("coefficient",)

    def columns(self, scene: Scene) -> Array:
        return self._stacked(scene.motion.velocity[:, self.own])

    def joint_fields(self, coefficients: Array) -> dict[str, float]:
        """`damping` of a simulator's joint."""
        return {"damping": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        return f"tau_{self.joint} += {format_number(coefficients[0])} qd_{self.joint}"


@dataclass(frozen=True)
class PowerFriction(Term):
    """coefficient |qd|^exponent sgn(qd); shape: the exponent."""

    facts = NONLINEAR_VISCOUS_FACTS
    names = ("coefficient", "exponent")

    @property
    def outgrows_speed(self) -> bool:
        return self.shape[0] > 1

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Root, quadratic and cubic friction, and between."""
        return [cls.at(arm, joint, shape=(exponent,), bounds=(POWER_EXPONENT_RANGE,)) for exponent in POWER_EXPONENTS]

    def columns(self, scene: Scene) -> Array:
        return self._stacked(signed_power(scene.motion.velocity[:, self.own], self.shape[0]))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        return {"coefficient": float(coefficients[0]), "exponent": self.shape[0]}

    def equation(self, coefficients: Array) -> str:
        own = self.joint
        return f"tau_{own} += {format_number(coefficients[0])} |qd_{own}|^{format_number(self.shape[0])} sgn(qd_{own})"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        shape = (float(parameters["exponent"]),)
        return cls.at(arm, joints[0], shape=shape, bounds=(POWER_EXPONENT_RANGE,)), np.array(
            [parameters["coefficient"]]
        )


def signed_power(velocity: Array, exponent: float) -> Array:
    """|velocity|^exponent with the sign of velocity."""
    return np.asarray(np.sign(velocity) * np.abs(velocity) ** exponent)


COULOMB_FRICTION = EveryJoint(COULOMB_FACTS, (CoulombFriction, SmoothCoulombFriction))
EARLY_FRICTION = EveryJoint(EARLY_FACTS, (EarlyFriction,))
VISCOUS_FRICTION = EveryJoint(VISCOUS_FACTS, (ViscousFriction,))
NONLINEAR_VISCOUS = EveryJoint(NONLINEAR_VISCOUS_FACTS, (PowerFriction,))


MAX_STATIC_RATIO = 4.0  # static over sliding friction (chosen by eye)
STRIBECK_SPEEDS = (0.01, 0.03, 0.1)  # Stribeck velocities of a first look
STRIBECK_SPEED_RANGE = (0.002, 0.3)  # of the top speed
STRIBECK_EXPONENTS = (1.0, 2.0)  # Tustin's, and the Gaussian
STRIBECK_EXPONENT_RANGE = (0.5, 2.5)


@dataclass(frozen=True)
class StribeckFriction(Term):
    """(level + (static_level - level) exp(-(|qd| / velocity)^exponent)) sgn(qd); shape: velocity, exponent."""

    facts = STRIBECK_FACTS
    names = ("level", "static_level", "velocity", "exponent")
    size = 2
    replaces = ("coulomb_friction",)

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Velocities from a hundredth of the top speed up, with both usual exponents."""
        top = top_speed(scenes, joint)
        bounds = ((STRIBECK_SPEED_RANGE[0] * top, STRIBECK_SPEED_RANGE[1] * top), STRIBECK_EXPONENT_RANGE)
        shapes = [(share * top, exponent) for share in STRIBECK_SPEEDS for exponent in STRIBECK_EXPONENTS]
        return [cls.at(arm, joint, shape=shape, bounds=bounds) for shape in shapes]

    def columns(self, scene: Scene) -> Array:
        """Coulomb's column, and what static friction adds to it near rest."""
        velocity = scene.motion.velocity[:, self.own]
        side = direction_of_motion(scene, self.own)
        return self._stacked(side, side * self._rise(velocity))

    def _rise(self, velocity: Array) -> Array:
        scale, exponent = self.shape
        return np.asarray(np.exp(-((np.abs(velocity) / scale) ** exponent)))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        level, rise = (float(value) for value in coefficients)
        return {"level": level, "static_level": level + rise, "velocity": self.shape[0], "exponent": self.shape[1]}

    def equation(self, coefficients: Array) -> str:
        own, (scale, exponent) = self.joint, self.shape
        inner = f"exp(-(|qd_{own}|/{format_number(scale)})^{format_number(exponent)})"
        return f"tau_{own} += ({format_sum((coefficients[0], ''), (coefficients[1], inner))}) sgn(qd_{own})"

    def absurdity(self, coefficients: Array) -> str | None:
        """Static friction many times sliding friction, or a size that no arm has."""
        level, rise = (float(value) for value in coefficients)
        if abs(level + rise) > MAX_STATIC_RATIO * abs(level):
            return "friction that falls to a small part as the joint begins to move"
        return super().absurdity(coefficients)

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """Friction that feeds energy in, or that rises from rest."""
        spread = 0.0 if covariance is None else SIGN_SIGMAS * float(np.sqrt(max(covariance[1, 1], 0.0)))
        if coefficients[1] + spread < 0:
            return "static friction below sliding friction"
        return super().objection(coefficients, covariance)

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        level, static, scale, exponent = (float(parameters[name]) for name in cls.names)
        bounds = ((scale / 10, scale * 10), STRIBECK_EXPONENT_RANGE)
        return cls.at(arm, joints[0], shape=(scale, exponent), bounds=bounds), np.array([level, static - level])


STRIBECK = EveryJoint(STRIBECK_FACTS, (StribeckFriction,))


@dataclass(frozen=True)
class ByDirection(Term):
    """positive |qd|^exponent where qd > 0, -negative |qd|^exponent where qd < 0."""

    facts = ASYMMETRIC_FACTS
    names = ("positive", "negative", "exponent")
    size = 2
    exponent: ClassVar[float]

    def columns(self, scene: Scene) -> Array:
        if not self.exponent:
            return self._stacked(*directions_apart(scene, self.own))
        velocity = scene.motion.velocity[:, self.own]
        return self._stacked(np.maximum(velocity, 0), np.minimum(velocity, 0))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """One value a direction; both positive where they brake."""
        return {"positive": float(coefficients[0]), "negative": float(coefficients[1]), "exponent": self.exponent}

    def unit(self, name: str) -> str:
        if name == "exponent":
            return "1"
        unit = super().unit(name)
        return f"{unit}.s/{'rad' if self.kind == 'revolute' else 'm'}" if self.exponent else unit

    def equation(self, coefficients: Array) -> str:
        what = f"|qd_{self.joint}|" if self.exponent else ""
        forwards, backwards = format_sum((coefficients[0], what)), format_sum((-coefficients[1], what))
        return f"tau_{self.joint} += {forwards} for qd_{self.joint} > 0, {backwards} for qd_{self.joint} < 0"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A direction in which it drives."""
        spread = np.zeros(2) if covariance is None else SIGN_SIGMAS * np.sqrt(np.maximum(np.diag(covariance), 0))
        # an offset of the sensor may exceed friction one way: only a loop that gains energy is impossible
        loop = 0.0 if covariance is None else SIGN_SIGMAS * float(np.sqrt(max(covariance.sum(), 0.0)))
        if coefficients.sum() + loop < 0:
            return "friction that drives over a loop"
        if self.exponent and np.any(coefficients + spread < 0):
            return "friction that drives in one direction"
        return None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with a value a direction; levels or slopes, as the exponent says."""
        form = Levels if float(parameters["exponent"]) == 0 else Slopes
        if form.exponent != float(parameters["exponent"]):
            raise ValueError(f"exponent of asymmetric_friction should be 0 or 1, not {parameters['exponent']}")
        chosen: Any = form.at(arm, joints[0])
        return chosen, np.array([parameters["positive"], parameters["negative"]], dtype=float)


@dataclass(frozen=True)
class Slopes(ByDirection):
    """positive qd where qd > 0, negative qd where qd < 0: viscous friction by direction."""

    form = "slopes"
    exponent = 1.0
    replaces = ("viscous_friction",)


@dataclass(frozen=True)
class Levels(ByDirection):
    """positive where qd > 0, -negative where qd < 0: Coulomb friction by direction."""

    form = "levels"
    second_name = True
    exponent = 0.0
    replaces = ("coulomb_friction", "torque_offset")


@dataclass(frozen=True)
class LevelsAndSlopes(Term):
    """positive + positive_slope qd where qd > 0, -negative + negative_slope qd where qd < 0."""

    facts = ASYMMETRIC_FACTS
    form = "levels and slopes"
    names = ("positive", "negative", "positive_slope", "negative_slope")
    size = 4
    replaces = ("coulomb_friction", "viscous_friction", "torque_offset")

    def columns(self, scene: Scene) -> Array:
        velocity = scene.motion.velocity[:, self.own]
        forwards, backwards = np.maximum(velocity, 0), np.minimum(velocity, 0)
        return self._stacked(*directions_apart(scene, self.own), forwards, backwards)

    def unit(self, name: str) -> str:
        if name.endswith("slope"):
            return VISCOUS_COEFFICIENT.unit_for(self.kind)
        return super().unit(name)

    def equation(self, coefficients: Array) -> str:
        own = f"qd_{self.joint}"
        forwards = format_sum((coefficients[0], ""), (coefficients[2], own))
        backwards = format_sum((-coefficients[1], ""), (coefficients[3], own))
        return f"tau_{self.joint} += {forwards} for {own} > 0, {backwards} for {own} < 0"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A loop that gains energy at low speed, or at high."""
        for place in (slice(0, 2), slice(2, 4)):
            block = None if covariance is None else covariance[place, place]
            spread = 0.0 if block is None else SIGN_SIGMAS * float(np.sqrt(max(float(block.sum()), 0.0)))
            if coefficients[place].sum() + spread < 0:
                return "friction that drives over a loop"
        return None


ASYMMETRIC = EveryJoint(ASYMMETRIC_FACTS, (Levels, Slopes, LevelsAndSlopes))


@dataclass(frozen=True)
class LoadFriction(Term):
    """coefficient |tau_rigid| sgn(qd): the load is what the links need, from the model, never measured."""

    facts = LOAD_DEPENDENT_FACTS
    names = ("coefficient",)
    follows_model = True

    def columns(self, scene: Scene) -> Array:
        """The load with the sign of motion."""
        load = np.abs(scene.rigid_torque[:, self.own])
        return self._stacked(load * direction_of_motion(scene, self.own))

    def equation(self, coefficients: Array) -> str:
        own = self.joint
        return f"tau_{own} += {format_number(coefficients[0])} |tau_rigid_{own}| sgn(qd_{own})"


LOAD_DEPENDENT = EveryJoint(LOAD_DEPENDENT_FACTS, (LoadFriction,))
