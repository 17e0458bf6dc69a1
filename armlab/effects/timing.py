"""Channels that were recorded late: the torque of all joints, or one channel.

Built from finite shifts of the model's torque, for friction jumps where a derivative would be infinite.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate, Effect, Parameter, Range, Scene
from armlab.effects.sensitivity import delay_signal
from armlab.effects.term import EveryJoint, Term, TermFamily, format_less
from problem.arm import Arm

LONGEST_SEEN = "buses, filters and logs take up to half a second"
TIME_DELAY_FACTS = Effect(
    "time_delay",
    "torque recorded later than the motion",
    (Parameter("seconds", "s", positive=True, plausible=Range((0.0, 0.5), LONGEST_SEEN), sampled=True),),
    sentence="Torque and motion are recorded at different times",
    figures="{seconds}",
    law=r"\tau_{\text{recorded}}(t) = \tau(t - \text{seconds})",
    where="robot",
    at_most_beside={"channel_skew": 1},
    prior_scale=0.01,
    origin="timing",
    experiment="record a multisine of high frequency: delay grows with frequency, viscous friction does not",
)
CHANNEL_SKEW_FACTS = Effect(
    "channel_skew",
    "one channel recorded later than the others",
    (Parameter("seconds", "s", plausible=Range((-0.5, 0.5), f"of either channel: {LONGEST_SEEN}"), sampled=True),),
    sentence="A channel of {place} is recorded at another time than the other channels",
    figures="{seconds}",
    law=r"\tau_{\text{recorded},j}(t) = \tau_j(t - \text{seconds})",
    prior_scale=0.01,
    origin="timing",
    experiment="correlate the channels on a fast motion, or trigger them from one clock",
)

SHIFTS = (1e-3, 4e-3, -4e-3)  # s, of a first look
LONGEST = 0.03  # s


@dataclass(frozen=True)
class LateTorque(Term):
    """tau(t - seconds) instead of tau(t) at its joints; shape: the shift that the column is made of, s.

    The column is (tau(t - shift) - tau(t)) / shift, so that the coefficient is the delay in seconds: exact
    where it is the shift, first order elsewhere.
    """

    follows_model = True
    of_time = True
    of_channel = True
    names = ("seconds",)

    def columns(self, scene: Scene) -> Array:
        """One column, at all its joints."""
        torque, shift = scene.torque[:, list(self.rows)], self.shape[0]
        return ((delay_signal(scene, torque, shift) - torque) / shift)[:, :, None]

    @classmethod
    def initial_shapes(cls, arm: Arm, joint: int, scenes: Sequence[Scene]) -> list[Self]:
        """Both signs: at a jump of friction they differ."""
        return [cls.at(arm, joint, shape=(shift,), bounds=((-LONGEST, LONGEST),)) for shift in SHIFTS]

    def with_shape(self, shape: tuple[float, ...]) -> Self:
        """The same with another shift, kept away from zero, where the column would be 0 / 0."""
        return super().with_shape((float(np.copysign(max(abs(shape[0]), 1e-5), shape[0])),))

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        seconds = float(parameters["seconds"])
        late = cls.at(arm, joints[0] if joints else 1, shape=(1e-3,), bounds=((-LONGEST, LONGEST),))
        return late.with_shape((seconds,)), np.array([seconds])


@dataclass(frozen=True)
class TimeDelay(LateTorque):
    """Torque of all joints late."""

    facts = TIME_DELAY_FACTS

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        return cls(None, (), tuple(range(len(arm))), **details)

    def equation(self, coefficients: Array) -> str:
        return f"tau(t) = tau_model({format_less('t', coefficients[0], 's')})"


@dataclass(frozen=True)
class TorqueSkew(LateTorque):
    """Torque of one joint late."""

    facts = CHANNEL_SKEW_FACTS
    form = "torque"

    def equation(self, coefficients: Array) -> str:
        return f"tau_{self.joint}(t) = tau_model_{self.joint}({format_less('t', coefficients[0], 's')})"


@dataclass(frozen=True)
class PositionSkew(Term):
    """Position of one joint early by `seconds` against everything else: its torque seems late."""

    facts = CHANNEL_SKEW_FACTS
    form = "position"
    names = ("seconds",)
    of_time = True
    follows_model = True

    @classmethod
    def at(cls, arm: Arm, joint: int, **details: Any) -> Self:
        """The effect at a joint; every joint's torque feels it."""
        return cls(joint, (joint,), tuple(range(len(arm))), **details)

    def columns(self, scene: Scene) -> Array:
        """Derivative of the rigid torque when this joint runs later."""
        index = self.joint - 1 if self.joint else 0
        velocity, acceleration = scene.motion.velocity[:, index], scene.motion.acceleration[:, index]
        jerk = np.gradient(acceleration, scene.step)
        column = -scene.torque_along(index, np.stack([velocity, acceleration, jerk]))
        friction = scene.torque[:, index] - scene.rigid_torque[:, index]  # follows this joint's motion, too
        column[:, index] += (delay_signal(scene, friction, SHIFTS[0]) - friction) / SHIFTS[0]
        return column[:, :, None]

    def equation(self, coefficients: Array) -> str:
        return f"q_{self.joint}(t) = q_recorded_{self.joint}({format_less('t', coefficients[0], 's')})"


@dataclass(frozen=True)
class DelayFamily(TermFamily):
    """One place: the whole robot."""

    facts: Effect = TIME_DELAY_FACTS
    terms: tuple[type[Term], ...] = (TimeDelay,)

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """The delay with each shift of a first look."""
        return [list(TimeDelay.initial_shapes(arm, 1, scenes))]


TIME_DELAY = DelayFamily()
CHANNEL_SKEW = EveryJoint(CHANNEL_SKEW_FACTS, (TorqueSkew, PositionSkew))
