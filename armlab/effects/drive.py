"""What a drive adds or reads wrong: rotor inertia, torque gain and offset, a limit of torque."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import INERTIA, TORQUE, Effect, Parameter, Range, Scene, Value
from armlab.effects.term import SIGN_SIGMAS, EveryJoint, Term, format_number
from problem.arm import Arm

GAINS_SEEN = Range((0.5, 2.0), "torque constants: 5 to 10 %, rarely more; beyond a factor of two it is a unit")

ROTOR_INERTIA_FACTS = Effect(
    "rotor_inertia",
    "inertia of the motor behind the gear",
    (Parameter("inertia", INERTIA, positive=True),),
    law=r"\Delta\tau_j = \text{inertia} \; \ddot{q}_j",
    common=True,
    axis="acceleration",
    experiment="compare with the motor's data sheet; armlab next says whether any motion tells it from the link",
    figures="{inertia}",
)
TORQUE_GAIN_FACTS = Effect(
    "torque_gain_error",
    "torque read too large or too small",
    (Parameter("gain", "1", positive=True, plausible=GAINS_SEEN),),
    sentence="The torque of {place} is read too large or too small",
    figures="factor {gain}",
    law=r"\tau_{\text{recorded},j} = \text{gain} \; \tau_j",
    prior_scale=0.2,
    scales_torque=True,
    experiment="record the motion with and without a payload of known mass",
)
TORQUE_OFFSET_FACTS = Effect(
    "torque_offset",
    "constant torque",
    (Parameter("offset", TORQUE),),
    sentence="The torque of {place} has a constant part that {model} does not have",
    figures="{offset}",
    law=r"\Delta\tau_j = \text{offset}",
    usual=True,
    common=True,
    axis="time",
    experiment="hold a variety of poses, each reached from both directions",
)
TORQUE_SATURATION_FACTS = Effect(
    "torque_saturation",
    "torque that stays below a limit",
    (Parameter("limit", TORQUE, positive=True),),
    sentence="The torque of {place} stays below a limit that {model} does not have",
    figures="{limit}",
    law=r"|\tau_j| \le \text{limit}",
    prior_scale=1.0,
    scanned=True,
    experiment="repeat the motion at half the speed, where no torque comes near the limit",
)

KNEE_SHARES = (0.4, 0.6, 0.8)  # of the model's highest torque
LIMIT_SHARES = (0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 0.97, 0.985)  # of the model's highest torque


@dataclass(frozen=True)
class RotorInertia(Term):
    """inertia qdd."""

    facts = ROTOR_INERTIA_FACTS
    identical = ("inertial_parameter_error",)
    names = ("inertia",)

    def columns(self, scene: Scene) -> Array:
        return self._stacked(scene.motion.acceleration[:, self.own])

    def joint_fields(self, coefficients: Array) -> dict[str, float]:
        """`armature` of a simulator's joint."""
        return {"armature": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        return f"tau_{self.joint} += {format_number(coefficients[0])} qdd_{self.joint}"


@dataclass(frozen=True)
class TorqueGain(Term):
    """(gain - 1) tau_model of one joint, friction included."""

    facts = TORQUE_GAIN_FACTS
    identical = ("inertial_parameter_error",)
    names = ("gain",)
    follows_model = True
    of_channel = True

    def columns(self, scene: Scene) -> Array:
        """The torque of the present model."""
        return self._stacked(scene.torque[:, self.own])

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The factor: 1.09 is 9 % too much."""
        return {"gain": 1 + float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        return f"tau_{self.joint} *= {format_number(1 + coefficients[0])}"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        return cls.at(arm, joints[0]), np.array([parameters["gain"] - 1.0])


@dataclass(frozen=True)
class TorqueGainBySign(Term):
    """(gain - 1) tau_model of one joint where that is positive, (gain_below - 1) tau_model where it is negative.

    Two half-bridges of a current sensor, or a sensor that is bent at its zero.
    """

    facts = TORQUE_GAIN_FACTS
    form = "by sign"
    names = ("gain", "gain_below")
    size = 2
    follows_model = True
    of_channel = True

    def columns(self, scene: Scene) -> Array:
        """The torque of the present model above and below zero."""
        torque = scene.torque[:, self.own]
        return self._stacked(np.maximum(torque, 0), np.minimum(torque, 0))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The factors above and below zero."""
        return dict(zip(self.names, (1 + coefficients).tolist(), strict=True))

    def unit(self, name: str) -> str:
        return "1"

    def equation(self, coefficients: Array) -> str:
        above, below = (format_number(1 + value) for value in coefficients.tolist())
        return f"tau_{self.joint} *= {above} where it is positive, {below} where it is negative"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        return cls.at(arm, joints[0]), np.array([parameters[name] for name in cls.names]) - 1.0


@dataclass(frozen=True)
class TorqueOffset(Term):
    """offset: a constant torque."""

    facts = TORQUE_OFFSET_FACTS
    names = ("offset",)

    def columns(self, scene: Scene) -> Array:
        return self._stacked(np.ones(len(scene.time)))

    def equation(self, coefficients: Array) -> str:
        return f"tau_{self.joint} += {format_number(coefficients[0])}"


@dataclass(frozen=True)
class TorqueSaturation(Term):
    """|tau| <= limit: torque cut at a limit; shape: the limit. Its coefficient is one where the effect is real."""

    facts = TORQUE_SATURATION_FACTS
    names = ("limit",)
    follows_model = True
    of_channel = True

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Limits below the highest torque of the model."""
        top = max(float(np.abs(scene.torque[:, joint - 1]).max()) for scene in scenes)
        return [cls.at(arm, joint, shape=(x * top,), bounds=((0.4 * top, top),)) for x in LIMIT_SHARES if top > 0]

    def columns(self, scene: Scene) -> Array:
        """What the limit takes away from the torque of the present model."""
        torque, limit = scene.torque[:, self.own], self.shape[0]
        return self._stacked(np.clip(torque, -limit, limit) - torque)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        return {"limit": self.shape[0]}

    def equation(self, coefficients: Array) -> str:
        return f"|tau_{self.joint}| <= {format_number(self.shape[0])}"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A limit takes away all that is above it, no more and no less."""
        spread = 0.0 if covariance is None else SIGN_SIGMAS * float(np.sqrt(max(covariance[0, 0], 0.0)))
        if abs(coefficients[0] - 1) > 0.3 + spread:
            return f"takes away {coefficients[0]:.2f} of the torque above the limit, not all of it"
        return None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        limit = float(parameters["limit"])
        return cls.at(arm, joints[0], shape=(limit,), bounds=((limit / 2, limit * 2),)), np.ones(1)


@dataclass(frozen=True)
class TorqueBend(Term):
    """Torque that bends towards a limit: share sgn(tau) (|tau| - knee)^2 / knee less above a knee; shape: the knee."""

    facts = TORQUE_SATURATION_FACTS
    form = "soft"
    names = ("limit", "knee")
    follows_model = True
    of_channel = True

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Knees below the highest torque of the model."""
        top = max(float(np.abs(scene.torque[:, joint - 1]).max()) for scene in scenes)
        return [cls.at(arm, joint, shape=(x * top,), bounds=((0.2 * top, top),)) for x in KNEE_SHARES if top > 0]

    def columns(self, scene: Scene) -> Array:
        """What the bend takes away from the torque of the present model."""
        torque = scene.torque[:, self.own]
        knee = self.shape[0]
        return self._stacked(-np.sign(torque) * np.maximum(np.abs(torque) - knee, 0.0) ** 2 / knee)

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """The highest reading, where the bent line is level, and where the bend begins."""
        knee = self.shape[0]
        share = float(coefficients[0])
        return {"limit": knee * (1 + 0.25 / share) if share else float("inf"), "knee": knee}

    def unit(self, name: str) -> str:
        """Unit of a parameter; the knee has that of the limit."""
        return super().unit("limit")

    def equation(self, coefficients: Array) -> str:
        own, knee = self.joint, format_number(self.shape[0])
        bend = format_number(float(coefficients[0]) / self.shape[0])
        return f"tau_{own} -= {bend} sgn(tau_{own}) (|tau_{own}| - {knee})^2 where |tau_{own}| > {knee}"

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """A channel that bends reads less, not more."""
        spread = 0.0 if covariance is None else SIGN_SIGMAS * float(np.sqrt(max(covariance[0, 0], 0.0)))
        return "reads more than the torque above the knee" if coefficients[0] + spread <= 0 else None

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        limit, knee = (float(parameters[name]) for name in cls.names)
        bend = 0.25 / (limit / knee - 1)
        return cls.at(arm, joints[0], shape=(knee,), bounds=((knee / 2, knee * 2),)), np.array([bend])


ROTOR_INERTIA = EveryJoint(ROTOR_INERTIA_FACTS, (RotorInertia,))
TORQUE_GAIN = EveryJoint(TORQUE_GAIN_FACTS, (TorqueGain, TorqueGainBySign), resting=True)
TORQUE_OFFSET = EveryJoint(TORQUE_OFFSET_FACTS, (TorqueOffset,), resting=True)
TORQUE_SATURATION = EveryJoint(TORQUE_SATURATION_FACTS, (TorqueSaturation, TorqueBend), resting=True)
